"""Traffic control over the drones of a station: hears what they tell, and flies those that it may.

A drone that is silent, that a person took, that comes home by itself, that landed anywhere or went astray is
flown by somebody else: the air of its way is closed until it rests where traffic can fly it on.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final

from flightd.core.errors import InputError
from flightd.fleet.traffic.cells import CellSize
from flightd.fleet.traffic.dispatcher import Dispatcher, Endurance
from flightd.fleet.traffic.traffic_control import TrafficControl
from flightd.fleet.traffic.work_queue import NodeWork, Value, WorkQueue
from flightd.ground.fleet.fleet_drone import FLIGHT_S, RESERVE, FleetDrone
from flightd.ground.fleet.fleet_floor import HEIGHT_M, FleetFloor
from flightd.ground.mqtt.safe_return import Standing
from flightd.mission.plan.leg_times import Pace

_LEAST_S: Final = 60.0
"""A drone with less time left in the air is given nothing."""
_ENDURANCE: Final = Endurance(FLIGHT_S, FLIGHT_S, RESERVE, RESERVE + _LEAST_S / FLIGHT_S)
_SLOWEST_MPS, _FASTEST_MPS = 0.1, 1.0


def pace_of(standings: Iterable[Standing]) -> Pace:
    """That of the slowest drone, with all that it stops for on its own plan."""
    slowest_s = max(standing.pace_s for standing in standings)
    speed_mps = min(max(1.0 / max(slowest_s, 1e-3), _SLOWEST_MPS), _FASTEST_MPS)
    return Pace(HEIGHT_M, 0.5, 0.5, speed_mps, 0.5, 0.8, 1.5, 0.5, 3.0, 6.0, 6.0)


class StationTraffic:
    """`step` it often.  It takes the drones one by one, where each rests; what the `queue` has given before
    waits again."""

    def __init__(
        self,
        floor: FleetFloor,
        drones: Mapping[str, FleetDrone],
        pace: Pace,
        cell: CellSize,
        queue: WorkQueue,
    ) -> None:
        self._floor = floor
        self._drones = drones
        self._control = TrafficControl(floor.lanes, pace, cell)
        self._queue = queue
        queue.hand_back([*queue.given])
        gone = [node for node in queue.open if node not in floor.lanes.column_of]
        queue.hand_back(gone, "the drones' map has it no more")
        self._dispatcher = Dispatcher(self._control, self._queue, _ENDURANCE, shares=True)
        self._dwell_ms = int(pace.dwell_s * 1000)
        self._flown: set[str] = set()
        self._airs: dict[str, tuple[int, frozenset[int], float]] = {}
        for name in drones:
            self._control.enter(name, floor.pad(name))

    @property
    def is_outdated(self) -> bool:
        """A drone has another map or pad than before, and all rest: who was told what it flies by begins
        anew."""
        drones = self._drones.values()
        return any(drone.objection for drone in drones) and all(drone.stands for drone in drones)

    @property
    def flown(self) -> frozenset[str]:
        """The drones that traffic flies now."""
        return frozenset(self._flown)

    def ask(self, nodes: Sequence[str], drone: str = "") -> None:
        """Have these nodes visited, by that drone or by whichever.  InputError for one that the floor
        lacks."""
        if unknown := [node for node in nodes if node not in self._floor.lanes.column_of]:
            raise InputError(f"no node is called {unknown[0]}")
        self._queue.ask(
            NodeWork(node.id, node.aisle, i, (), self._dwell_ms, Value.ASKED, drone=drone)
            for i, node in enumerate(self._floor.nodes)
            if node.id in nodes
        )

    def step(self, now_ms: int) -> None:
        """Once round."""
        for name, drone in self._drones.items():
            drone.look()
            refused = drone.refused if name in self._flown else ""
            if not drone.is_ours:
                self._flown.discard(name)
            if name not in self._flown:
                self._lead_back(name, drone, now_ms, refused)
        reports = [self._drones[name].report() for name in sorted(self._flown)]
        commands = self._dispatcher.step(now_ms, reports)
        doubting = {report.drone for report in reports if report.doubt_m > 0.0}
        for name in self._flown:
            paused = name in commands.paused - doubting  # who looks for his place stands by himself
            self._drones[name].fly(commands.base.get(name, ()), now_ms / 1000, paused=paused)

    def _lead_back(self, name: str, drone: FleetDrone, now_ms: int, refused: str) -> None:
        """Keep others out of a drone's air until it rests, and then fly it again."""
        drone.close_air()
        air = drone.closed_air
        if self._airs.get(name) != air:
            self._airs[name] = air
            self._dispatcher.withdraw(name, *air, now_ms, refused)
        drone.call_off(now_ms / 1000)
        drone.drone.may_go_home = self._control.is_clear(name, drone.way_home)
        rests_at = drone.rests_at
        if rests_at is not None and self._dispatcher.readmit(name, rests_at, self._floor.pad(name), now_ms):
            del self._airs[name]
            drone.begin()
            self._flown.add(name)

    def document(self) -> dict[str, Any]:
        """As JSON has it."""
        lanes = self._control.lanes
        return {
            "drones": {
                name: {
                    "flown": name in self._flown,
                    "at": lanes.vertices[course.place].node,
                    "base": [lanes.vertices[action.vertex].node for action in course.base],
                    "waits_for": list(self._control.waits(name)) if name in self._flown else [],
                    "why": "" if name in self._flown else self._drones[name].why,
                }
                for name, course in self._control.drones.items()
            },
        }
