"""From raw pixels to the distortion-free image plane in which lines are straight, and back."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np

from flightd.core.geometry import Lens
from flightd.vision.lines.band import Array

_ROUNDS, _CLOSE_PX = 4, 1e-4
NOWHERE_PX = 1e5
"""Where points lie that the lens model cannot have from anywhere."""


@dataclass(frozen=True, slots=True)
class Plane:
    """Pixel coordinates about the image centre, with the lens's distortion taken out when one is known."""

    width_px: int
    height_px: int
    lens: Lens | None = None

    @property
    def is_identity(self) -> bool:
        return self.lens is None or not self.lens.is_distorted

    def ideal(self, x: Array, y: Array) -> tuple[Array, Array]:
        """Where a distortion-free camera would see the raw points; any equal shapes.  Points that the lens
        model cannot have from anywhere are put at NOWHERE_PX."""
        lens = self.lens
        if lens is None or not lens.is_distorted:
            return x, y
        centre_x, centre_y = lens.centre_px
        points = np.stack([x.ravel() + centre_x, y.ravel() + centre_y], axis=-1)[:, None]
        if not len(points):
            return x, y
        matrix = lens.matrix()
        straight = np.asarray(
            cv2.undistortPoints(points, matrix, np.array(lens.distortion), P=matrix), np.float64
        ).reshape(-1, 2)
        ideal = straight.T.reshape(2, *x.shape)
        ideal_x, ideal_y = ideal[0] - centre_x, ideal[1] - centre_y
        # OpenCV stops after five rounds, a tenth of a pixel short in the corners of a wide lens.  A model
        # that folds inside the picture leads them ever farther away.
        with np.errstate(over="ignore", invalid="ignore"):
            for _ in range(_ROUNDS):
                raw_x, raw_y = self.raw(ideal_x, ideal_y)
                off_x, off_y = x - raw_x, y - raw_y
                if max(np.abs(off_x).max(), np.abs(off_y).max()) < _CLOSE_PX:
                    break
                ideal_x, ideal_y = ideal_x + off_x, ideal_y + off_y
            there = (np.abs(ideal_x) < NOWHERE_PX) & (np.abs(ideal_y) < NOWHERE_PX)
        return np.where(there, ideal_x, NOWHERE_PX), np.where(there, ideal_y, NOWHERE_PX)

    def raw(self, x: Array, y: Array) -> tuple[Array, Array]:
        """Where the real camera sees points of the distortion-free plane."""
        lens = self.lens
        if lens is None or not lens.is_distorted:
            return x, y
        k1, k2, p1, p2, k3 = lens.distortion
        centre_x, centre_y = lens.centre_px
        xn = (x + (centre_x - lens.cx_px)) / lens.fx_px
        yn = (y + (centre_y - lens.cy_px)) / lens.fy_px
        r2 = xn * xn + yn * yn
        radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
        xd = xn * radial + 2.0 * p1 * xn * yn + p2 * (r2 + 2.0 * xn * xn)
        yd = yn * radial + p1 * (r2 + 2.0 * yn * yn) + 2.0 * p2 * xn * yn
        return (
            xd * lens.fx_px + (lens.cx_px - centre_x),
            yd * lens.fy_px + (lens.cy_px - centre_y),
        )


def shortest_length(plane: Plane) -> float:
    """Shortest band reported, in pixels."""
    return 0.08 * math.hypot(plane.width_px, plane.height_px)
