"""The painted floor as arrays: where its lines lie, where they cross and where they end.

A feature's arms are the map directions in which paint leaves it, one bit each: +x 1, +y 2, -x 4, -y 8.
A cross has four, a tee three, a corner two, the end of a line one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flightd.core.geometry import Matrix
from flightd.site.site import PaintedLine, Site

ARM_DIRECTIONS = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))
"""Unit vectors of the arms' bits 1, 2, 4, 8."""
_ARM_WIDTHS = 1.5
"""Paint that runs so many line widths past a crossing is an arm of it."""


@dataclass(frozen=True, slots=True)
class AxisLines:
    """The L lines across one axis by rising coordinate: `at_m` on the axis, `from_m` to `to_m` along the
    other."""

    at_m: Matrix
    from_m: Matrix
    to_m: Matrix


@dataclass(frozen=True, slots=True)
class Features:
    """F points of the floor (`at_m`, (F, 2)) with their arms; an end also names its line: `axis` (0 for
    a line across x) and `line`, its index there (-1 and -1 for crossings)."""

    at_m: Matrix
    arms: NDArray[np.int64]
    axis: NDArray[np.int64]
    line: NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class PaintMap:
    """All paint of a site: lines across x, lines across y, crossings and ends."""

    axes: tuple[AxisLines, AxisLines]
    crossings: Features
    ends: Features

    @classmethod
    def of(cls, site: Site) -> PaintMap:
        across_x = sorted((p for p in site.lines if p.x0_m == p.x1_m), key=lambda p: p.x0_m)
        across_y = sorted((p for p in site.lines if p.y0_m == p.y1_m), key=lambda p: p.y0_m)
        x = _axis([(p.x0_m, p.y0_m, p.y1_m) for p in across_x])
        y = _axis([(p.y0_m, p.x0_m, p.x1_m) for p in across_y])
        crossings, ends = _features(across_x, across_y, site.line_width_m)
        return cls((x, y), crossings, ends)


def nearest_end(site: Site, x_m: float, y_m: float, reach_m: float) -> tuple[float, float, int] | None:
    """The painted end nearest to a point, (x, y, its arm), None where none is within `reach_m`."""
    ends = PaintMap.of(site).ends
    found = [
        (math.hypot(x - x_m, y - y_m), float(x), float(y), int(arms))
        for (x, y), arms in zip(ends.at_m, ends.arms, strict=True)
    ]
    near = min(found, default=(math.inf, 0.0, 0.0, 0))
    return near[1:] if near[0] <= reach_m else None


def _axis(lines: list[tuple[float, float, float]]) -> AxisLines:
    at = np.array([line[0] for line in lines], dtype=float)
    span = np.array([sorted(line[1:]) for line in lines], dtype=float).reshape(-1, 2)
    return AxisLines(at, span[:, 0], span[:, 1])


def _features(
    across_x: list[PaintedLine], across_y: list[PaintedLine], width_m: float
) -> tuple[Features, Features]:
    reach = _ARM_WIDTHS * width_m
    crossings: list[tuple[float, float, int]] = []
    ends: list[tuple[float, float, int, int, int]] = []
    for up in across_x:
        low, high = sorted((up.y0_m, up.y1_m))
        for along in across_y:
            left, right = sorted((along.x0_m, along.x1_m))
            x, y = up.x0_m, along.y0_m
            if left - width_m <= x <= right + width_m and low - width_m <= y <= high + width_m:
                there = (right > x + reach, high > y + reach, left < x - reach, low < y - reach)
                crossings.append((x, y, sum(1 << bit for bit, arm in enumerate(there) if arm)))
    for axis, lines in ((0, across_x), (1, across_y)):
        for index, line in enumerate(lines):
            points = sorted(((line.x0_m, line.y0_m), (line.x1_m, line.y1_m)))
            inward = (1, 4) if axis else (2, 8)
            for (x, y), arm in zip(points, inward, strict=True):
                if all(math.hypot(x - cx, y - cy) > 2 * reach for cx, cy, _ in crossings):
                    ends.append((x, y, arm, axis, index))
    return _table([(*c, -1, -1) for c in crossings]), _table(ends)


def _table(rows: list[tuple[float, float, int, int, int]]) -> Features:
    points = np.array([row[:2] for row in rows], dtype=float).reshape(-1, 2)
    rest = np.array([row[2:] for row in rows], dtype=np.int64).reshape(-1, 3)
    return Features(points, rest[:, 0], rest[:, 1], rest[:, 2])
