"""Docks that a fleet shares, and which drone goes to which: by when it would be ready to fly again, with the
way there, those before it, and how long the dock takes."""

from __future__ import annotations

import enum
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass


class DockKind(enum.StrEnum):
    """How a battery is filled."""

    SWAP = "swap"
    """It is taken out for a full one."""
    CONTACT = "contact"
    """It is charged through the feet of the drone, which stays on the pad, and has to stand on it well."""


@dataclass(frozen=True, slots=True)
class Dock:
    """A charge pad at the vertex `place`, for one drone at a time.  `full_s` is what a swap takes, and
    charging from empty to full."""

    name: str
    place: int
    kind: DockKind
    full_s: float

    def service_ms(self, charge: float) -> int:
        """From this charge to full."""
        share = 1.0 if self.kind is DockKind.SWAP else max(1.0 - charge, 0.0)
        return int(1000 * self.full_s * share)


@dataclass(frozen=True, slots=True)
class Waiting:
    """A drone that wants a dock, its charge, and the milliseconds to each dock that it can reach."""

    drone: str
    charge: float
    ways_ms: Mapping[str, int]


def chosen_docks(
    docks: Iterable[Dock], free_ms: Mapping[str, int], waiting: Sequence[Waiting]
) -> dict[str, Dock]:
    """The dock of each drone, who waited longest first: the one from which it is ready soonest, after those
    before it.  `free_ms` is in how long each dock is left; none is chosen for a drone that reaches none."""
    known = {dock.name: dock for dock in docks}
    free = dict(free_ms)
    chosen: dict[str, Dock] = {}
    for each in waiting:
        ready = {
            name: max(way_ms, free[name]) + known[name].service_ms(each.charge)
            for name, way_ms in each.ways_ms.items()
        }
        if ready:
            best = min(ready, key=lambda name: (ready[name], name))
            chosen[each.drone], free[best] = known[best], ready[best]
    return chosen
