"""The openings of the shelf front: what belongs to a location, and which location a point belongs to."""

from __future__ import annotations

import itertools
import math
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from flightd.site.site import Location, Rack, Side, Site

_CORE = (0.22, 0.18, 0.20)
"""The core of a cell: parts of its width to each side of its middle, and parts of the spacing of the levels
below and above its label.  Whatever stands in the place stands there."""
_USUAL_SPACING_M, _MOST_SPACING_M = 0.7, 1.4
"""Spacing of levels where there is only one; more than the most tells nothing of the goods."""
_DECK_BELOW = 0.4
_LEAST_SPACING_M = 0.4
"""Goods stand this part of the level spacing (no less than that) below their labels, where the site does not
say it."""
_DECK_SEEN_M = 0.34
"""How deep the deck of an empty place is looked at."""
_BEAM_M, _MOST_BEAM = 0.10, 0.5
"""Height of the beam below a deck, and the most of the way from deck to deck that it takes."""
_BESIDE_M = 0.06
"""A place is known so well in height, and how it is lit goes over into how the next is."""
_NEXT_M = 0.5
"""Height above the topmost labels that still belongs to their level where the shelf does not end before."""


@dataclass(frozen=True, slots=True)
class Cell:
    """The upright rectangle of one location on the shelf front, metres on the map and above the floor.

    Goods have room from `deck_m` to `top_m`; `posts` says at which of `x0_m` and `x1_m` an upright stands."""

    location: str
    aisle: str
    side: Side
    y_m: float
    x0_m: float
    x1_m: float
    low_m: float
    high_m: float
    label_m: float
    spacing_m: float
    deck_m: float
    top_m: float
    posts: tuple[bool, bool]

    @property
    def opening_m(self) -> tuple[tuple[float, float, float], ...]:
        """(x, y, height) of the room for goods at the front, corners in the order of `core_m`."""
        return self._corners(self.x0_m, self.x1_m, self.deck_m, self.top_m)

    @property
    def lit_m(self) -> tuple[tuple[float, float, float], ...]:
        """(x, y, height) of what has the light of the location's own level: the opening with the beam below,
        well below the next one, which is lit as its own level is; corners in the order of `core_m`."""
        return self._corners(
            self.x0_m, self.x1_m, max(self.deck_m - _BEAM_M, 0.0), max(self.top_m - _BESIDE_M, self.label_m)
        )

    @property
    def deck_corners_m(self) -> tuple[tuple[float, float, float], ...]:
        """(x, y, height) of the deck behind the front, as wide as the core: two corners that are
        `_DECK_SEEN_M` deep, then two at the front, in the order of `core_m`."""
        inwards = _DECK_SEEN_M if self.side is Side.RIGHT else -_DECK_SEEN_M
        left, right, *_ = self.core_m
        (x0, y, _), (x1, _, _) = left, right
        far, h = y + inwards, self.deck_m
        return (x0, far, h), (x1, far, h), (x1, y, h), (x0, y, h)

    @property
    def core_m(self) -> tuple[tuple[float, float, float], ...]:
        """(x, y, height) of the part that goods cover if there are any, corners in the same order."""
        aside, below, above = _CORE
        middle_m, half_m = (self.x0_m + self.x1_m) / 2, aside * (self.x1_m - self.x0_m)
        low_m, high_m = self.label_m - below * self.spacing_m, self.label_m + above * self.spacing_m
        return self._corners(middle_m - half_m, middle_m + half_m, low_m, high_m)

    @property
    def corners_m(self) -> tuple[tuple[float, float, float], ...]:
        """(x, y, height): left top, right top, right bottom, left bottom for someone who faces it."""
        return self._corners(self.x0_m, self.x1_m, self.low_m, self.high_m)

    def _corners(
        self, x0_m: float, x1_m: float, low_m: float, high_m: float
    ) -> tuple[tuple[float, float, float], ...]:
        left, right = (x0_m, x1_m) if self.side is Side.LEFT else (x1_m, x0_m)
        y = self.y_m
        return (left, y, high_m), (right, y, high_m), (right, y, low_m), (left, y, low_m)

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
        decks = decks_m(rack, tops[location.aisle, location.side])
        rooms = _rooms_m(rack, decks, tops[location.aisle, location.side])
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
            location.height_m,
            _spacing_m(levels),
            decks[i],
            rooms[i],
            (location.position == 1, location.position == rack.positions),
        )
    return cells


def _rooms_m(rack: Rack, decks: Sequence[float], height_m: float) -> tuple[float, ...]:
    """The height up to which goods may stand in each level: to the beam of the next, or to the rack's top."""
    beams = [min(_BEAM_M, _MOST_BEAM * (above - below)) for below, above in itertools.pairwise(decks)]
    rooms = [above - beam for above, beam in zip(decks[1:], beams, strict=True)]
    last_m = decks[-1] + deck_spacing_m(rack.levels_m, height_m) - _BEAM_M
    return (*rooms, max(min(last_m, height_m), rack.levels_m[-1]))


def decks_m(rack: Rack, height_m: float) -> tuple[float, ...]:
    """The height on which goods stand in each level of a rack, on fronts of `height_m`."""
    below_m = rack.deck_below_label_m
    if below_m is None:
        below_m = _DECK_BELOW * deck_spacing_m(rack.levels_m, height_m)
    return tuple(max(label_m - below_m, 0.0) for label_m in rack.levels_m)


def deck_spacing_m(labels_m: Sequence[float], height_m: float) -> float:
    """From deck to deck, by the labels of the levels on a front of `height_m`, within what racks have."""
    gaps = [b - a for a, b in itertools.pairwise(labels_m)] or [(height_m - labels_m[0]) * 1.6]
    return min(max(min(gaps), _LEAST_SPACING_M), _MOST_SPACING_M)


def _spacing_m(levels_m: Sequence[float]) -> float:
    gaps = [b - a for a, b in itertools.pairwise(levels_m)]
    return min([*gaps, _MOST_SPACING_M]) if gaps else _USUAL_SPACING_M


def by_node(locations: Iterable[Location]) -> Mapping[str, tuple[Location, ...]]:
    """The locations that are counted from each node."""
    found: defaultdict[str, list[Location]] = defaultdict(list)
    for location in locations:
        found[location.node].append(location)
    return {node: tuple(group) for node, group in found.items()}
