"""ChArUco boards: a chessboard with a marker in each white square, of which a part in view is enough."""

from __future__ import annotations

from collections import Counter
from functools import cached_property

import cv2
import numpy as np

from flightd.core.errors import InputError
from flightd.core.types import Image
from flightd.vision.lens_calibration import FEWEST_PICTURES, BoardView

_FEWEST_CORNERS, _FEWEST_ASIDE = 8, 2
"""Of one picture; and so many of them beside any one row or column, or they tell no plane."""
_MARKER_SHARE = 0.75
"""Of a square's side.  Corners are refined where squares meet: boards of 0.5 to 0.9 are found as well."""
_PREFIX = "DICT_"


class CharucoBoard:
    """A ChArUco board by its *inner* corners and its markers' dictionary, "4X4_50".  Boards as OpenCV drew
    them before 4.6, with a marker in the first square, are found, too.  InputError where OpenCV knows no such
    dictionary, or it has too few markers."""

    def __init__(self, columns: int, rows: int, dictionary: str) -> None:
        self.columns, self.rows = columns, rows
        self.name = dictionary.upper().removeprefix(_PREFIX)
        code = getattr(cv2.aruco, _PREFIX + self.name, None)
        if not isinstance(code, int):
            raise InputError(f"no dictionary of ArUco markers is called {dictionary!r}", remedy="4X4_50, say")
        self._markers = cv2.aruco.getPredefinedDictionary(code)
        needed, there = (columns + 1) * (rows + 1) // 2, len(self._markers.bytesList)
        if needed > there:
            text = f"a {columns}x{rows} board has {needed} markers, the dictionary {self.name} only {there}"
            raise InputError(text, remedy="name the board's own")
        self._markers_seen = 0

    def view_of(self, bgr: Image) -> BoardView | None:
        """The inner corners seen, or None where they are too few to tell how the board lies."""
        grey = cv2.cvtColor(bgr, cv2.COLOR_BGR2GRAY)
        for board, detector in self._drawn:
            corners, ids, _, markers = detector.detectBoard(grey)
            if ids is not None and len(ids) >= _FEWEST_CORNERS:
                flat = np.asarray(board.getChessboardCorners(), np.float32)[np.ravel(ids)]
                if not _in_one_line(flat):
                    return BoardView(flat, np.asarray(corners, np.float32).reshape(-1, 2))
        self._markers_seen += markers is not None and len(markers) > 0
        return None

    def require(self, found: int) -> None:
        """InputError where so many views are too few."""
        if found >= FEWEST_PICTURES:
            return
        what = f"the {self.columns}x{self.rows} ChArUco board was found in {found} pictures"
        why = (
            f"its markers were seen in {self._markers_seen} more: check --board"
            if self._markers_seen
            else "check --charuco"
        )
        raise InputError(
            f"{what}, {FEWEST_PICTURES} are needed: show {_FEWEST_CORNERS} inner corners or more, tilted and"
            f" turned, in every part of the picture; {why}"
        )

    @cached_property
    def _drawn(self) -> list[tuple[cv2.aruco.CharucoBoard, cv2.aruco.CharucoDetector]]:
        size = self.columns + 1, self.rows + 1
        boards = [cv2.aruco.CharucoBoard(size, 1.0, _MARKER_SHARE, self._markers) for _ in range(2)]
        boards[1].setLegacyPattern(True)
        return [(board, cv2.aruco.CharucoDetector(board)) for board in boards]


def _in_one_line(on_board: np.ndarray) -> bool:
    """Whether hardly one corner lies beside one row or column."""
    fullest = max(max(Counter(places).values()) for places in on_board[:, :2].T.round().tolist())
    return len(on_board) - fullest < _FEWEST_ASIDE
