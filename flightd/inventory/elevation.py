"""The fronts of the racks as somebody who stands before them sees them: bays, levels, positions.

Where the site is known, it says where a place is.  Else its code does, as far as warehouses write codes: its
last three numbers are bay, level and position, its last two bay and level, and what stands before them is
the name of the front.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass

from flightd.site.site import Side, Site

_NUMBERS = re.compile(
    r"(?P<name>.*?[^0-9])?(?P<bay>\d{1,4})[^0-9A-Za-z]+(?P<level>\d{1,3})([^0-9A-Za-z]+(?P<position>\d{1,3}))?"
)


@dataclass(frozen=True, slots=True)
class Spot:
    """Where on its front a place is, each number from 1; 0 where nobody knows."""

    code: str
    bay: int = 0
    level: int = 0
    position: int = 0


@dataclass(frozen=True, slots=True)
class Front:
    """One side of an aisle.  `spots` from the left to the right of who faces it, from the floor up.

    `mirrored`: bays and positions are numbered from the right, for who faces it; `placed`: they are known at
    all."""

    aisle: str
    side: str
    spots: tuple[Spot, ...]
    mirrored: bool = False
    placed: bool = True


def fronts_of(codes: Iterable[str], site: Site | None = None) -> tuple[Front, ...]:
    """Every place on its front; those that nobody can place come last, together."""
    left = dict.fromkeys(codes)
    fronts = [*_by_site(left, site)] if site is not None else []
    placed = {spot.code for front in fronts for spot in front.spots}
    rest = [code for code in left if code not in placed]
    by_code, unplaced = _by_code(rest)
    fronts += by_code
    if unplaced:
        fronts.append(Front("", "", tuple(Spot(code) for code in sorted(unplaced)), placed=False))
    return tuple(fronts)


def _by_site(codes: dict[str, None], site: Site) -> Iterable[Front]:
    found: defaultdict[tuple[str, Side], list[Spot]] = defaultdict(list)
    for place in site.locations.values():
        if place.code in codes:
            spot = Spot(place.code, place.bay, place.level, place.position)
            found[place.aisle, place.side].append(spot)
    for (aisle, side), spots in found.items():
        # who looks along x and turns to the front on his right has x running to the left
        mirrored = side is Side.RIGHT
        yield Front(aisle, side.value, _in_order(spots, mirrored), mirrored)


def _by_code(codes: Iterable[str]) -> tuple[list[Front], list[str]]:
    found: defaultdict[str, list[Spot]] = defaultdict(list)
    unplaced: list[str] = []
    taken: set[tuple[str, int, int, int]] = set()
    for code in codes:
        match = _NUMBERS.fullmatch(code)
        if match is None:
            unplaced.append(code)
            continue
        name = (match["name"] or "").rstrip("-_./ :")
        spot = Spot(code, int(match["bay"]), int(match["level"]), int(match["position"] or 1))
        where = (name, spot.bay, spot.level, spot.position)
        if where in taken:  # 1-1 and 01-1: both are shown
            unplaced.append(code)
            continue
        taken.add(where)
        found[name].append(spot)
    return [Front(name, "", _in_order(spots, False)) for name, spots in sorted(found.items())], unplaced


def _in_order(spots: Iterable[Spot], mirrored: bool) -> tuple[Spot, ...]:
    way = -1 if mirrored else 1
    return tuple(sorted(spots, key=lambda spot: (spot.level, way * spot.bay, way * spot.position)))
