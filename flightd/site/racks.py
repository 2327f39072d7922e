"""Bays, levels and places on the shelf fronts, each with its location code.

For someone who looks along +x, bays are numbered from 1 by rising x along an aisle's whole side (the ways
between fronts do not start the count again), levels from the floor up, places in a bay by rising x.
"""

from __future__ import annotations

import re
import string
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from flightd.site.site import Location, Node, Rack, Shelf, Side

_FIELDS = ("aisle", "side", "bay", "level", "position")
_WIDTH = re.compile(r"0?[1-9]?")
_FITS_M = 1e-6


_MOST_DIGITS = 4


class RackError(ValueError):
    """A rack does not fit; the message is `key: problem` in the words of the site file."""


@dataclass(frozen=True, slots=True)
class _Place:
    """Numbers of a place, as a pattern may name them."""

    aisle: str
    side: Side
    bay: int
    level: int
    position: int

    def code(self, pattern: str) -> str:
        side = "L" if self.side is Side.LEFT else "R"
        return pattern.format(
            aisle=self.aisle, side=side, bay=self.bay, level=self.level, position=self.position
        )


def place_locations(
    racks: Sequence[Rack], shelves: Iterable[Shelf], nodes: Iterable[Node]
) -> dict[str, Location]:
    """The locations of all racks by code, in the order of the racks, sides, bays, levels and places.

    Raises RackError for an aisle without such a front, levels above the shelf or out of order, a pattern
    that cannot be filled in, and codes that come twice.
    """
    fronts: dict[tuple[str, Side], list[Shelf]] = {}
    for shelf in shelves:
        fronts.setdefault((shelf.aisle, shelf.side), []).append(shelf)
    by_aisle: dict[str, list[Node]] = {}
    for node in nodes:
        by_aisle.setdefault(node.aisle, []).append(node)
    found: dict[str, Location] = {}
    taken: set[tuple[str, Side]] = set()
    for i, rack in enumerate(racks):
        key = f"rack[{i}]"
        _check_pattern(key, rack.pattern)
        for aisle in rack.aisles:
            if aisle not in by_aisle:
                raise RackError(f"{key}.aisles: there is no aisle {aisle}")
            for side in rack.sides:
                if (aisle, side) not in fronts:
                    raise RackError(f"{key}.sides: aisle {aisle} has no shelf on its {side} side")
                if (aisle, side) in taken:
                    raise RackError(f"{key}: aisle {aisle}, {side} side belongs to an earlier rack")
                taken.add((aisle, side))
                ordered = sorted(fronts[aisle, side], key=lambda shelf: shelf.x0_m)
                _fill(key, rack, ordered, by_aisle[aisle], found)
    return found


def bay_edges(rack: Rack, front: Shelf) -> tuple[float, ...]:
    """Where the bays on a front meet and end, by rising x; empty where none fits."""
    bays = int((front.x1_m - front.x0_m) / rack.bay_width_m + _FITS_M)
    # what is left over is split between both ends: the bays stand in the middle of the front
    first_x_m = (front.x0_m + front.x1_m - bays * rack.bay_width_m) / 2
    return tuple(first_x_m + number * rack.bay_width_m for number in range(bays + 1)) if bays else ()


def code_form(racks: Iterable[Rack]) -> re.Pattern[str]:
    """What location codes of these racks look like, places that the map lacks included.

    A pattern without a separator looks like any number, and adds no form: nothing is taken for a code by it.
    """
    forms = set()
    for rack in racks:
        parts = list(string.Formatter().parse(rack.pattern))
        if any(not char.isalnum() for literal, *_ in parts for char in literal):
            letters = max(map(len, rack.aisles))
            forms.add(
                "".join(re.escape(text) + _form(name, width, letters) for text, name, width, _ in parts)
            )
    return re.compile("|".join(sorted(forms)) or r"(?!)")


def _form(name: str | None, width: str | None, letters: int) -> str:
    if name is None:
        return ""
    if name == "aisle":
        return rf"[^\W_]{{1,{letters}}}"
    least = max(1, int(width or 1))
    return "[LR]" if name == "side" else rf"\d{{{least},{max(least, _MOST_DIGITS)}}}"


def _check_pattern(key: str, pattern: str) -> None:
    try:
        fields = [part[1:] for part in string.Formatter().parse(pattern) if part[1] is not None]
    except ValueError as err:
        raise RackError(f"{key}.pattern: {pattern!r} cannot be filled in: {err}") from None
    known = ", ".join(f"{{{name}}}" for name in _FIELDS)
    for name, width, conversion in fields:
        if name not in _FIELDS:
            raise RackError(f"{key}.pattern: {{{name}}} is not known; use {known}")
        if conversion or not _WIDTH.fullmatch(width or ""):
            raise RackError(f"{key}.pattern: {{{name}:{width}}}: only a width may follow, as in {{bay:02}}")
        if width and name in {"aisle", "side"}:
            raise RackError(f"{key}.pattern: {{{name}:{width}}}: letters take no width")


def _fill(
    key: str, rack: Rack, fronts: Sequence[Shelf], nodes: Sequence[Node], found: dict[str, Location]
) -> None:
    if list(rack.levels_m) != sorted(set(rack.levels_m)):
        raise RackError(f"{key}.levels_m: must rise from level to level")
    bay = 0
    for shelf in fronts:
        if rack.levels_m[-1] >= shelf.height_m:
            top = f"{rack.levels_m[-1]:g} m is above the shelf of aisle {shelf.aisle} ({shelf.height_m:g} m)"
            raise RackError(f"{key}.levels_m: {top}")
        place_m = rack.bay_width_m / rack.positions
        for left_x_m in bay_edges(rack, shelf)[:-1]:
            bay += 1
            for level, height_m in enumerate(rack.levels_m, start=1):
                for position in range(1, rack.positions + 1):
                    code = _Place(shelf.aisle, shelf.side, bay, level, position).code(rack.pattern)
                    if code in found:
                        raise RackError(f"{key}.pattern: gives {code} twice; name what tells places apart")
                    x_m = left_x_m + (position - 0.5) * place_m
                    node = min(nodes, key=lambda node: abs(node.x_m - x_m))
                    found[code] = Location(
                        code, shelf.aisle, shelf.side, bay, level, position, x_m, shelf.y_m, height_m,
                        node.id, rack.pallets_deep,
                    )  # fmt: skip
    if not bay:
        raise RackError(f"{key}.bay_width_m: {rack.bay_width_m:g} m is wider than every front of the aisle")
