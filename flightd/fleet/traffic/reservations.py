"""Who has which resource when; what is free between are the safe intervals of SIPP."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Iterable
from typing import Final

from flightd.fleet.traffic.cells import Conflicts
from flightd.fleet.traffic.motions import NEVER

ENDLESS: Final = NEVER << 2
"""The end of a safe interval without one: NEVER is before it, whatever is taken from it."""
FREE_FROM: Final = [0]
"""The starts of the safe intervals of whatever nobody has taken, the list itself.  It is never changed."""
_FREE_UNTIL: Final = [ENDLESS]


class ReservationTable:
    """What is taken on a resource is busy on all that conflict with it.

    `starts` and `ends` have the safe intervals of each resource, rising, in milliseconds; both ends belong to
    them, neighbours do not touch.  They are for reading, and always up to date."""

    def __init__(self, conflicts: Conflicts) -> None:
        self._conflicts = conflicts
        self._busy: dict[int, list[tuple[int, int, str]]] = {}
        self._of: dict[str, set[int]] = {}
        self.starts: list[list[int]] = [FREE_FROM] * len(conflicts)
        self.ends: list[list[int]] = [_FREE_UNTIL] * len(conflicts)

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
            of.add(other)
            self._cut(holder, other, from_ms, to_ms)

    def take_all(self, holder: str, spells: Iterable[tuple[int, int, int]]) -> None:
        """Reserve (resource, from, to) in the order of their times, none within another."""
        open_spells: dict[int, tuple[int, int]] = {}
        for resource, from_ms, to_ms in spells:
            for other in self._conflicts[resource]:
                began_ms, ends_ms = open_spells.get(other, (from_ms, from_ms))
                if ends_ms < from_ms:
                    self._cut(holder, other, began_ms, ends_ms)
                    began_ms = from_ms
                open_spells[other] = began_ms, to_ms
        for other, (began_ms, ends_ms) in open_spells.items():
            self._cut(holder, other, began_ms, ends_ms)
        self._of.setdefault(holder, set()).update(open_spells)

    def _cut(self, holder: str, resource: int, from_ms: int, to_ms: int) -> None:
        """Make one resource busy."""
        starts, ends = self.starts[resource], self.ends[resource]
        if starts is FREE_FROM:
            starts, ends = self.starts[resource], self.ends[resource] = [0], [ENDLESS]
        self._busy.setdefault(resource, []).append((from_ms, to_ms, holder))
        until_ms = to_ms if to_ms < NEVER else ENDLESS
        i, j = bisect_right(ends, from_ms), bisect_left(starts, until_ms)
        if i >= j:
            return
        before = starts[i] < from_ms
        after = ends[j - 1] > until_ms
        starts[i:j], ends[i:j] = (
            [starts[i]] * before + [until_ms] * after,
            [from_ms] * before + [ends[j - 1]] * after,
        )

    def give_back(self, holder: str) -> None:
        """All that a holder has."""
        for resource in self._of.pop(holder, ()):
            busy = [each for each in self._busy[resource] if each[2] != holder]
            self._busy[resource] = busy
            self.starts[resource], self.ends[resource] = _between(busy)

    def holders(self, resource: int, from_ms: int, to_ms: int) -> set[str]:
        """Who makes it busy for some of this time."""
        return {
            holder for start, end, holder in self._busy.get(resource, ()) if start < to_ms and end > from_ms
        }


def _between(busy: Iterable[tuple[int, int, str]]) -> tuple[list[int], list[int]]:
    starts: list[int] = []
    ends: list[int] = []
    reached = 0
    for start, end, _ in sorted(busy):
        if start > reached:
            starts.append(reached)
            ends.append(start)
        reached = max(reached, end)
    if reached < NEVER:
        starts.append(reached)
        ends.append(ENDLESS)
    return starts, ends
