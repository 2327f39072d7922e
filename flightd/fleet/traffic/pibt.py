"""Priority inheritance with backtracking: one step of all, where who is in the way of another is pushed on.

K. Okumura, M. Machida, X. Défago and Y. Tamura, "Priority Inheritance with Backtracking for Iterative
Multi-agent Path Finding", Artificial Intelligence 310, 2022.  Of two moves of a step whose cells meet one is
made after the other, and one whose way is not free even then is left out.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from flightd.fleet.traffic.cells import Conflicts
from flightd.fleet.traffic.lanes import Arc, LaneGraph
from flightd.fleet.traffic.motions import NEVER

Places: TypeAlias = tuple[int, ...]
"""The vertex on which each drone stands."""
Move: TypeAlias = tuple[int, Arc]
"""The number of a drone, and the lane that it flies from rest to rest."""


@dataclass(frozen=True, slots=True)
class Mover:
    """Who takes part: the vertex `goal` it wants to, or None where any is as good; the lanes `shut` that it
    may not fly; and the milliseconds from each vertex by which it chooses, NEVER where it is not to go."""

    goal: int | None
    shut: frozenset[int]
    left_ms: Sequence[int]


class Pibt:
    """Steps of these movers on one graph."""

    def __init__(self, lanes: LaneGraph, conflicts: Conflicts, movers: Sequence[Mover]) -> None:
        self._lanes = lanes
        self._conflicts = [frozenset(each) for each in conflicts]
        self._movers = movers
        self._ways: list[dict[int, tuple[Arc, ...]]] = [{} for _ in movers]
        self._wanted: list[dict[int, tuple[int, ...]]] = [{} for _ in movers]
        self._at: Places = ()
        self._next: dict[int, int] = {}

    def ways(self, mover: int, here: int) -> tuple[Arc, ...]:
        """Where it may fly from a vertex."""
        found = self._ways[mover].get(here)
        if found is None:
            each = self._movers[mover]
            found = self._ways[mover][here] = tuple(
                arc
                for arc in self._lanes.arcs[here]
                if arc.resource not in each.shut and each.left_ms[arc.to] < NEVER
            )
        return found

    def wanted(self, mover: int, here: int) -> tuple[int, ...]:
        """Where it may be after a step from a vertex, the nearest to its goal first."""
        found = self._wanted[mover].get(here)
        if found is None:
            left_ms = self._movers[mover].left_ms
            vertices = {here, *(arc.to for arc in self.ways(mover, here))}
            found = tuple(sorted(vertices, key=lambda vertex: (left_ms[vertex], vertex)))
            self._wanted[mover][here] = found
        return found

    def step(self, at: Places, order: Sequence[int], forced: Mapping[int, int]) -> list[Move]:
        """The moves of one step, in the order in which they can be made one by one: who is first in `order`
        has its way.  Those that are `forced` to a vertex go there and nowhere else, where they can."""
        self._at = at
        self._next = dict(forced)
        for mover in order:
            if mover not in self._next:
                self._decide(mover)
        moves: list[Move] = []
        now = list(at)
        movers = [mover for mover in order if self._next[mover] != at[mover]]
        while movers:
            move = next((move for mover in movers if (move := self._made(mover, now))), None)
            if move is None:
                break
            mover, arc = move
            now[mover] = arc.to
            movers.remove(mover)
            moves.append(move)
        return moves

    def _decide(self, mover: int) -> bool:
        """The mover's next vertex; False where it has to stay in somebody's way."""
        here = self._at[mover]
        for there in self.wanted(mover, here):
            if self._is_taken(mover, here, there):
                continue
            self._next[mover] = there
            near = self._conflicts[there]
            pushed = [
                other for other, place in enumerate(self._at) if place in near and other not in self._next
            ]
            if all(other in self._next or self._decide(other) for other in pushed):
                return True
        self._next[mover] = here
        return False

    def _is_taken(self, mover: int, here: int, there: int) -> bool:
        """Whether somebody goes there, or comes from there to here."""
        near = self._conflicts[there]
        return any(
            vertex in near or (vertex == here and self._at[other] == there)
            for other, vertex in self._next.items()
            if other != mover
        )

    def _made(self, mover: int, now: Sequence[int]) -> Move | None:
        """Its move, if the way meets nobody where all stand now."""
        there = self._next[mover]
        for arc in self.ways(mover, now[mover]):
            if arc.to == there:
                near = self._conflicts[arc.resource]
                if not any(place in near for other, place in enumerate(now) if other != mover):
                    return mover, arc
        return None
