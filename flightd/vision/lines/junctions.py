"""Where painted lines cross, meet, turn and end: by looking for paint along each line around the point."""

from __future__ import annotations

import math
from itertools import combinations
from typing import TypeAlias

import numpy as np

from flightd.core.types import Image, Junction, JunctionKind, Line
from flightd.vision.lines.sampling import OUTSIDE, PAINT, Grid, look_up
from flightd.vision.lines.undistortion import Plane

_MIN_ANGLE_RAD = math.radians(25.0)
_PAINTED = 0.6
"""Part of an arm's beginning that must be paint."""
_STEPS = np.linspace(0.0, 1.0, 12)
_MIN_SEEN = 3


def find(lines: tuple[Line, ...], mask: Image, grid: Grid, plane: Plane) -> tuple[Junction, ...]:
    """Junctions inside the picture; kinds by which of the arms around the crossing are painted."""
    half_x, half_y = (grid.frame_width - 1) / 2, (grid.frame_height - 1) / 2
    crossings = []
    for one, other in combinations(lines, 2):
        point = _crossing(one, other)
        if point is not None and abs(point[0]) <= half_x and abs(point[1]) <= half_y:
            crossings.append(
                (point, _arms(point, one, other, grid.step) + _arms(point, other, one, grid.step))
            )
    found: list[Junction] = []
    painted = _painted([arm for _, arms in crossings for arm in arms], mask, grid, plane)
    for k, (point, arms) in enumerate(crossings):
        angles = tuple(
            math.atan2(arm[3], arm[2])
            for arm, there in zip(arms, painted[4 * k : 4 * k + 4], strict=True)
            if there
        )
        kind = _kind(angles)
        if kind is not None:
            found.append(Junction(kind, point[0], point[1], angles))
    for line in lines:
        found += _ends(line, found, half_x, half_y)
    return tuple(found)


def _kind(arms_rad: tuple[float, ...]) -> JunctionKind | None:
    """What the painted arms make; None for a line that merely passes another's end."""
    if len(arms_rad) == 4:
        return JunctionKind.CROSS
    if len(arms_rad) == 3:
        return JunctionKind.TEE
    if len(arms_rad) == 2 and abs(math.cos(arms_rad[0] - arms_rad[1])) < math.cos(_MIN_ANGLE_RAD):
        return JunctionKind.CORNER
    return None


def _crossing(one: Line, other: Line) -> tuple[float, float] | None:
    c1, s1, c2, s2 = (f(t.theta_rad) for t in (one, other) for f in (math.cos, math.sin))
    det = c1 * s2 - s1 * c2
    if abs(det) < math.sin(_MIN_ANGLE_RAD):
        return None
    return (one.rho_px * s2 - other.rho_px * s1) / det, (other.rho_px * c1 - one.rho_px * c2) / det


_Arm: TypeAlias = tuple[float, float, float, float, float]
"""Where it begins (x, y), its direction (x, y), and the length looked at."""


def _arms(point: tuple[float, float], line: Line, across: Line, step: int) -> list[_Arm]:
    """The two ways along `line` from the crossing, beyond the width of `across`."""
    sine = abs(math.sin(line.theta_rad - across.theta_rad))
    slant = 0.5 * line.width_px * math.sqrt(max(0.0, 1 - sine * sine))
    start = (across.width_px / 2 + slant) / sine + 2 * step
    length = max(line.width_px, across.width_px, 6.0 * step)
    dx, dy = -math.sin(line.theta_rad), math.cos(line.theta_rad)
    return [
        (point[0] + way * start * dx, point[1] + way * start * dy, way * dx, way * dy, length)
        for way in (1.0, -1.0)
    ]


def _painted(arms: list[_Arm], mask: Image, grid: Grid, plane: Plane) -> list[bool]:
    """Whether each arm is there."""
    if not arms:
        return []
    x, y, dx, dy, length = np.array(arms).T[:, :, None]
    along = length * _STEPS
    found = look_up(mask, grid.places(*plane.raw(x + along * dx, y + along * dy)))
    count, total = np.add.reduce((found == PAINT, found != OUTSIDE), axis=2, dtype=np.intp)
    there: list[bool] = ((total >= _MIN_SEEN) & (count >= _PAINTED * total)).tolist()
    return there


def _ends(line: Line, junctions: list[Junction], half_x: float, half_y: float) -> list[Junction]:
    """Ends of the line inside the picture that are at no other junction."""
    ends = []
    margin = 0.75 * line.width_px + 12.0
    for along, sense in ((line.start_px, 1.0), (line.end_px, -1.0)):
        x, y = line.point_at(along)
        if abs(x) > half_x - margin or abs(y) > half_y - margin:
            continue
        if any(math.hypot(x - j.x_px, y - j.y_px) < margin + line.width_px for j in junctions):
            continue
        arm = math.atan2(math.cos(line.theta_rad) * sense, -math.sin(line.theta_rad) * sense)
        ends.append(Junction(JunctionKind.END, x, y, (arm,)))
    return ends
