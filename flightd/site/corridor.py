"""The free way around the painted lines: how far outside a point is, and the way back."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from flightd.site.site import Site

_BACK_MPS = 0.3
"""Who comes back faster than this may brake."""


@dataclass(frozen=True, slots=True)
class Nearest:
    """The nearest point of the grid and the distance to it, metres on the map."""

    x_m: float
    y_m: float
    distance_m: float


class Corridor:
    """All points within `half_width_m` of an edge of the grid."""

    def __init__(self, site: Site, half_width_m: float) -> None:
        self.half_width_m = half_width_m
        ends = [(site.nodes[edge.a], site.nodes[edge.b]) for edge in site.edges]
        self._a = np.array([(a.x_m, a.y_m) for a, _ in ends]).reshape(-1, 2)
        self._along = np.array([(b.x_m - a.x_m, b.y_m - a.y_m) for a, b in ends]).reshape(-1, 2)
        self._square = np.maximum(np.einsum("ij,ij->i", self._along, self._along), 1e-12)

    def nearest(self, x_m: float, y_m: float) -> Nearest:
        """Distance infinite on a site without edges."""
        if not len(self._a):
            return Nearest(x_m, y_m, math.inf)
        away = np.array((x_m, y_m)) - self._a
        share = np.clip(np.einsum("ij,ij->i", away, self._along) / self._square, 0.0, 1.0)
        points = self._a + share[:, None] * self._along
        distances = np.hypot(points[:, 0] - x_m, points[:, 1] - y_m)
        best = int(np.argmin(distances))
        return Nearest(float(points[best, 0]), float(points[best, 1]), float(distances[best]))

    def back(self, x_m: float, y_m: float, vx_mps: float, vy_mps: float) -> tuple[float, float] | None:
        """Outside: the unit vector (map axes) back to the line, unless the drone comes back already."""
        near = self.nearest(x_m, y_m)
        if not self.half_width_m < near.distance_m < math.inf:
            return None
        bx, by = (near.x_m - x_m) / near.distance_m, (near.y_m - y_m) / near.distance_m
        return None if vx_mps * bx + vy_mps * by > _BACK_MPS else (bx, by)
