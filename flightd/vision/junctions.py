"""Where painted lines cross, meet, turn and end: by looking for paint along each line around the point."""

from __future__ import annotations

import math

import numpy as np

from flightd.core.types import Image, Junction, JunctionKind, Line
from flightd.vision.plane import Plane
from flightd.vision.sampling import Grid

_MIN_ANGLE_RAD = math.radians(25.0)
_PAINTED = 0.6


def find(lines: tuple[Line, ...], mask: Image, grid: Grid, plane: Plane) -> tuple[Junction, ...]:
    """Junctions inside the picture; kinds by which of the arms around the crossing are painted."""
    found: list[Junction] = []
    half_x, half_y = (grid.frame_width - 1) / 2, (grid.frame_height - 1) / 2
    for i, one in enumerate(lines):
        for other in lines[i + 1 :]:
            point = _crossing(one, other)
            if point is None or abs(point[0]) > half_x or abs(point[1]) > half_y:
                continue
            arms = tuple(
                arm
                for line, across in ((one, other), (other, one))
                for arm in _arms(point, line, across, mask, grid, plane)
            )
            kind = {4: JunctionKind.CROSS, 3: JunctionKind.TEE}.get(len(arms))
            if len(arms) == 2 and abs(math.cos(arms[0] - arms[1])) < math.cos(_MIN_ANGLE_RAD):
                kind = JunctionKind.CORNER
            if kind is not None:
                found.append(Junction(kind, point[0], point[1], arms))
    for line in lines:
        found += _ends(line, found, half_x, half_y)
    return tuple(found)


def _crossing(one: Line, other: Line) -> tuple[float, float] | None:
    c1, s1, c2, s2 = (f(t.theta_rad) for t in (one, other) for f in (math.cos, math.sin))
    det = c1 * s2 - s1 * c2
    if abs(det) < math.sin(_MIN_ANGLE_RAD):
        return None
    return (one.rho_px * s2 - other.rho_px * s1) / det, (other.rho_px * c1 - one.rho_px * c2) / det


def _arms(
    point: tuple[float, float], line: Line, across: Line, mask: Image, grid: Grid, plane: Plane
) -> list[float]:
    """Directions along `line` in which paint goes on beyond the width of `across`."""
    sine = abs(math.sin(line.theta_rad - across.theta_rad))
    start = (
        across.width_px / 2 + 0.5 * line.width_px * math.sqrt(max(0.0, 1 - sine * sine))
    ) / sine + 2 * grid.step
    length = max(line.width_px, across.width_px, 6 * grid.step)
    arms = []
    for sense in (1.0, -1.0):
        dx, dy = -math.sin(line.theta_rad) * sense, math.cos(line.theta_rad) * sense
        t = start + length * np.linspace(0.0, 1.0, 12)
        x, y = plane.raw(point[0] + t * dx, point[1] + t * dy)
        i = np.rint((x - float(grid.x(0))) / grid.step).astype(int)
        j = np.rint((y - float(grid.y(0))) / grid.step).astype(int)
        inside = (i >= 0) & (j >= 0) & (i < mask.shape[1]) & (j < mask.shape[0])
        if inside.sum() < 3:
            continue
        if (mask[j[inside], i[inside]] > 0).mean() >= _PAINTED:
            arms.append(math.atan2(dy, dx))
    return arms


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
