"""Charge pads: dark square mats, wholly in the picture, with the guide lines painted over them.

Closing what is dark by more than a line's width joins the parts of a mat across the paint.  Whether such a
square is a pad of the map, by its size on the floor and its place, is for those to say who know the height.
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from flightd.core.types import Image, Line, PadSight
from flightd.vision.lines.sampling import Grid
from flightd.vision.lines.undistortion import Plane

_DARK = 0.6
"""A mat's brightness against that of the floor, at most."""
_LEAST_SIDE = 12
_LEAST_SQUARE = 0.8
_LEAST_FILL = 0.72
_LEAST_DARK = 0.5
"""Part of the square that must be mat itself, and not paint or gaps."""
_CLOSED = 1.3
"""Closing in widths of the lines seen."""
_THINNEST = 5
_DARKEST_SPOT = 0.25
"""A mat darkens some part of the picture as large as the least one at least so much."""


def find(coarse: Image, lines: Sequence[Line], grid: Grid, plane: Plane) -> tuple[PadSight, ...]:
    """The pads in the (grid.height, grid.width, 3) samples of a frame in which `lines` were seen."""
    grey = cv2.cvtColor(coarse, cv2.COLOR_BGR2GRAY)
    some = grey[::4, ::4].ravel()
    floor = float(np.partition(some, len(some) // 2)[len(some) // 2])
    dark = np.asarray(cv2.threshold(grey, _DARK * floor, 255, cv2.THRESH_BINARY_INV)[1], np.uint8)
    widest = max((line.width_px for line in lines), default=0.0) / grid.step
    size = max(_THINNEST, 2 * round(0.5 * _CLOSED * widest) + 1)
    if size > min(dark.shape) // 2 or cv2.countNonZero(dark) < _LEAST_DARK * _LEAST_SIDE**2:
        return ()
    spots = cv2.boxFilter(dark, -1, (_LEAST_SIDE, _LEAST_SIDE))
    if cv2.minMaxLoc(spots)[1] < 255 * _DARKEST_SPOT:
        return ()
    blots = cv2.morphologyEx(dark, cv2.MORPH_CLOSE, np.ones((size, size), np.uint8))
    count, labels, stats, _ = cv2.connectedComponentsWithStats(blots, connectivity=4)
    found = (
        _pad(labels == i, stats[i], dark, grid, plane) for i in range(1, count) if _whole(stats[i], grid)
    )
    return tuple(pad for pad in found if pad is not None)


def _whole(box: np.ndarray, grid: Grid) -> bool:
    """Large enough, and clear of the picture's edges."""
    x, y, width, height = (int(value) for value in box[:4])
    inside = x > 0 and y > 0 and x + width < grid.width and y + height < grid.height
    return inside and min(width, height) >= _LEAST_SIDE


def _pad(blot: np.ndarray, box: np.ndarray, dark: Image, grid: Grid, plane: Plane) -> PadSight | None:
    x, y, width, height, area = (int(value) for value in box[:5])
    part = np.ascontiguousarray(blot[y : y + height, x : x + width], np.uint8)
    outline = max(cv2.findContours(part, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)[0], key=len)
    (centre_i, centre_j), sides, _ = cv2.minAreaRect(outline)
    one, other = sides[0] + 1.0, sides[1] + 1.0  # contours run through the middles of the outer samples
    square, fill = min(one, other) / max(one, other), area / (one * other)
    matted = cv2.countNonZero(cv2.bitwise_and(dark[y : y + height, x : x + width], 255 * part)) / area
    if square < _LEAST_SQUARE or fill < _LEAST_FILL or matted < _LEAST_DARK:
        return None
    ideal_x, ideal_y = plane.ideal(grid.x(np.array([centre_i + x])), grid.y(np.array([centre_j + y])))
    side_px = float(np.sqrt(one * other)) * grid.step
    return PadSight(float(ideal_x[0]), float(ideal_y[0]), side_px, min(1.0, square * fill))
