"""The station of a simulated fleet: it may be killed at any moment, and a new one goes on with what the old
one kept.

As a real one does, it keeps what each drone was released to before it says so.  The new one takes each drone
for flown by somebody else, on all that was released to it, until the drone tells that it is done with that.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import msgspec

from flightd.fleet.traffic.cells import CellSize
from flightd.fleet.traffic.closures import Closure
from flightd.fleet.traffic.dispatcher import Dispatcher, DroneReport
from flightd.fleet.traffic.dock_queue import KeptTries
from flightd.fleet.traffic.docks import Dock
from flightd.fleet.traffic.endurance import Endurance
from flightd.fleet.traffic.lanes import LaneGraph
from flightd.fleet.traffic.motions import Act
from flightd.fleet.traffic.plan import Action
from flightd.fleet.traffic.traffic_control import TrafficControl
from flightd.fleet.traffic.work_queue import KeptWork, WorkQueue
from flightd.mission.plan.leg_times import Pace


@dataclass(frozen=True, slots=True)
class KeptDrone:
    """Where a drone was heard last, how many actions of its life were done there, by how much its position
    was doubted, and what is released to it beyond; where it may be for good, if it has failed."""

    place: int
    done: int
    doubt_m: float
    base: tuple[Action, ...]
    wreck: tuple[int, ...] = ()

    def after(self, done: int) -> tuple[KeptDrone, tuple[Action, ...]]:
        """Once it told that so many are done; which are new of these."""
        new = self.base[: max(done - self.done, 0)]
        place = new[-1].vertex if new else self.place
        return replace(self, place=place, done=self.done + len(new), base=self.base[len(new) :]), new

    @property
    def air(self) -> tuple[int, ...]:
        """All that it may be on, and come to stand on."""
        ahead = (r for action in self.base for r in (action.resource, action.vertex))
        return self.wreck or (self.place, *ahead)


@dataclass(frozen=True, slots=True)
class KeptHub:
    """What outlives a hub."""

    drones: Mapping[str, KeptDrone]
    work: KeptWork
    closed: tuple[Closure, ...]
    docks: Mapping[str, KeptTries]


@dataclass(frozen=True, slots=True)
class Told:
    """What the link brings a drone: all that is released and not known to be done, the first of which is
    number `first` of its life.  `paused`: it stands where it is."""

    first: int
    base: Sequence[Action]
    paused: bool


@dataclass(frozen=True, slots=True)
class FleetFloorPlan:
    """What a hub is configured with; `homes` are the drones' own pads."""

    lanes: LaneGraph
    pace: Pace
    cell: CellSize
    endurance: Endurance
    homes: Mapping[str, int]
    docks: Sequence[Dock] = ()


class FleetHub:
    """`step` it while it lives; `keep` what it knows before anything is told."""

    def __init__(self, plan: FleetFloorPlan, queue: WorkQueue) -> None:
        self._plan = plan
        self.queue = queue
        self.control = TrafficControl(plan.lanes, plan.pace, plan.cell)
        self.dispatcher = Dispatcher(self.control, queue, plan.endurance, docks=plan.docks)
        self._before: dict[str, KeptDrone] = {}
        """What they fly was released by the hub before."""
        self._first: dict[str, int] = {}
        """Actions of its life that were done when this hub took it."""
        self._lost_m: dict[str, float] = {}
        """By how much the places of those are doubted that failed."""
        for drone, pad in plan.homes.items():
            self.control.enter(drone, pad)
            self._first[drone] = 0

    @classmethod
    def again(cls, plan: FleetFloorPlan, kept: bytes, now_ms: int) -> FleetHub:
        """One that goes on with what another one kept."""
        known = msgspec.json.decode(kept, type=KeptHub)
        hub = cls(plan, WorkQueue.of(known.work))
        for drone, one in known.drones.items():
            hub.control.enter(drone, one.place, ends=(plan.homes[drone],))
            hub._before[drone] = one
        for drone, one in known.drones.items():
            hub.dispatcher.withdraw(drone, one.place, one.air, one.doubt_m, now_ms)
        hub.dispatcher.docks.remember(known.docks)
        hub.close(known.closed, now_ms)
        return hub

    def keep(self) -> bytes:
        """What the next one has to know."""
        drones = {drone: self._kept(drone) for drone in self.control.drones}
        docks = self.dispatcher.docks.kept()
        kept = KeptHub(drones, self.queue.kept(), tuple(self.dispatcher.closed.values()), docks)
        return msgspec.json.encode(kept)

    def _kept(self, drone: str) -> KeptDrone:
        if drone in self._before:
            return self._before[drone]
        course = self.control.drones[drone]
        done, doubt_m = self._first[drone] + course.done, self._lost_m.get(drone, course.doubt_m)
        return KeptDrone(course.place, done, doubt_m, tuple(course.base), tuple(course.wreck))

    @property
    def has_work(self) -> bool:
        """Whether drones have something to do that nobody closed to them."""
        return bool(
            self.queue.given or (self.queue.open and {*self.queue.open} - self.dispatcher.held_back().keys())
        )

    def close(self, closures: Iterable[Closure], now_ms: int) -> None:
        """Keep these closed, and nothing else."""
        self.dispatcher.close(closures, now_ms)

    def step(self, now_ms: int, reports: Iterable[DroneReport]) -> dict[str, Told]:
        """What each drone is told; those without a link hear it when they have one."""
        ours: list[DroneReport] = []
        for report in reports:
            if report.drone in self._before and not self._takes(report, now_ms):
                continue
            if report.failed:
                self._lost_m.setdefault(report.drone, report.doubt_m)
            ours.append(replace(report, done=report.done - self._first[report.drone]))
        paused = self.dispatcher.step(now_ms, ours).paused | self._paused_before()
        told: dict[str, Told] = {}
        for drone in self.control.drones:
            kept = self._kept(drone)
            told[drone] = Told(kept.done, kept.base, drone in paused)
        return told

    def _takes(self, report: DroneReport, now_ms: int) -> bool:
        """Hear a drone that flies what was released before; whether it is done with that, and flown on."""
        drone = report.drone
        one, new = self._before[drone].after(report.done)
        was, doubt_m = one.doubt_m, report.doubt_m
        if report.failed:
            one, doubt_m = replace(one, wreck=one.wreck or one.air), max(doubt_m, was)
        self._before[drone] = one = replace(one, doubt_m=doubt_m)
        if doubt_m != was:
            self.dispatcher.withdraw(drone, one.place, one.air, doubt_m, now_ms)
        for action in new:
            if action.act is Act.COUNT:
                self.queue.finish(self._plan.lanes.vertices[action.vertex].node)
        if one.base or one.wreck or one.doubt_m > 0.0:
            return False
        if not self.dispatcher.readmit(drone, one.place, self._plan.homes[drone], now_ms):
            return False
        del self._before[drone]
        self._first[drone] = report.done
        return True

    def _paused_before(self) -> frozenset[str]:
        """Those of them that would fly into the air of one that doubts its position."""
        zones = self.control.closed_by()
        doubted = {drone for drone, course in self.control.drones.items() if course.doubt_m > 0.0}
        doubted |= {drone for drone, one in self._before.items() if one.doubt_m > 0.0}
        return frozenset(
            drone
            for drone, one in self._before.items()
            if any(action.resource in zones[other] for other in doubted - {drone} for action in one.base)
        )
