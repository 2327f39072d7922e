"""Which painted lines may be flown, in which direction, and the shortest way along them.

A line is closed for good where it is blocked or comes near a keep-out; a one-way line is closed against its
direction, which a return in need may ignore.
"""

from __future__ import annotations

import enum
import heapq
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from flightd.core.errors import InputError

BODY_RADIUS_M = 0.30
"""Half the width of the drone, with its propellers."""
_OFF_M = 0.3
"""What the drone's centre may be off its line, or off where it lands; in gusts it is 0.15 to 0.25 m."""
KEEP_OUT_CLEARANCE_M = BODY_RADIUS_M + _OFF_M
"""Nearer to a keep-out than this no line is flown, no shelf looked at and no landing aimed for."""
KEEP_OUT_HEIGHT_M = 0.3
"""So far above and below a keep-out nothing is flown: half of the drone's height, and what it may be off."""


class OneWay(enum.StrEnum):
    """The only direction in which an aisle is flown."""

    PLUS_X = "+x"
    MINUS_X = "-x"


@dataclass(frozen=True, slots=True)
class KeepOut:
    """A rectangle of the floor, x0 < x1 and y0 < y1, over which nothing flies between two heights."""

    x0_m: float
    y0_m: float
    x1_m: float
    y1_m: float
    from_m: float = 0.0
    to_m: float = math.inf

    def touches(self, ax_m: float, ay_m: float, bx_m: float, by_m: float) -> bool:
        """Whether the straight line a-b along x or y comes within the clearance of the rectangle."""
        c = KEEP_OUT_CLEARANCE_M
        return (
            max(ax_m, bx_m) > self.x0_m - c
            and min(ax_m, bx_m) < self.x1_m + c
            and max(ay_m, by_m) > self.y0_m - c
            and min(ay_m, by_m) < self.y1_m + c
        )


class NoWayError(InputError):
    """No open line leads from one node to another."""


class Ways:
    """The open lines as a directed graph: `arcs` of (from, to, metres)."""

    def __init__(self, nodes: Iterable[str], arcs: Iterable[tuple[str, str, float]]) -> None:
        onward: dict[str, list[tuple[str, float]]] = {node: [] for node in nodes}
        for a, b, length_m in arcs:
            onward[a].append((b, length_m))
        self._onward: Mapping[str, list[tuple[str, float]]] = onward

    def onward(self, node: str) -> list[tuple[str, float]]:
        """The nodes to which an open line leads from `node`, with its length in metres."""
        return self._onward[node]

    def path(self, start: str, goal: str) -> tuple[str, ...] | None:
        """Shortest way, both ends included (Dijkstra); None when there is none, KeyError for an unknown
        node."""
        if start not in self._onward or goal not in self._onward:
            raise KeyError(start if start not in self._onward else goal)
        came_from = self.reach(start, goal)
        if goal not in came_from:
            return None
        way = [goal]
        while way[-1] != start:
            way.append(came_from[way[-1]])
        return tuple(reversed(way))

    def reach(self, start: str, goal: str | None = None) -> dict[str, str]:
        """Each node that can be reached with the node before it on the shortest way, in the order of
        distance; the start comes from itself.  Ends at `goal` when one is given."""
        best = {start: 0.0}
        before = {start: start}
        settled: dict[str, str] = {}
        queue = [(0.0, start)]
        while queue:
            travelled_m, here = heapq.heappop(queue)
            if here in settled:
                continue
            settled[here] = before[here]
            if here == goal:
                break
            for there, length_m in self._onward[here]:
                total_m = travelled_m + length_m
                if total_m < best.get(there, math.inf):
                    best[there] = total_m
                    before[there] = here
                    heapq.heappush(queue, (total_m, there))
        return settled
