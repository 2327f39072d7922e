"""The steel of the racks, in metres: faces with bays and levels, and the opening of every location.

A site says where labels hang and how far below them goods stand, on a beam that carries the location's own
small label.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

from flightd.site.shelf_cells import deck_spacing_m, decks_m
from flightd.site.site import Location, Rack, Shelf, Side, Site

BEAM_M = 0.10
"""Height of a beam's face, below its deck; where decks are close, of half the distance between them."""
UPRIGHT_M = 0.08
"""Width of an upright, which stands on the line between two bays."""
_LEAST_PITCH_M, _LEAST_ROOM_M = 0.15, 0.05
"""From deck to deck where a site's labels do not say it any closer, and above the topmost deck."""


@dataclass(frozen=True, slots=True)
class RackLevel:
    """One level of a face: goods stand on `deck_m`, below which is a beam `beam_m` high; the next beam or
    the rack's top is at `top_m`."""

    deck_m: float
    top_m: float
    beam_m: float = BEAM_M

    @property
    def height_m(self) -> float:
        return self.top_m - self.deck_m


@dataclass(frozen=True, slots=True)
class Opening:
    """Room of one location: centred on `x_m`, `width_m` wide, between deck and beam."""

    location: Location
    x_m: float
    width_m: float
    level: RackLevel


@dataclass(frozen=True, slots=True)
class Face:
    """One unbroken rack front in the plane y = `y_m`, seen from its aisle.

    `right` is the map's x direction that is to the right for who looks at it (+1 on an aisle's left side,
    -1 on its right), `inward` the y direction into the rack.  `uprights_m` are the x of the lines between
    bays, both ends included."""

    shelf: Shelf
    uprights_m: tuple[float, ...]
    levels: tuple[RackLevel, ...]
    openings: tuple[Opening, ...]

    @property
    def y_m(self) -> float:
        return self.shelf.y_m

    @property
    def right(self) -> float:
        return -self.shelf.inward

    @property
    def inward(self) -> float:
        return self.shelf.inward

    @property
    def x0_m(self) -> float:
        return self.uprights_m[0]

    @property
    def x1_m(self) -> float:
        return self.uprights_m[-1]


def faces(site: Site) -> tuple[Face, ...]:
    """Every rack front of the site that has locations, in the order of the site's shelves."""
    racks = {(aisle, side): rack for rack in site.racks for aisle in rack.aisles for side in rack.sides}
    on: dict[tuple[str, Side], list[Location]] = {}
    for location in site.locations.values():
        on.setdefault((location.aisle, location.side), []).append(location)
    found = []
    for shelf in site.shelves:
        here = [
            location
            for location in on.get((shelf.aisle, shelf.side), ())
            if shelf.x0_m <= location.x_m <= shelf.x1_m
        ]
        if here:
            found.append(_face(shelf, racks[shelf.aisle, shelf.side], here))
    return tuple(found)


def openings(site: Site) -> Iterator[Opening]:
    """The openings of all locations."""
    return itertools.chain.from_iterable(face.openings for face in faces(site))


def _face(shelf: Shelf, rack: Rack, here: list[Location]) -> Face:
    place_m = rack.bay_width_m / rack.positions
    starts = {location.bay: location.x_m - (location.position - 0.5) * place_m for location in here}
    ordered = [starts[bay] for bay in sorted(starts)]
    levels = rack_levels(rack, shelf.height_m)
    return Face(
        shelf,
        (*ordered, ordered[-1] + rack.bay_width_m),
        levels,
        tuple(Opening(location, location.x_m, place_m, levels[location.level - 1]) for location in here),
    )


def rack_levels(rack: Rack, height_m: float) -> tuple[RackLevel, ...]:
    """Decks and tops of a rack of `height_m`.  Where the site's own heights would put a deck on or below
    the one before it, it stands a little above that: every level has room for goods."""
    spacing_m = deck_spacing_m(rack.levels_m, height_m)
    gaps = [above - below for below, above in itertools.pairwise(rack.levels_m)]
    least_m = max(min([*gaps, _LEAST_PITCH_M]), 0.02)
    decks: list[float] = []
    for deck_m in decks_m(rack, height_m):
        decks.append(max(deck_m, decks[-1] + least_m if decks else BEAM_M))
    beams = [BEAM_M, *(min(BEAM_M, (above - below) / 2) for below, above in itertools.pairwise(decks))]
    tops = [deck_m - beam_m for deck_m, beam_m in zip(decks[1:], beams[1:], strict=True)]
    top_m = max(min(decks[-1] + spacing_m - BEAM_M, height_m), rack.levels_m[-1] + _LEAST_ROOM_M)
    tops.append(max(top_m, decks[-1] + _LEAST_ROOM_M))
    return tuple(itertools.starmap(RackLevel, zip(decks, tops, beams, strict=True)))
