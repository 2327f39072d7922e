"""The free way around the painted lines, less the keep-outs: how far outside a point is, and the way back."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flightd.site.rack_depth import rack_body
from flightd.site.site import Node, Site
from flightd.site.ways import BODY_RADIUS_M, KEEP_OUT_CLEARANCE_M, KEEP_OUT_HEIGHT_M, KeepOut

_BACK_MPS = 0.3
"""Who comes back faster than this may brake."""
NEAR_KEEP_OUT_M = (BODY_RADIUS_M + KEEP_OUT_CLEARANCE_M) / 2
"""Nearer to a keep-out than this the free way is left, the body still outside it: half of what every open
line keeps from it besides the body."""
_BRAKES_AFTER_S = 0.3
"""So long a drone goes on as before: what is known of it is old, and its lean has yet to change."""
_BESIDE_SHELF_M, _LEAST_M = BODY_RADIUS_M + 0.05, 0.2
"""The free way ends so far before a rack, for a drone has a width, but is no narrower than this."""


@dataclass(frozen=True, slots=True)
class Nearest:
    """The nearest point of the grid, or of an area, the distance to it, and how far the way there is free to
    both sides, metres on the map."""

    x_m: float
    y_m: float
    distance_m: float
    free_m: float = 0.0


class Corridor:
    """All points off the keep-outs within `half_width_m` of an edge of the grid that none of them closes;
    less where a rack stands nearer, as the racks' ends do beside a cross way.  `brake_mps2`: how fast the
    drone can lose the speed at which it comes towards a keep-out."""

    def __init__(self, site: Site, half_width_m: float, brake_mps2: float = 1.0) -> None:
        self._brake_mps2 = brake_mps2
        self._keep_outs = site.keep_outs
        self._low_keep_outs = site.low_keep_outs
        ends = [(site.nodes[edge.a], site.nodes[edge.b]) for edge in site.edges]
        open_ends = [
            (a, b)
            for a, b in ends
            if not any(area.touches(a.x_m, a.y_m, b.x_m, b.y_m) for area in site.keep_outs)
        ]
        ends = open_ends or ends
        racks = [rack_body(site, shelf) for shelf in site.shelves]
        self._free_m = np.array([_free_m(racks, a, b, half_width_m) for a, b in ends])
        self._a = np.array([(a.x_m, a.y_m) for a, _ in ends]).reshape(-1, 2)
        self._along = np.array([(b.x_m - a.x_m, b.y_m - a.y_m) for a, b in ends]).reshape(-1, 2)
        self._square = np.maximum(np.einsum("ij,ij->i", self._along, self._along), 1e-12)
        self._last: tuple[tuple[float, float], tuple[Nearest, Nearest]] | None = None

    def nearest(self, x_m: float, y_m: float) -> Nearest:
        """The nearest point of the grid; distance infinite on a site without edges."""
        return self._both(x_m, y_m)[0]

    def nearest_way(self, x_m: float, y_m: float) -> Nearest:
        """The point of the grid from which the way is free the furthest towards this one, or beyond it."""
        return self._both(x_m, y_m)[1]

    def _both(self, x_m: float, y_m: float) -> tuple[Nearest, Nearest]:
        """Each tick asks for one point several times."""
        if self._last is None or self._last[0] != (x_m, y_m):
            self._last = (x_m, y_m), self._looked_up(x_m, y_m)
        return self._last[1]

    def _looked_up(self, x_m: float, y_m: float) -> tuple[Nearest, Nearest]:
        if not len(self._a):
            return (nowhere := Nearest(x_m, y_m, math.inf)), nowhere
        away = np.array((x_m, y_m)) - self._a
        share = np.einsum("ij,ij->i", away, self._along) / self._square
        np.maximum(np.minimum(share, 1.0, out=share), 0.0, out=share)  # np.clip takes five times as long
        points = self._a + share[:, None] * self._along
        distances = np.hypot(points[:, 0] - x_m, points[:, 1] - y_m)
        free_m = self._free_m
        line, way = (
            Nearest(*(float(value) for value in (*points[best], distances[best], free_m[best])))
            for best in (distances.argmin(), (distances - free_m).argmin())
        )
        return line, way

    def nearest_keep_out(self, x_m: float, y_m: float) -> Nearest:
        """The nearest point of a keep-out's edge; the distance is negative within it, and infinite on a site
        that has none."""
        found = (_nearest_of(area, x_m, y_m) for area in self._keep_outs)
        return min(found, key=lambda near: near.distance_m, default=Nearest(x_m, y_m, math.inf))

    def outside_m(self, x_m: float, y_m: float) -> float:
        """How far outside the free way a point is; 0 within it."""
        way = self.nearest_way(x_m, y_m)
        beside_m = way.distance_m - way.free_m
        return max(beside_m, NEAR_KEEP_OUT_M - self.nearest_keep_out(x_m, y_m).distance_m, 0.0)

    def back(
        self, x_m: float, y_m: float, vx_mps: float, vy_mps: float, height_m: float = math.inf
    ) -> tuple[float, float] | None:
        """Near a keep-out, the way in which it comes to rest counted in, or beside one that stands below the
        legs as high as `height_m` (NaN: unknown): the unit vector (map axes) away from it; outside: the one
        back to the line.  None elsewhere, and when the drone comes back already."""
        areas = [_nearest_of(area, x_m, y_m) for area in self._keep_outs]
        for low in self._low_keep_outs:
            beside = _nearest_of(low, x_m, y_m)
            if beside.distance_m > 0.0 and not height_m > low.to_m + KEEP_OUT_HEIGHT_M:
                areas.append(beside)
        left = []
        for area in areas:
            bx, by = _away(area, x_m, y_m)
            if bx or by:
                near_m = NEAR_KEEP_OUT_M + self._rests_after_m(-vx_mps * bx - vy_mps * by)
                left.append((area.distance_m - near_m, (bx, by)))
        least_m, (bx, by) = min(left, default=(math.inf, (0.0, 0.0)))
        if least_m >= 0.0:
            near = self.nearest_way(x_m, y_m)
            if not near.free_m < near.distance_m < math.inf:
                return None
            bx, by = (near.x_m - x_m) / near.distance_m, (near.y_m - y_m) / near.distance_m
        return None if vx_mps * bx + vy_mps * by > _BACK_MPS else (bx, by)

    def _rests_after_m(self, speed_mps: float) -> float:
        """How far a drone still comes that is to stop now; 0 for one that goes away."""
        speed_mps = max(speed_mps, 0.0)
        return speed_mps * _BRAKES_AFTER_S + speed_mps**2 / (2.0 * self._brake_mps2)


def _free_m(racks: Sequence[KeepOut], a: Node, b: Node, most_m: float) -> float:
    """How far the way along an edge is free to both sides."""
    gaps = (
        math.hypot(
            max(min(a.x_m, b.x_m) - rack.x1_m, rack.x0_m - max(a.x_m, b.x_m), 0.0),
            max(min(a.y_m, b.y_m) - rack.y1_m, rack.y0_m - max(a.y_m, b.y_m), 0.0),
        )
        for rack in racks
    )
    return min(most_m, max(min(gaps, default=math.inf) - _BESIDE_SHELF_M, _LEAST_M))


def _away(near: Nearest, x_m: float, y_m: float) -> tuple[float, float]:
    """The unit vector out of an area; of no length where there is none."""
    gone_m = near.distance_m if abs(near.distance_m) > 1e-6 else math.inf
    return (x_m - near.x_m) / gone_m, (y_m - near.y_m) / gone_m


def _nearest_of(area: KeepOut, x_m: float, y_m: float) -> Nearest:
    at_x, at_y = min(max(x_m, area.x0_m), area.x1_m), min(max(y_m, area.y0_m), area.y1_m)
    away_m = math.hypot(x_m - at_x, y_m - at_y)
    if away_m > 0.0:
        return Nearest(at_x, at_y, away_m)
    edges = ((area.x0_m, y_m), (area.x1_m, y_m), (x_m, area.y0_m), (x_m, area.y1_m))
    at_x, at_y = min(edges, key=lambda edge: math.dist(edge, (x_m, y_m)))
    return Nearest(at_x, at_y, -math.dist((at_x, at_y), (x_m, y_m)))
