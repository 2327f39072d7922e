"""Which line of a frame is which line held."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from flightd.tracking.line_sight import LineSight

_GATE_SIGMAS = 4.0
_LEAST_SHARE = 0.3
"""Of the gate: so near a line is taken for one held however sure both are."""


@dataclass(slots=True)
class HeldLine:
    """A line that is followed."""

    id: int
    axis: int
    width_m: float
    seen_ns: int
    from_m: float
    to_m: float
    hits: int = 1


def associate(
    sights: Sequence[LineSight],
    held: Sequence[HeldLine],
    offsets_m: Sequence[tuple[float, float]],
    gate_m: float,
) -> tuple[list[tuple[LineSight, int]], list[LineSight]]:
    """Each sight with the line held that it is, and those that are none; the surest sights choose first.
    `offsets_m` are the offset of each line held and its sigma, `gate_m` the farthest that is looked for."""
    known: list[tuple[LineSight, int]] = []
    fresh: list[LineSight] = []
    taken: set[int] = set()
    for sight in sorted(sights, key=lambda seen: seen.sigma_m):
        best, best_m = None, gate_m
        for line, one in enumerate(held):
            if line in taken or one.axis != sight.axis:
                continue
            offset_m, sigma_m = offsets_m[line]
            distance_m = abs(sight.offset_m - offset_m)
            spread_m = math.hypot(sigma_m, sight.sigma_m)
            if distance_m < best_m and distance_m < max(_GATE_SIGMAS * spread_m, _LEAST_SHARE * gate_m):
                best, best_m = line, distance_m
        if best is None:
            fresh.append(sight)
        else:
            taken.add(best)
            known.append((sight, best))
    return known, fresh
