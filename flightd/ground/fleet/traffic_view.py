"""The traffic of a station's drones as its page and programs read it: what each did lately, does and is to
do, and the air that is closed on its account."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from flightd.fleet.traffic.dock_queue import DockQueue
from flightd.fleet.traffic.drone_course import DroneCourse
from flightd.fleet.traffic.motions import Act
from flightd.fleet.traffic.plan import Action
from flightd.fleet.traffic.traffic_control import TrafficControl
from flightd.ground.fleet.fleet_drone import FleetDrone

MOST_AHEAD: Final = 60
MOST_DONE: Final = 40
"""So many actions of each drone are told, the nearest in time."""


@dataclass(frozen=True, slots=True)
class _Done:
    act: Act
    vertex: int
    begin_ms: int
    end_ms: int


class TrafficView:
    """`see` it after every step; `drones` moves nothing."""

    def __init__(self, control: TrafficControl, drones: Mapping[str, FleetDrone]) -> None:
        self._control = control
        self._drones = drones
        self._now_ms = 0
        self._ahead: Mapping[str, list[Action]] | None = None
        self._base: dict[str, tuple[int, int, tuple[Action, ...]]] = {}
        self._past: dict[str, deque[_Done]] = {name: deque(maxlen=MOST_DONE) for name in drones}

    def see(self, now_ms: int) -> None:
        """What was released and is done since is over now."""
        self._now_ms, self._ahead = now_ms, None
        for name, course in self._control.drones.items():
            done, begin_ms, base = self._base.get(name, (0, 0, ()))
            for action in base[: max(course.done - done, 0)]:
                self._past[name].append(_Done(action.act, action.vertex, begin_ms, now_ms))
                begin_ms = now_ms
            self._base[name] = course.done, course.since_ms, tuple(course.base)

    def drones(self, flown: frozenset[str], *, in_full: bool = True) -> dict[str, Any]:
        """Each, as JSON has it.  `flown` are those that traffic flies now.  Times are seconds from the last
        step; what lies ahead and behind, and closed air, are told `in_full` only."""
        closed = self._control.closed_by() if in_full else {}
        return {
            name: {
                **self._now(name, course, is_flown=name in flown),
                **self._in_time(name, course, in_full=in_full),
                "closed": self._air(closed.get(name, frozenset())),
            }
            for name, course in self._control.drones.items()
        }

    def docks(self, docks: DockQueue) -> list[dict[str, Any]]:
        """The pads that the drones share, as JSON has them: for which `drone` each is kept (empty: it is
        free), and whether it is `taken`, or that one is still to come."""
        places = {name: course.place for name, course in self._control.drones.items()}
        return [
            {
                "pad": dock.name,
                "node": self._node(dock.place),
                "drone": docks.holders.get(dock.name, ""),
                "taken": places.get(docks.holders.get(dock.name, "")) == dock.place,
            }
            for dock in docks.docks
        ]

    def _now(self, name: str, course: DroneCourse, *, is_flown: bool) -> dict[str, Any]:
        drone = self._drones[name]
        return {
            "flown": is_flown,
            "at": self._node(course.place),
            "pad": drone.pad.node,
            "rests": drone.air.rests,
            "base": [self._node(action.vertex) for action in course.base],
            "doubt_m": round(course.doubt_m, 2),
            "waits_for": list(self._control.waits(name)) if is_flown else [],
            "why": "" if is_flown else drone.why,
            "charges_to": drone.charges_to if is_flown else None,
            "cut_off": is_flown and self._control.is_cut_off(name),
        }

    def _in_time(self, name: str, course: DroneCourse, *, in_full: bool) -> dict[str, Any]:
        if not in_full:
            return {"tour": [], "plan": [], "past": []}
        if self._ahead is None:
            self._ahead = self._control.projected(self._now_ms)
        ahead, released = self._ahead[name], len(course.base)
        plan = [self._timed(one.act, one.vertex, one.start_ms, one.end_ms) for one in ahead[:MOST_AHEAD]]
        return {
            "tour": list(dict.fromkeys(self._node(one.vertex) for one in ahead if one.act is Act.COUNT)),
            "plan": [{**one, "released": i < released} for i, one in enumerate(plan)],
            "past": [self._timed(one.act, one.vertex, one.begin_ms, one.end_ms) for one in self._past[name]],
        }

    def _timed(self, act: Act, vertex: int, begin_ms: int, end_ms: int) -> dict[str, Any]:
        return {
            "act": act.value,
            "node": self._node(vertex),
            "begin_s": round((begin_ms - self._now_ms) / 1000, 1),
            "end_s": round((end_ms - self._now_ms) / 1000, 1),
        }

    def _air(self, resources: frozenset[int]) -> dict[str, Any]:
        """The nodes, and the ways between two, over which nobody else flies."""
        lanes = self._control.lanes
        touched = [lanes.nodes_of(resource) for resource in resources if not self._is_pad(resource)]
        return {
            "nodes": sorted({nodes[0] for nodes in touched if len(nodes) == 1}),
            "ways": sorted({tuple(sorted(nodes)) for nodes in touched if len(set(nodes)) == 2}),
        }

    def _is_pad(self, resource: int) -> bool:
        vertices = self._control.lanes.vertices
        return resource < len(vertices) and vertices[resource].pad is not None

    def _node(self, vertex: int) -> str:
        return self._control.lanes.vertices[vertex].node
