"""The traffic of a station's drones as its page and programs read it: what each did lately, does and is
to do, the air that is closed on its account, and the work."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from flightd.fleet.traffic.drone_course import DroneCourse
from flightd.fleet.traffic.motions import Act
from flightd.fleet.traffic.plan import Action
from flightd.fleet.traffic.traffic_control import TrafficControl
from flightd.fleet.traffic.work_queue import WorkQueue
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
    """`see` it after every step; `document` is as JSON has it, and moves nothing."""

    def __init__(self, control: TrafficControl, queue: WorkQueue, drones: Mapping[str, FleetDrone]) -> None:
        self._control = control
        self._queue = queue
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

    def document(self, flown: frozenset[str]) -> dict[str, Any]:
        """`flown` are the drones that traffic flies now.  Times are seconds from the last step."""
        if self._ahead is None:
            self._ahead = self._control.projected(self._now_ms)
        closed = self._control.closed_by()
        return {
            "drones": {
                name: {
                    **self._told(name, course, self._ahead[name]),
                    "flown": name in flown,
                    "waits_for": list(self._control.waits(name)) if name in flown else [],
                    "why": "" if name in flown else self._drones[name].why,
                    "closed": self._air(closed.get(name, frozenset())),
                }
                for name, course in self._control.drones.items()
            },
            "open": list(self._queue.open),
            "given": dict(self._queue.given),
            "done": list(self._queue.done),
            "not_done": dict(self._queue.reasons),
        }

    def _told(self, name: str, course: DroneCourse, ahead: list[Action]) -> dict[str, Any]:
        drone, released = self._drones[name], len(course.base)
        return {
            "at": self._node(course.place),
            "pad": drone.pad.node,
            "rests": drone.air.rests,
            "base": [self._node(action.vertex) for action in course.base],
            "tour": list(dict.fromkeys(self._node(one.vertex) for one in ahead if one.act is Act.COUNT)),
            "doubt_m": round(course.doubt_m, 2),
            "plan": [
                {
                    **self._timed(action.act, action.vertex, action.start_ms, action.end_ms),
                    "released": i < released,
                }
                for i, action in enumerate(ahead[:MOST_AHEAD])
            ],
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
