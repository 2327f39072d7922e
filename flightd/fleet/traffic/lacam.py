"""A search over where all stand at once, each step of which is one of priority inheritance.

After K. Okumura, "LaCAM: Search-Based Algorithm for Quick Multi-Agent Pathfinding", AAAI 2023.  It goes
deeper as long as steps lead to where they never stood before.  Where one does not, the next step from there
is forced: one of them to each vertex that it can have, first with whatever the others do then, at last
with all others where they are.  Moves are made one after the other, so that these last ones alone lead
wherever a way leads: it is complete, and finds nothing only where there is nothing, or where it has spent
what it may.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from flightd.fleet.traffic.cells import Conflicts
from flightd.fleet.traffic.lanes import LaneGraph
from flightd.fleet.traffic.pibt import Move, Mover, Pibt, Places

DECISIONS_AT_MOST: Final = 60_000
"""One is where one drone goes in one step."""


@dataclass(slots=True)
class _Node:
    """Where all stand, the moves that led there, for how many steps each has been away from its goal, who
    waits longest first, and what the next steps from there are forced to."""

    at: Places
    before: _Node | None
    moves: Sequence[Move]
    away: Sequence[int]
    order: Sequence[int]
    forced: Iterator[Mapping[int, int]]


def moves_home(
    lanes: LaneGraph,
    conflicts: Conflicts,
    movers: Sequence[Mover],
    start: Places,
    most: int = DECISIONS_AT_MOST,
) -> list[Move] | None:
    """Moves, one after the other and without detours, after which every mover stands on its goal; None where
    there are none, or `most` decisions do not suffice to find them."""
    pibt = Pibt(lanes, conflicts, movers)
    path = [_node(pibt, start, None, (), [0] * len(movers))]
    known = {start}
    spent = 0
    while path and spent < most:
        node = path[-1]
        if all(each.goal in {None, place} for each, place in zip(movers, node.at, strict=True)):
            return without_detours(_traced(node), start, conflicts)
        forced = next(node.forced, None)
        if forced is None:
            path.pop()
            continue
        moves = pibt.step(node.at, node.order, forced)
        spent += max(1, len(movers) - len(forced))
        at = list(node.at)
        for mover, arc in moves:
            at[mover] = arc.to
        reached = tuple(at)
        if reached not in known:
            known.add(reached)
            away = [
                0 if each.goal in {None, place} else steps + 1
                for each, place, steps in zip(movers, reached, node.away, strict=True)
            ]
            path.append(_node(pibt, reached, node, moves, away))
    return None


def _node(pibt: Pibt, at: Places, before: _Node | None, moves: Sequence[Move], away: Sequence[int]) -> _Node:
    order = sorted(range(len(at)), key=lambda mover: (-away[mover], mover))
    return _Node(at, before, moves, away, order, _forced(pibt, at, order))


def _forced(pibt: Pibt, at: Places, order: Sequence[int]) -> Iterator[Mapping[int, int]]:
    yield {}
    for mover in order:
        for there in pibt.wanted(mover, at[mover]):
            yield {mover: there}
    here = dict(enumerate(at))
    for mover in order:
        for there in pibt.wanted(mover, at[mover]):
            if there != at[mover]:
                yield {**here, mover: there}


def _traced(node: _Node) -> list[Move]:
    steps: list[Sequence[Move]] = []
    while node.before is not None:
        steps.append(node.moves)
        node = node.before
    return [move for moves in reversed(steps) for move in moves]


def without_detours(moves: Sequence[Move], start: Places, conflicts: Conflicts) -> list[Move]:
    """These moves without those by which somebody leaves a place and comes back, where nobody else needs it
    in between."""
    kept = list(moves)
    while True:
        before = len(kept)
        comes_last = {(mover, arc.to): i for i, (mover, arc) in enumerate(kept)}
        at = list(start)
        i = 0
        while i < len(kept):
            mover, arc = kept[i]
            comes_back = comes_last.get((mover, at[mover]), 0) > i
            back = _back_at(kept, i, at[mover], frozenset(conflicts[at[mover]])) if comes_back else 0
            if back:
                kept[i:back] = [move for move in kept[i:back] if move[0] != mover]
            else:
                at[mover] = arc.to
                i += 1
        if len(kept) == before:
            return kept


def _back_at(moves: Sequence[Move], first: int, place: int, near: Collection[int]) -> int:
    """The number of the move before which who makes the first one is back for the last time until somebody
    takes air that conflicts with the place; 0 where it never is."""
    mover = moves[first][0]
    back = 0
    for i in range(first + 1, len(moves)):
        other, arc = moves[i]
        if other == mover and arc.to == place:
            back = i + 1
        elif other != mover and arc.resource in near:
            break
    return back
