"""Stretches of aisles far from any crossing: where a drone that is not to stop there only flies through."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from flightd.fleet.traffic.lanes import UPRIGHT, Lane, LaneGraph

NONE: Final = -1
ASIDE: Final = 2
"""So many nodes beside a crossing a drone may step aside."""


def sections_of(lanes: LaneGraph, aside: int = ASIDE) -> Sequence[int]:
    """For each vertex the number of its section, NONE for those that are no more than `aside` lanes from a
    crossing, a corner, a climb, a pad or the end of an aisle."""
    lanes_at: list[list[Lane]] = [[] for _ in lanes.vertices]
    for lane in lanes.lanes:
        lanes_at[lane.a].append(lane)
        lanes_at[lane.b].append(lane)
    near = [vertex for vertex, at in enumerate(lanes_at) if not _goes_straight(at)]
    is_near = [False] * len(lanes_at)
    for vertex in near:
        is_near[vertex] = True
    for _ in range(aside):
        near = [other for vertex in near for other in _others(vertex, lanes_at) if not is_near[other]]
        for vertex in near:
            is_near[vertex] = True
    found = [NONE] * len(lanes_at)
    for first in range(len(found)):
        if not is_near[first] and found[first] == NONE:
            todo = [first]
            while todo:
                found[here := todo.pop()] = first
                todo += [v for v in _others(here, lanes_at) if not is_near[v] and found[v] == NONE]
    return found


def _others(vertex: int, lanes_at: Sequence[Sequence[Lane]]) -> list[int]:
    return [lane.b if lane.a == vertex else lane.a for lane in lanes_at[vertex]]


def _goes_straight(lanes: Sequence[Lane]) -> bool:
    """Whether these are two lanes in one line."""
    return (
        len(lanes) == 2
        and UPRIGHT not in (lanes[0].quarter, lanes[1].quarter)
        and (lanes[0].quarter - lanes[1].quarter) % 2 == 0
    )
