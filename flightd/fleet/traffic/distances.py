"""How long a drone needs at least from everywhere to one vertex: what guides the search, kept for each
goal."""

from __future__ import annotations

import heapq
from collections.abc import Collection, Sequence
from typing import Final, TypeAlias

from flightd.fleet.traffic.motions import NEVER, MotionNet

_MOST: Final = 4096
_Chain: TypeAlias = tuple[tuple[int, int], ...]


class Distances:
    """Lower bounds by cruising speed alone, over all lanes but those that are `shut`, whoever is on them.

    Dijkstra's algorithm against the lanes, where an aisle without a crossing is one step: (vertex,
    milliseconds) of each vertex along it, as far as the first one that has several ways on."""

    def __init__(self, net: MotionNet, shut: Collection[int] = ()) -> None:
        onto: list[dict[int, int]] = [{} for _ in net.lanes.vertices]
        for vertex, arcs in enumerate(net.lanes.arcs):
            for arc in arcs:
                if arc.resource in shut:
                    continue
                lane_ms = net.lower_bound_ms(arc)
                onto[arc.to][vertex] = min(lane_ms, onto[arc.to].get(vertex, NEVER))
        self._onto = onto
        self._chains: dict[int, tuple[_Chain, ...]] = {}
        self._known: dict[int, list[int]] = {}

    def to(self, goal: int) -> Sequence[int]:
        """Milliseconds from each vertex, NEVER where no lane leads."""
        known = self._known.get(goal)
        if known is None:
            if len(self._known) >= _MOST:
                self._known.pop(next(iter(self._known)))
            known = self._known[goal] = self._dijkstra(goal)
        return known

    def _dijkstra(self, goal: int) -> list[int]:
        best = [NEVER] * len(self._onto)
        best[goal] = 0
        queue = [(0, goal)]
        while queue:
            here_ms, here = heapq.heappop(queue)
            if here_ms > best[here]:
                continue
            for chain in self._chains_onto(here):
                total_ms, vertex = here_ms, here
                for vertex, along_ms in chain:
                    total_ms = here_ms + along_ms
                    if total_ms >= best[vertex]:
                        break
                    best[vertex] = total_ms
                else:
                    heapq.heappush(queue, (total_ms, vertex))
        return best

    def _chains_onto(self, vertex: int) -> tuple[_Chain, ...]:
        found = self._chains.get(vertex)
        if found is None:
            found = tuple(self._chain(vertex, before) for before in self._onto[vertex])
            self._chains[vertex] = found
        return found

    def _chain(self, vertex: int, before: int) -> _Chain:
        chain: list[tuple[int, int]] = []
        seen = {vertex}  # a ring of one-way lanes whose entries are shut never branches
        along_ms, here, after = 0, before, vertex
        while True:
            along_ms += self._onto[after][here]
            chain.append((here, along_ms))
            onward = [each for each in self._onto[here] if each != after]
            if len(onward) != 1 or here in seen:
                return tuple(chain)
            seen.add(here)
            here, after = onward[0], here
