"""Ways that people have closed: nobody is planned into their air, or released into it, until they are open
again, and who is in it leaves."""

from __future__ import annotations

import heapq
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass

from flightd.fleet.traffic.lanes import UPRIGHT, LaneGraph


@dataclass(frozen=True, slots=True)
class Closure:
    """The `ways`, each between two nodes, that are closed together; `why` is told of what waits there."""

    name: str
    ways: tuple[tuple[str, str], ...]
    why: str

    @property
    def nodes(self) -> frozenset[str]:
        """The ends of its ways: nothing is done there meanwhile."""
        return frozenset(node for way in self.ways for node in way)


class ClosedAir:
    """The zones of one floor that are closed, by name: lanes, the vertices from which none that is open leads
    on, and the columns over these.  A vertex between two zones is of both."""

    def __init__(self, lanes: LaneGraph) -> None:
        self._lanes = lanes
        self._closed: dict[str, frozenset[int]] = {}
        self._zones: dict[str, frozenset[int]] = {}
        self._ways_home: dict[int, frozenset[int]] = {}

    def close(self, name: str, lanes: Iterable[int]) -> frozenset[int]:
        """Close these lanes at every level; the zone."""
        self._closed[name] = frozenset(lanes)
        self._lay_out()
        return self._zones[name]

    def open(self, name: str) -> None:
        """Open it again.  KeyError where nothing is closed by that name."""
        del self._closed[name]
        self._lay_out()

    def _lay_out(self) -> None:
        everything = frozenset().union(*self._closed.values())
        self._zones = {name: own | self._enclosed(own, everything) for name, own in self._closed.items()}
        self._ways_home.clear()

    @property
    def zones(self) -> tuple[frozenset[int], ...]:
        """All that is closed, each by itself."""
        return tuple(self._zones.values())

    @property
    def air(self) -> frozenset[int]:
        """All that is closed, together."""
        return frozenset().union(*self.zones)

    def shut_for(self, air: Collection[int]) -> frozenset[int]:
        """What is closed for who may be in this air: every zone but those in which he is."""
        return frozenset().union(*(zone for zone in self.zones if zone.isdisjoint(air)))

    def shut_round_way_out(self, air: Collection[int], start: int, homes: Iterable[int]) -> frozenset[int]:
        """The same for who leaves: of the zones in which he is he has the shortest way from the vertex
        `start` to where a way leads to one of `homes`, and no more; all of them where there is none."""
        shut = self.shut_for(air)
        goals = frozenset().union(*map(self.leads_to, homes))
        queue: list[tuple[float, int, tuple[int, ...]]] = [(0.0, start, (start,))]
        seen: set[int] = set()
        while queue:
            metres, here, way = heapq.heappop(queue)
            if here in goals:
                return self.air.difference(way)
            if here in seen:
                continue
            seen.add(here)
            for arc in self._lanes.arcs[here]:
                if shut.isdisjoint((arc.resource, arc.to)):
                    heapq.heappush(queue, (metres + arc.length_m, arc.to, (*way, arc.resource, arc.to)))
        return shut

    def within(self, airs: Mapping[str, Collection[int]]) -> dict[str, tuple[str, ...]]:
        """For each zone, by its name, who is in it of those that may be in these airs."""
        return {
            name: tuple(drone for drone, air in airs.items() if not zone.isdisjoint(air))
            for name, zone in self._zones.items()
        }

    def leads_to(self, home: int) -> frozenset[int]:
        """The vertices from which a way leads to this one over lanes that are open."""
        found = self._ways_home.get(home)
        if found is None:
            found = self._ways_home[home] = self._leading_to(home, self.air)
        return found

    def comes_home(self, air: Collection[int], start: int, home: int) -> bool:
        """Whether a way leads who may be in this air from the vertex `start` to this one: he may leave the
        zones in which he is."""
        return start in self.leads_to(home) or start in self._leading_to(home, self.shut_for(air))

    def _leading_to(self, home: int, shut: Collection[int]) -> frozenset[int]:
        onto: list[list[int]] = [[] for _ in self._lanes.vertices]
        for vertex, arcs in enumerate(self._lanes.arcs):
            for arc in arcs:
                if arc.resource not in shut:
                    onto[arc.to].append(vertex)
        found, todo = {home}, [home]
        while todo:
            fresh = [vertex for vertex in onto[todo.pop()] if vertex not in found]
            found.update(fresh)
            todo += fresh
        return frozenset(found)

    def _enclosed(self, own: frozenset[int], closed: frozenset[int]) -> frozenset[int]:
        """The ends of these lanes from which only closed ones lead on, and the columns over them."""
        lanes = self._lanes
        ends = {end for lane in own for end in lanes.ends_of(lane)}
        inside = {
            vertex
            for vertex in ends
            if all(arc.resource in closed or arc.quarter == UPRIGHT for arc in lanes.arcs[vertex])
        }
        return frozenset(inside | {lanes.column_of[lanes.vertices[vertex].node] for vertex in inside})
