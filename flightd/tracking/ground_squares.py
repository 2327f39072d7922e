"""Squares of the picture, pads and markers, as they lie on the floor."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TypeVar

from flightd.core.types import MarkerSight, PadSight
from flightd.tracking.tilt_compensation import FloorView, ground_point

_Square = TypeVar("_Square", PadSight, MarkerSight)


def placed_squares(
    squares: Iterable[_Square], view: FloorView, yaw_rad: float
) -> list[tuple[_Square, float, float, float]]:
    """Each square with its centre on the floor, in grid axes about the drone at the time of the frame, and
    the length of its sides; without those that the view cannot place."""
    cos, sin = math.cos(yaw_rad), math.sin(yaw_rad)
    found = []
    for square in squares:
        point = ground_point(square.x_px, square.y_px, view)
        if point is not None:
            forward, right, metres_per_px = point
            x_m, y_m = cos * forward - sin * right, sin * forward + cos * right
            found.append((square, x_m, y_m, square.side_px * metres_per_px))
    return found
