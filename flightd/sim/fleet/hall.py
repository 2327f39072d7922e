"""A hall for a fleet: equal aisles joined at both ends, and a pad at the end of a spur for each drone."""

from __future__ import annotations

import itertools
import string

from flightd.site.layout import lay_out
from flightd.site.site import Aisle, Pad, Rack, Side, Site

SPACING_M = 2.0
_PITCH_M = 4.0
_SPUR_M = 4.0
_LEVELS_M = (0.3, 1.5, 2.7, 3.9)


def aisle_names(count: int) -> list[str]:
    """A, B … Z, AA, AB …"""
    letters = string.ascii_uppercase
    return [(letters[i // 26 - 1] if i >= 26 else "") + letters[i % 26] for i in range(count)]


def fleet_hall(aisles: int, nodes: int, pads: int) -> Site:
    """`nodes` of each aisle face its shelves; beyond them lie a cross at either end, and a spur with room for a
    pad.  At most two pads an aisle."""
    names = aisle_names(aisles)
    last = nodes + 4
    steps = (_SPUR_M, *([SPACING_M] * (nodes + 1)), _SPUR_M)
    rows = [
        Aisle(name, 0.0, i * _PITCH_M, steps, shelf_distance_m=1.4, shelf_height_m=5.0, shelves=tuple(Side))
        for i, name in enumerate(names)
    ]
    crosses = [
        (f"{a}{at}", f"{b}{at}") for a, b in itertools.pairwise(names) for at in (2, last - 1)
    ]
    ends = [f"{name}{at}" for at in (1, last) for name in names]
    places = [ends[i * len(ends) // pads] for i in range(pads)]
    racks = [Rack(tuple(names), SPACING_M, _LEVELS_M, positions=2)]
    return lay_out(
        f"hall of {aisles} aisles",
        rows,
        crosses,
        [Pad(f"P{i}", place, 0.6) for i, place in enumerate(places, start=1)],
        ceiling_m=7.0,
        racks=racks,
    )
