"""Racks found in a list of places: shelf fronts, levels, bays and the pattern of the codes.

What is found is laid out and held against the list; only racks that give exactly these places are kept.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from flightd.site.exchange.code_patterns import Numbers, named, patterns
from flightd.site.exchange.listed import listed
from flightd.site.racks import RackError, place_locations
from flightd.site.site import Location, Node, Rack, Shelf, Side, Site
from flightd.site.site_tables import SiteTablesError, site_of

_SAME_M: Final = 1e-4
_SHELF_HEIGHT_M: Final = 3.0
_CROSS_HALF_M: Final = 0.5
_MOST_POSITIONS: Final = 100


@dataclass(frozen=True, slots=True)
class PlaceAt:
    """A place for goods, metres in the frame of a site, and the node from which it is reached."""

    code: str
    node: str
    x_m: float
    y_m: float
    height_m: float


_Row = dict[tuple[str, Side], list[PlaceAt]]
"""Places by the side of the aisle on which they are."""


def rack_tables(tables: dict[str, Any], places: Sequence[PlaceAt], notes: list[str]) -> dict[str, Any]:
    """The tables with the shelves and racks that hold `places`; a note names the places that none holds."""
    if not places:
        return tables
    by_side = _by_side(tables["aisle"], places)
    shelved = {**tables, "aisle": [_shelved(aisle, by_side) for aisle in tables["aisle"]]}
    try:
        site = site_of(shelved)
    except SiteTablesError:
        site = None  # shelves that do not fit between the aisles
    racks = {} if site is None else _racks(site, by_side)
    held = {place.code for key in racks for place in by_side[key]}
    lost = [place.code for place in places if place.code not in held]
    if lost:
        notes.append(f"stations that no rack of equal bays holds, draw theirs: {listed(lost)}")
    if not racks:
        return tables
    notes.append("no LIF tells how high shelves are: shelf_height_m is assumed")
    kept = {aisle["id"]: _shelved(aisle, {key: by_side[key] for key in racks}) for aisle in tables["aisle"]}
    return {**tables, "aisle": [*kept.values()], "rack": list(_merged(racks))}


def _by_side(aisles: Sequence[Mapping[str, Any]], places: Sequence[PlaceAt]) -> _Row:
    line_m = {aisle["id"]: aisle["y_m"] for aisle in aisles}
    found: _Row = {}
    for place in places:
        aisle = place.node.rstrip("0123456789")
        side = Side.LEFT if place.y_m < line_m[aisle] else Side.RIGHT
        found.setdefault((aisle, side), []).append(place)
    return found


def _shelved(aisle: Mapping[str, Any], by_side: _Row) -> dict[str, Any]:
    """The aisle with fronts where its places are."""
    sides = [side for side in Side if (aisle["id"], side) in by_side]
    if not sides:
        return dict(aisle)
    places = [place for side in sides for place in by_side[aisle["id"], side]]
    distance_m = round(abs(places[0].y_m - aisle["y_m"]), 6)
    levels_m = sorted({place.height_m for place in places})
    step_m = levels_m[-1] - levels_m[-2] if len(levels_m) > 1 else 1.0
    told = {
        **aisle,
        "shelves": [side.value for side in sides],
        "shelf_distance_m": distance_m,
        "shelf_height_m": max(_SHELF_HEIGHT_M, round(levels_m[-1] + step_m, 6)),
    }
    if distance_m <= _CROSS_HALF_M:
        told["cross_half_m"] = round(0.8 * distance_m, 6)
    return told


def _racks(site: Site, by_side: _Row) -> dict[tuple[str, Side], Rack]:
    fronts: dict[tuple[str, Side], list[Shelf]] = {}
    for shelf in site.shelves:
        fronts.setdefault((shelf.aisle, shelf.side), []).append(shelf)
    found = {}
    for key, places in by_side.items():
        shelves = sorted(fronts.get(key, ()), key=lambda shelf: shelf.x0_m)
        for rack in _candidates(key, places, shelves):
            if _holds(rack, places, shelves, site.aisle_nodes(key[0])):
                found[key] = rack
                break
    return found


def _candidates(key: tuple[str, Side], places: Sequence[PlaceAt], shelves: Sequence[Shelf]) -> Iterator[Rack]:
    """Racks that may hold the places of one side, the likeliest first."""
    levels_m = _distinct(place.height_m for place in places)
    columns_m = _distinct(place.x_m for place in places)
    on = [[x for x in columns_m if shelf.x0_m <= x <= shelf.x1_m] for shelf in shelves]
    on = [columns for columns in on if columns]
    if not on or len(levels_m) * len(columns_m) != len(places) or sum(map(len, on)) != len(columns_m):
        return
    steps_m = [b - a for columns in on for a, b in itertools.pairwise(columns)]
    divided = [
        (pattern, positions)
        for positions in range(1, min(_MOST_POSITIONS, *map(len, on)) + 1)
        if all(len(columns) % positions == 0 for columns in on)
        for pattern in patterns(_numbers(key, places, levels_m, on, positions))
    ]
    # where codes can be read in several ways, by the one that tells most
    for pattern, positions in sorted(divided, key=lambda one: -named(one[0])):
        for bay_m in _bay_widths(steps_m, positions, shelves):
            yield Rack((key[0],), bay_m, levels_m, positions, (key[1],), pattern)


def _bay_widths(steps_m: Sequence[float], positions: int, shelves: Sequence[Shelf]) -> list[float]:
    if not steps_m:  # one place on each front: any bay that fits just once has it in the middle
        return sorted({round(shelf.x1_m - shelf.x0_m - 1e-6, 6) for shelf in shelves})
    exact_m = positions * sum(steps_m) / len(steps_m)
    return list(dict.fromkeys((round(exact_m, 3), round(exact_m, 4), round(exact_m, 6), exact_m - 2e-6)))


def _numbers(
    key: tuple[str, Side],
    places: Sequence[PlaceAt],
    levels_m: Sequence[float],
    on: Sequence[Sequence[float]],
    positions: int,
) -> list[tuple[str, Numbers]]:
    columns_m = [x for columns in on for x in columns]
    side = "L" if key[1] is Side.LEFT else "R"
    told = []
    for place in places:
        column = min(range(len(columns_m)), key=lambda i: abs(columns_m[i] - place.x_m))
        level = min(range(len(levels_m)), key=lambda i: abs(levels_m[i] - place.height_m)) + 1
        bay, position = column // positions + 1, column % positions + 1
        told.append((place.code, Numbers(key[0], side, bay, level, position)))
    return told


def _distinct(values: Iterator[float]) -> tuple[float, ...]:
    found: list[float] = []
    for value in sorted(values):
        if not found or value - found[-1] > _SAME_M:
            found.append(value)
    return tuple(found)


def _holds(rack: Rack, places: Sequence[PlaceAt], shelves: Sequence[Shelf], nodes: Sequence[Node]) -> bool:
    try:
        found = place_locations([rack], shelves, nodes)
    except RackError:
        return False
    return len(found) == len(places) and all(
        place.code in found and _same(place, found[place.code]) for place in places
    )


def _same(place: PlaceAt, found: Location) -> bool:
    return (
        abs(place.x_m - found.x_m) <= _SAME_M
        and abs(place.y_m - found.y_m) <= _SAME_M
        and abs(place.height_m - found.height_m) <= _SAME_M
        and place.node == found.node
    )


def _merged(racks: Mapping[tuple[str, Side], Rack]) -> Iterator[dict[str, Any]]:
    """One table for all that are divided alike."""
    alike: dict[Any, dict[str, list[Side]]] = {}
    for (aisle, side), rack in racks.items():
        form = (rack.bay_width_m, rack.levels_m, rack.positions, rack.pattern)
        alike.setdefault(form, {}).setdefault(aisle, []).append(side)
    for (bay_width_m, levels_m, positions, pattern), sides in alike.items():
        for both, group in itertools.groupby(
            sorted(sides, key=lambda aisle: sorted(sides[aisle])), key=lambda aisle: sorted(sides[aisle])
        ):
            yield {
                "aisles": list(group),
                "sides": [side.value for side in both],
                "bay_width_m": bay_width_m,
                "levels_m": list(levels_m),
                "positions": positions,
                "pattern": pattern,
            }
