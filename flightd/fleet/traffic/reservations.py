"""Who has which resource when; what is free between are the safe intervals of SIPP."""

from __future__ import annotations

from bisect import insort
from collections.abc import Iterable, Sequence
from typing import Final, TypeAlias

from flightd.fleet.traffic.cells import Conflicts
from flightd.fleet.traffic.motions import NEVER

Interval: TypeAlias = tuple[int, int]
"""From and to, milliseconds; both ends belong to it."""

ALWAYS: Final[tuple[Interval, ...]] = ((0, NEVER),)


class ReservationTable:
    """What is taken on a resource is busy on all that conflict with it."""

    def __init__(self, conflicts: Conflicts) -> None:
        self._conflicts = conflicts
        self._busy: dict[int, list[tuple[int, int, str]]] = {}
        self._free: dict[int, Sequence[Interval]] = {}
        self._of: dict[str, set[int]] = {}

    def take(
        self,
        holder: str,
        resource: int,
        from_ms: int,
        to_ms: int,
        conflicts: Iterable[int] | None = None,
    ) -> None:
        """Reserve; with `conflicts` these resources are busy in place of those that conflict anyhow."""
        of = self._of.setdefault(holder, set())
        for other in self._conflicts[resource] if conflicts is None else conflicts:
            insort(self._busy.setdefault(other, []), (from_ms, to_ms, holder))
            self._free.pop(other, None)
            of.add(other)

    def give_back(self, holder: str) -> None:
        """All that a holder has."""
        for resource in self._of.pop(holder, ()):
            self._busy[resource] = [each for each in self._busy[resource] if each[2] != holder]
            self._free.pop(resource, None)

    def free(self, resource: int) -> Sequence[Interval]:
        """The safe intervals of a resource, rising; neighbours do not touch."""
        found = self._free.get(resource)
        if found is None:
            busy = self._busy.get(resource)
            found = self._free[resource] = _between(busy) if busy else ALWAYS
        return found

    def holders(self, resource: int, from_ms: int, to_ms: int) -> set[str]:
        """Who makes it busy for some of this time."""
        return {
            holder for start, end, holder in self._busy.get(resource, ()) if start < to_ms and end > from_ms
        }


def _between(busy: Iterable[tuple[int, int, str]]) -> list[Interval]:
    found: list[Interval] = []
    reached = 0
    for start, end, _ in busy:
        if start > reached:
            found.append((reached, start))
        reached = max(reached, end)
    if reached < NEVER:
        found.append((reached, NEVER))
    return found
