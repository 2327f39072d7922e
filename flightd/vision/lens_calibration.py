"""A camera's lens from pictures of a flat board (Zhang 2000, as OpenCV does it)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from flightd.core.errors import InputError
from flightd.core.geometry import Lens
from flightd.core.types import Image

FEWEST_PICTURES = 8
_MOST_ERROR_PX = 1.0


class BoardView(NamedTuple):
    """N corners of a board seen in one picture: (N, 3) on the board, in squares, and (N, 2) in pixels."""

    on_board: NDArray[np.float32]
    corners_px: NDArray[np.float32]


class Target(Protocol):
    """What is shown to the camera; the squares' size does not matter for the lens."""

    def view_of(self, bgr: Image) -> BoardView | None:
        """The corners seen, or None where they are not enough."""

    def require(self, found: int) -> None:
        """InputError where so many views are too few."""


@dataclass(frozen=True, slots=True)
class Board:
    """A chessboard by its *inner* corners, all of which have to be seen."""

    columns: int
    rows: int

    def view_of(self, bgr: Image) -> BoardView | None:
        """All inner corners, row by row, or None."""
        grey = cv2.cvtColor(bgr, cv2.COLOR_BGR2GRAY)
        found, corners = cv2.findChessboardCornersSB(grey, (self.columns, self.rows))
        if not found:
            return None
        flat = np.zeros((self.columns * self.rows, 3), np.float32)
        flat[:, :2] = np.mgrid[0 : self.columns, 0 : self.rows].T.reshape(-1, 2)
        return BoardView(flat, np.asarray(corners, np.float32).reshape(-1, 2))

    def require(self, found: int) -> None:
        """InputError where so many views are too few."""
        if found < FEWEST_PICTURES:
            raise InputError(
                f"the {self.columns}x{self.rows} board was found in {found} pictures, {FEWEST_PICTURES}"
                " are needed: show all of it, tilted and turned, in every part of the picture"
            )


@dataclass(frozen=True, slots=True)
class Calibration:
    """The lens, the root mean square of its reprojection error in pixels (of all views, and of each), and the
    standard deviation of the focal length."""

    lens: Lens
    error_px: float
    sigma_focal_px: float
    view_errors_px: tuple[float, ...] = ()


def calibrate(views: Sequence[BoardView], target: Target, width_px: int, height_px: int) -> Calibration:
    """Fit focal lengths, principal point and Brown-Conrady distortion to the boards seen in `views`.

    Raises InputError when there are too few views or they do not fit together.
    """
    target.require(len(views))
    error_px, matrix, distortion, *_, sigmas, _, view_errors = cv2.calibrateCameraExtended(
        [view.on_board for view in views],
        [view.corners_px for view in views],
        (width_px, height_px),
        np.eye(3),
        np.zeros(5),
    )
    if not error_px < _MOST_ERROR_PX:
        raise InputError(
            f"the pictures do not fit one lens (error {error_px:.2f} px): keep focus and zoom fixed and the"
            " board flat"
        )
    k1, k2, p1, p2, k3 = (float(v) for v in np.asarray(distortion).reshape(-1)[:5])
    lens = Lens(
        width_px,
        height_px,
        float(matrix[0, 0]),
        float(matrix[1, 1]),
        float(matrix[0, 2]),
        float(matrix[1, 2]),
        (k1, k2, p1, p2, k3),
    )
    each = tuple(float(error) for error in np.asarray(view_errors).reshape(-1))
    return Calibration(lens, float(error_px), float(np.asarray(sigmas).reshape(-1)[0]), each)
