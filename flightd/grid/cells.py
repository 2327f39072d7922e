"""The openings of the shelf front: what belongs to a location, and which location a point belongs to."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from flightd.grid.site import Location, Side, Site

_NEXT_M = 0.5
"""Height above the topmost labels that still belongs to their level where the shelf does not end before."""


@dataclass(frozen=True, slots=True)
class Cell:
    """The upright rectangle of one location on the shelf front, metres on the map and above the floor."""

    location: str
    aisle: str
    side: Side
    y_m: float
    x0_m: float
    x1_m: float
    low_m: float
    high_m: float

    @property
    def corners_m(self) -> tuple[tuple[float, float, float], ...]:
        """(x, y, height): left top, right top, right bottom, left bottom for someone who faces it."""
        left, right = (self.x0_m, self.x1_m) if self.side is Side.LEFT else (self.x1_m, self.x0_m)
        y = self.y_m
        return (
            (left, y, self.high_m),
            (right, y, self.high_m),
            (right, y, self.low_m),
            (left, y, self.low_m),
        )

    def inside_probability(self, x_m: float, height_m: float, sigma_x_m: float, sigma_h_m: float) -> float:
        """Probability that the true point is inside, for a point measured with normal errors."""
        return _between(x_m, sigma_x_m, self.x0_m, self.x1_m) * _between(
            height_m, sigma_h_m, self.low_m, self.high_m
        )


def _between(value: float, sigma: float, low: float, high: float) -> float:
    scale = 1.0 / (math.sqrt(2.0) * max(sigma, 1e-6))
    return 0.5 * (math.erf((high - value) * scale) - math.erf((low - value) * scale))


def cells_of(site: Site) -> dict[str, Cell]:
    """The cell of every location.

    Across, a location has its share of the bay; upwards, labels hang at the foot of their goods or on
    them, so the border between two levels lies halfway between their labels.
    """
    shares = {(aisle, side): rack for rack in site.racks for aisle in rack.aisles for side in rack.sides}
    tops = {(shelf.aisle, shelf.side): shelf.height_m for shelf in site.shelves}
    cells = {}
    for location in site.locations.values():
        rack = shares[location.aisle, location.side]
        half_m = rack.bay_width_m / rack.positions / 2
        levels = rack.levels_m
        i = location.level - 1
        low = 0.0 if i == 0 else (levels[i - 1] + levels[i]) / 2
        top = tops[location.aisle, location.side]
        high = (levels[i] + levels[i + 1]) / 2 if i + 1 < len(levels) else max(top, levels[i] + _NEXT_M)
        cells[location.code] = Cell(
            location.code,
            location.aisle,
            location.side,
            location.y_m,
            location.x_m - half_m,
            location.x_m + half_m,
            low,
            high,
        )
    return cells


def by_node(locations: Iterable[Location]) -> Mapping[str, tuple[Location, ...]]:
    """The locations that are counted from each node."""
    found: defaultdict[str, list[Location]] = defaultdict(list)
    for location in locations:
        found[location.node].append(location)
    return {node: tuple(group) for node, group in found.items()}
