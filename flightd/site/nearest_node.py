"""Which node a point of the floor belongs to, and how far its cell reaches."""

from __future__ import annotations

import math

import numpy as np

from flightd.core.geometry import Matrix
from flightd.site.site import Node, Site


class NodeIndex:
    """Nearest nodes of a site, fast enough for each tick."""

    def __init__(self, site: Site) -> None:
        self._nodes = tuple(site.nodes.values())
        self._x_m = np.array([node.x_m for node in self._nodes])
        self._y_m = np.array([node.y_m for node in self._nodes])
        self._half_m = {
            node: 0.5 * min((site.distance_m(node, other) for other in site.neighbours(node)), default=1.0)
            for node in site.nodes
        }

    def node(self, x_m: float, y_m: float) -> Node:
        """The node closest to a point; ties go to the first in the map."""
        apart = np.square(self._x_m - x_m) + np.square(self._y_m - y_m)
        return self._nodes[int(apart.argmin())]

    def nearest(self, x_m: float, y_m: float, most: int) -> list[tuple[Node, float]]:
        """Up to `most` nodes by their distance from a point."""
        apart: Matrix = np.hypot(self._x_m - x_m, self._y_m - y_m)
        return [(self._nodes[i], float(apart[i])) for i in np.argsort(apart, kind="stable")[:most]]

    def inside(self, node: str, sigma_x_m: float, sigma_y_m: float) -> float:
        """Probability that an error of these sigmas leaves no axis off by half a cell."""
        half = self._half_m[node] / math.sqrt(2.0)
        return math.erf(half / sigma_x_m) * math.erf(half / sigma_y_m)
