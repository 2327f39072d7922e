"""Flies a fleet through its hours: the world, the dispatcher between cuts of the links, and the judge."""

from __future__ import annotations

import itertools
import random
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Final

from flightd.fleet.traffic.cells import CellSize
from flightd.fleet.traffic.closures import Closure
from flightd.fleet.traffic.dispatcher import DroneReport
from flightd.fleet.traffic.dock_queue import docks_of
from flightd.fleet.traffic.docks import Dock
from flightd.fleet.traffic.endurance import Endurance
from flightd.fleet.traffic.lanes import LaneGraph, lanes_of
from flightd.fleet.traffic.work_queue import NodeWork, WorkQueue
from flightd.mission.plan.leg_times import Pace
from flightd.sim.fleet.hall import fleet_hall
from flightd.sim.fleet.hub import FleetFloorPlan, FleetHub
from flightd.sim.fleet.judge import FleetJudge, fault_document
from flightd.sim.fleet.world import FleetWorld, Unknowns
from flightd.site.shelf_cells import by_node
from flightd.site.site import Site

PACE: Final = Pace(
    height_m=1.5,
    climb_mps=0.5,
    climb_accel_mps2=0.5,
    speed_mps=1.0,
    accel_mps2=0.8,
    turn_rate_radps=0.8,
    turn_accel_radps2=1.5,
    settle_s=0.4,
    dwell_s=3.0,
    take_off_s=4.0,
    land_s=5.0,
)
_PLACE_S: Final = 2.5
_STEP_S: Final = 0.25
_HUB_STEPS: Final = 2


@dataclass(frozen=True, slots=True)
class FleetScenario:
    """What is flown.  `failing` drones fail between shelves after they counted for a time within `fails_s`,
    each after a while of its own; one aisle is closed from `closed_from` to `closed_to`, shares of the
    hours.  Of the docks, if there are any, `swaps` swap a battery in `swap_s`, and `contacts` charge it; a
    share `misaligned` of the landings on these finds no contact.  The hub is killed and away for a while, and
    all links are cut at once, as by a broker that dies; both so often an hour."""

    drones: int = 10
    aisles: int = 40
    nodes: int = 48
    hours: float = 8.0
    seed: int = 1
    failing: int = 2
    fails_s: tuple[float, float] = (600.0, 2400.0)
    closed_from: float = 0.05
    closed_to: float = 0.15
    closes_aisle: bool = True
    swaps: int = 0
    contacts: int = 0
    swap_s: float = 90.0
    misaligned: float = 0.1
    hub_kills_per_h: float = 2.0
    hub_away_s: float = 30.0
    broker_kills_per_h: float = 2.0
    broker_away_s: float = 30.0
    unknowns: Unknowns = field(default_factory=Unknowns)
    endurance: Endurance = field(default_factory=Endurance)
    cell: CellSize = field(default_factory=CellSize)


@dataclass(frozen=True, slots=True)
class FleetResult:
    """What came of it."""

    scenario: FleetScenario
    judge: FleetJudge
    places: int
    counted: int
    reasons: Mapping[str, str]
    end_s: float
    flown_s: float
    least_charge: float
    failed: tuple[str, ...]
    replans: int
    hub_kills: int
    broker_kills: int
    docks: Mapping[str, Any]

    @property
    def good(self) -> bool:
        """Nothing was wrong."""
        return not self.judge.faults

    @property
    def places_per_hour(self) -> float:
        """Of the whole fleet, until the last place was counted."""
        return self.counted / max(self.end_s / 3600.0, 1e-9)

    def document(self) -> dict[str, Any]:
        """As JSON has it."""
        s, judge = self.scenario, self.judge
        return {
            "verdict": "good" if self.good else "bad",
            "drones": s.drones,
            "aisles": s.aisles,
            "hours": s.hours,
            "seed": s.seed,
            "places": self.places,
            "counted": self.counted,
            "not_counted": dict(self.reasons),
            "places_per_hour": round(self.places_per_hour, 1),
            "end_s": round(self.end_s, 1),
            "flown_s": round(self.flown_s, 1),
            "shared_cells": judge.count("shared_cell"),
            "deadlocks": judge.count("deadlock"),
            "below_reserve": judge.count("below_reserve"),
            "unanswered": judge.count("unanswered"),
            "least_distance_m": round(judge.least_m, 3) if judge.least_m < 1e9 else None,
            "least_charge": round(self.least_charge, 3),
            "failed": list(self.failed),
            "hub_kills": self.hub_kills,
            "broker_kills": self.broker_kills,
            "replans": self.replans,
            **self.docks,
            "faults": [fault_document(fault) for fault in judge.faults],
        }


def work_of(site: Site) -> list[NodeWork]:
    """Every node with places."""
    return [
        NodeWork(
            node,
            site.nodes[node].aisle,
            site.nodes[node].index,
            tuple(location.code for location in locations),
            int(len(locations) * _PLACE_S * 1000),
        )
        for node, locations in by_node(site.locations.values()).items()
    ]


class FleetSimulation:
    """One scenario, step by step."""

    def __init__(self, scenario: FleetScenario, site: Site | None = None) -> None:
        self.scenario = scenario
        pads = scenario.drones + scenario.swaps + scenario.contacts
        self.site = site or fleet_hall(scenario.aisles, scenario.nodes, pads)
        self.lanes: LaneGraph = lanes_of(self.site)
        e = scenario.endurance
        homes, self.docks = shared_out(self.lanes, scenario)
        self.world = FleetWorld(
            self.lanes,
            PACE,
            scenario.unknowns,
            1 / e.flight_s,
            1 / e.charge_s,
            self.docks,
            scenario.misaligned,
        )
        self.judge = FleetJudge(scenario.cell, e.reserve)
        rng = random.Random(f"fleet {scenario.seed}")
        pads_of: dict[str, int] = {}
        for i, pad in enumerate(homes, start=1):
            drone = self.world.add(f"drone-{i}", pad, f"{scenario.seed} {i}")
            pads_of[drone.name] = pad
        self._plan = FleetFloorPlan(self.lanes, PACE, scenario.cell, e, pads_of, self.docks)
        self._hub: FleetHub | None = FleetHub(self._plan, WorkQueue(work_of(self.site)))
        self._hubs = [self._hub]
        self._kept = self._hub.keep()
        self._away_until_s = 0.0
        self._broker_kills = 0
        self._kills = random.Random(f"kills {scenario.seed}")
        for name in rng.sample(sorted(self.world.drones), min(scenario.failing, scenario.drones)):
            self.world.drones[name].fails_after_s = rng.uniform(*scenario.fails_s)
        aisle = rng.choice([aisle for aisle in self.site.aisles if aisle.shelves])
        nodes = [node.id for node in self.site.aisle_nodes(aisle.id)][1:-1]
        self.closed_aisle = aisle.id
        why = f"aisle {aisle.id} is closed"
        self._closure = Closure(aisle.id, tuple(itertools.pairwise(nodes)), why)
        self.now_s = 0.0

    @property
    def queue(self) -> WorkQueue:
        """Of the hub that lives, or lived last."""
        return self._hubs[-1].queue

    def run(self) -> FleetResult:
        """To the end of the hours, or of the work."""
        s = self.scenario
        end_s = s.hours * 3600.0
        steps, at_s, last_s = 0, 0.0, 0.0
        done = 0
        closes = [s.closed_from * end_s, s.closed_to * end_s] if s.closes_aisle else []
        while at_s < end_s:
            if steps % _HUB_STEPS == 0 and (hub := self._hub or self._started(at_s)) is not None:
                if closes and at_s >= closes[0]:
                    closes.pop(0)
                    hub.close([self._closure] if closes else [], int(at_s * 1000))
                self._step(hub, at_s)
                if len(self.queue.done) > done:
                    done, last_s = len(self.queue.done), at_s
            self._kill_broker()
            self.world.step(_STEP_S)
            steps += 1
            at_s = self.now_s = steps * _STEP_S
            drones = list(self.world.drones.values())
            self.judge.see(at_s, drones, work_left=self._hubs[-1].has_work)
            left = self.queue.open or self.queue.given or closes or self._hub is None
            if not left and not any(self.world.flies(drone) for drone in drones):
                break
        return self._result(at_s, last_s)

    def _started(self, at_s: float) -> FleetHub | None:
        """A new hub, once the old one was away for long enough."""
        if at_s < self._away_until_s:
            return None
        self._hub = FleetHub.again(self._plan, self._kept, int(at_s * 1000))
        self._hubs.append(self._hub)
        return self._hub

    def _step(self, hub: FleetHub, at_s: float) -> None:
        """What was decided is kept first (here only where it is needed), then told; of the hubs that are
        killed, half are between these."""
        linked = [drone for drone in self.world.drones.values() if drone.cut_s <= 0.0]
        reports = [
            DroneReport(
                drone.name, drone.done, drone.charge, drone.doubt_m, drone.failed, charging=drone.charging
            )
            for drone in linked
        ]
        told = hub.step(int(at_s * 1000), reports)
        dies = self._kills.random() < self.scenario.hub_kills_per_h * _STEP_S * _HUB_STEPS / 3600.0
        if dies:
            self._hub, self._kept = None, hub.keep()
            self._away_until_s = at_s + self._kills.expovariate(1 / self.scenario.hub_away_s)
        if dies and self._kills.random() < 0.5:
            return
        for drone in linked:
            one = told[drone.name]
            self.world.tell(drone.name, one.first, one.base, paused=one.paused)

    def _kill_broker(self) -> None:
        """Cut all links at once."""
        if self._kills.random() < self.scenario.broker_kills_per_h * _STEP_S / 3600.0:
            self._broker_kills += 1
            away_s = self._kills.expovariate(1 / self.scenario.broker_away_s)
            for drone in self.world.drones.values():
                drone.cut_s = max(drone.cut_s, away_s)

    def _result(self, at_s: float, last_s: float) -> FleetResult:
        places = {node: len(self.queue.work(node).places) for node in self._nodes()}
        reasons = dict(self.queue.reasons)
        left = (*self.queue.open, *self.queue.given)
        late = at_s >= self.scenario.hours * 3600.0
        flying = [drone for drone in self.world.drones.values() if not drone.failed]
        for node in left:
            if late:
                reasons[node] = "the hours are over"
            elif not flying:
                reasons[node] = "no drone is left"
        unanswered = [node for node in places if node not in reasons and node not in set(self.queue.done)]
        self.judge.end(at_s, unanswered)
        drones = self.world.drones.values()
        return FleetResult(
            self.scenario,
            self.judge,
            sum(places.values()),
            sum(places[node] for node in self.queue.done),
            reasons,
            at_s if left else last_s,
            sum(drone.flown_s for drone in drones),
            min((drone.least_charge for drone in drones if not drone.failed), default=1.0),
            tuple(drone.name for drone in drones if drone.failed),
            sum(hub.control.replans for hub in self._hubs),
            len(self._hubs) - 1,
            self._broker_kills,
            self._docks_document(),
        )

    def _docks_document(self) -> dict[str, Any]:
        """What came of the docks; empty without any."""
        if not self.docks:
            return {}
        landings = {dock.name: self.world.landings.get(dock.name, (0, 0)) for dock in self.docks}
        queues = [hub.dispatcher.docks for hub in self._hubs]
        return {
            "docks": [
                {
                    "dock": dock.name,
                    "kind": dock.kind.value,
                    "landings": landings[dock.name][0],
                    "without_contact": landings[dock.name][1],
                }
                for dock in self.docks
            ],
            "waited_for_docks_s": round(sum(queue.waited_ms for queue in queues) / 1000, 1),
            "docks_told_count": sum(queue.told_count for queue in queues),
            "docks_told": [line for queue in queues for line in queue.told],
        }

    def _nodes(self) -> list[str]:
        return [work.node for work in work_of(self.site)]


def shared_out(lanes: LaneGraph, scenario: FleetScenario) -> tuple[list[int], tuple[Dock, ...]]:
    """The drones' own pads, and the docks, spread evenly among them."""
    pads, count = list(lanes.pads), scenario.swaps + scenario.contacts
    total = scenario.drones + count
    at = {(2 * i + 1) * total // (2 * count) for i in range(count)}
    docks = [(lanes.vertices[pads[i]].pad or "", pads[i]) for i in sorted(at)]
    homes = [pad for i, pad in enumerate(pads[:total]) if i not in at]
    return homes, docks_of(docks, scenario.swaps, scenario.swap_s, scenario.endurance.charge_s)


def fly_fleet(scenario: FleetScenario) -> FleetResult:
    """Fly it."""
    return FleetSimulation(scenario).run()


def alone(scenario: FleetScenario) -> FleetScenario:
    """The same hall and hours for one drone that nothing happens to but its own pace: what a fleet is
    compared with."""
    return replace(
        scenario, drones=1, failing=0, closes_aisle=False, hub_kills_per_h=0.0, broker_kills_per_h=0.0
    )
