"""Which line of a frame is which line held."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from flightd.tracking.line_sight import LineSight

_GATE_SIGMAS = 4.0
_LEAST_SHARE = 0.3
"""Of the gate: so near a line is taken for one held however sure both are."""


@dataclass(slots=True)
class HeldLine:
    """A line that is followed, or what a point of the floor, the `feature` of that number, is across the
    axis."""

    id: int
    axis: int
    width_m: float
    seen_ns: int
    from_m: float
    to_m: float
    hits: int = 1
    feature: int | None = None
    surveyed: bool = False
    """Its distance from another line was held against the map."""


def associate(
    sights: Sequence[LineSight],
    held: Sequence[HeldLine],
    innovation: Callable[[LineSight, int], tuple[float, float]],
    gate_m: float,
) -> tuple[list[tuple[LineSight, int]], list[LineSight]]:
    """Each sight with the line held that it is, and those that are none; the surest sights choose first.
    `innovation` says of a sight and a line how far they are apart and the standard deviation of that;
    `gate_m` is the farthest that is looked for."""
    known: list[tuple[LineSight, int]] = []
    fresh: list[LineSight] = []
    taken: set[int] = set()
    for sight in sorted(sights, key=lambda seen: seen.sigma_m):
        best, best_m = None, gate_m
        for line, one in enumerate(held):
            if line in taken or one.axis != sight.axis or one.feature is not None:
                continue
            apart_m, sigma_m = innovation(sight, line)
            if abs(apart_m) < min(best_m, max(_GATE_SIGMAS * sigma_m, _LEAST_SHARE * gate_m)):
                best, best_m = line, abs(apart_m)
        if best is None:
            fresh.append(sight)
        else:
            taken.add(best)
            known.append((sight, best))
    return known, fresh
