"""How long a drone needs at least from everywhere to one vertex: what guides the search, kept for each
goal."""

from __future__ import annotations

import heapq
from typing import Final

from flightd.fleet.traffic.motions import NEVER, MotionNet

_MOST: Final = 4096


class Distances:
    """Lower bounds by cruising speed alone, over all lanes, whoever is on them."""

    def __init__(self, net: MotionNet) -> None:
        onto: list[list[tuple[int, int]]] = [[] for _ in net.lanes.vertices]
        for vertex, arcs in enumerate(net.lanes.arcs):
            for arc in arcs:
                onto[arc.to].append((vertex, net.lower_bound_ms(arc)))
        self._onto = onto
        self._known: dict[int, list[int]] = {}

    def to(self, goal: int) -> list[int]:
        """Milliseconds from each vertex, NEVER where no lane leads."""
        known = self._known.get(goal)
        if known is None:
            if len(self._known) >= _MOST:
                self._known.pop(next(iter(self._known)))
            known = self._known[goal] = self._dijkstra(goal)
        return known

    def _dijkstra(self, goal: int) -> list[int]:
        onto = self._onto
        best = [NEVER] * len(onto)
        best[goal] = 0
        queue = [(0, goal)]
        while queue:
            here_ms, here = heapq.heappop(queue)
            if here_ms > best[here]:
                continue
            for before, lane_ms in onto[here]:
                total_ms = here_ms + lane_ms
                if total_ms < best[before]:
                    best[before] = total_ms
                    heapq.heappush(queue, (total_ms, before))
        return best
