"""Junctions of the picture as points of the floor with arms along the grid's axes."""

from __future__ import annotations

import math
from collections.abc import Sequence

from flightd.core.tracks import FloorJunction
from flightd.core.types import Junction
from flightd.tracking.tilt_compensation import FloorView, floor_points

_ARM_PX = 25.0
"""How far along an arm its direction is taken."""
_SKEW_RAD = math.radians(25.0)
"""An arm further than this from both grid axes is no arm of the grid."""


def floor_junctions(
    junctions: Sequence[Junction], view: FloorView, yaw_rad: float
) -> tuple[FloorJunction, ...]:
    """The junctions on the floor below a drone that heads `yaw_rad` on the grid; one whose arms do not
    follow the grid is left out, as is everything when the view cannot place points."""
    points: list[tuple[float, float]] = []
    for junction in junctions:
        x, y = junction.x_px, junction.y_px
        points.append((x, y))
        points += [(x + _ARM_PX * math.cos(a), y + _ARM_PX * math.sin(a)) for a in junction.arms_rad]
    placed = floor_points(points, view) if points else []
    if not placed:
        return ()
    found: list[FloorJunction] = []
    cos, sin = math.cos(yaw_rad), math.sin(yaw_rad)
    start = 0
    for junction in junctions:
        (forward, right), *tips = placed[start : start + 1 + len(junction.arms_rad)]
        start += 1 + len(junction.arms_rad)
        arms = 0
        for tip_forward, tip_right in tips:
            quarter = (math.atan2(tip_right - right, tip_forward - forward) + yaw_rad) / (math.pi / 2)
            if abs(quarter - round(quarter)) * (math.pi / 2) < _SKEW_RAD:
                arms |= 1 << (round(quarter) % 4)
        if arms.bit_count() == len(junction.arms_rad) > 0:
            found.append(FloorJunction(cos * forward - sin * right, sin * forward + cos * right, arms))
    return tuple(found)
