"""A hall for a fleet: equal aisles joined at both ends, and a pad at the end of a spur for each drone."""

from __future__ import annotations

import itertools
import string

from flightd.site.layout import lay_out
from flightd.site.site import Aisle, Pad, Rack, Site

SPACING_M = 2.0
_PITCH_M = 4.0
_SPUR_M = 4.0
_LEVELS_M = (0.3, 1.5, 2.7, 3.9)


def aisle_names(count: int) -> list[str]:
    """A, B … Z, AA, AB …"""
    letters = string.ascii_uppercase
    return [(letters[i // 26 - 1] if i >= 26 else "") + letters[i % 26] for i in range(count)]


def fleet_hall(aisles: int, nodes: int, pads: int) -> Site:
    """`aisles` of `nodes` each, and between them dock aisles without shelves, spread over the hall: one for
    two pads, which lie beyond the crosses at its ends."""
    names = aisle_names(aisles)
    docks = [f"D{name}" for name in aisle_names(26 + (pads + 1) // 2)[26:]]
    rows = list(names)
    for i, dock in reversed(list(enumerate(docks))):
        rows.insert((2 * i + 1) * aisles // (2 * len(docks)), dock)
    steps = (SPACING_M,) * (nodes + 1)
    laid: list[Aisle] = []
    for row, name in enumerate(rows):
        if name in docks:
            laid.append(Aisle(name, -_SPUR_M, row * _PITCH_M, (_SPUR_M, *steps, _SPUR_M), shelves=()))
        else:
            laid.append(Aisle(name, 0.0, row * _PITCH_M, steps, shelf_distance_m=1.4, shelf_height_m=5.0))
    ends = {name: (2, nodes + 3) if name in docks else (1, nodes + 2) for name in rows}
    crosses = [
        (f"{a}{ends[a][end]}", f"{b}{ends[b][end]}") for a, b in itertools.pairwise(rows) for end in (0, 1)
    ]
    places = [f"{dock}{at}" for at in (1, nodes + 4) for dock in docks][:pads]
    return lay_out(
        f"hall of {aisles} aisles",
        laid,
        crosses,
        [Pad(f"P{i}", place, 0.6) for i, place in enumerate(places, start=1)],
        ceiling_m=7.0,
        racks=[Rack(tuple(names), SPACING_M, _LEVELS_M, positions=2)],
    )
