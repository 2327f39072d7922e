"""The drones of the fleet world as they truly are: pace, errors, batteries, failures.

Each flies the base that it has, stops at its end, and tells what it has done as long as its link works.  What
is drawn here reaches the judge, never the planner.
"""

from __future__ import annotations

import math
import random
from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Final

from flightd.fleet.traffic.docks import Dock, DockKind
from flightd.fleet.traffic.lanes import LaneGraph
from flightd.fleet.traffic.motions import Act
from flightd.fleet.traffic.plan import Action
from flightd.mission.plan.leg_times import Pace

_ERROR_TIME_S: Final = 8.0
_LAND_MPS: Final = 0.5


@dataclass(frozen=True, slots=True)
class Unknowns:
    """How far the drones are from what is planned, per flying hour and drone; `error_m` is the most that a
    position is off while nobody doubts it."""

    pace_sigma: float = 0.08
    slow_per_h: float = 2.0
    slow_factor: float = 0.4
    slow_s: float = 40.0
    link_cuts_per_h: float = 3.0
    link_cut_s: float = 30.0
    doubts_per_h: float = 1.0
    doubt_s: float = 25.0
    doubt_m: float = 1.0
    error_m: float = 0.3


@dataclass(slots=True)
class FleetDrone:
    """One drone; `fails_at_s` is how long it flies between shelves until it fails, infinite for one that does
    not."""

    name: str
    place: int
    rng: random.Random
    base: deque[Action] = field(default_factory=deque)
    done: int = 0
    charge: float = 1.0
    along_m: float = 0.0
    speed_mps: float = 0.0
    timer_s: float = 0.0
    factor: float = 1.0
    slow_s: float = 0.0
    cut_s: float = 0.0
    doubt_s: float = 0.0
    doubt_m: float = 0.0
    paused: bool = False
    failed: bool = False
    fails_after_s: float = math.inf
    charging: bool = False
    contact: bool = False
    swap_left_s: float = 0.0
    in_aisle_s: float = 0.0
    error_m: tuple[float, float] = (0.0, 0.0)
    x_m: float = 0.0
    y_m: float = 0.0
    z_m: float = 0.0
    least_charge: float = 1.0
    flown_s: float = 0.0


class FleetWorld:
    """Steps all drones; `draw_frac_per_s` of a battery is drawn in the air, `charge_frac_per_s` comes back
    on a pad.  Where there are `docks`, it comes back there alone, as each of them fills it; a share
    `misaligned` of landings on one with contacts finds none.  `landings` counts those on each, and those that
    found none."""

    def __init__(
        self,
        lanes: LaneGraph,
        pace: Pace,
        unknowns: Unknowns,
        draw_frac_per_s: float,
        charge_frac_per_s: float,
        docks: Iterable[Dock] = (),
        misaligned: float = 0.0,
    ) -> None:
        self._lanes = lanes
        self._pace = pace
        self._unknowns = unknowns
        self._draw = draw_frac_per_s
        self._fill = charge_frac_per_s
        self._docks = {dock.place: dock for dock in docks}
        self._misaligned = misaligned
        self.landings: dict[str, tuple[int, int]] = {}
        self.drones: dict[str, FleetDrone] = {}

    def add(self, name: str, place: int, seed: str) -> FleetDrone:
        """A drone on its pad."""
        drone = self.drones[name] = FleetDrone(name, place, random.Random(seed))
        self._locate(drone)
        return drone

    def tell(self, name: str, first: int, actions: Sequence[Action], *, paused: bool) -> None:
        """What the link brings: actions of which the first is number `first` of the drone's life.  What it
        has of these it does not take twice."""
        drone = self.drones[name]
        known = drone.done + len(drone.base)
        drone.base.extend(actions[max(known - first, 0) :])
        drone.paused = paused

    def step(self, dt_s: float) -> None:
        """All drones, one after the other."""
        for drone in self.drones.values():
            self._step(drone, dt_s)

    def flies(self, drone: FleetDrone) -> bool:
        """In the air."""
        return not drone.failed and (bool(drone.base) or self._lanes.vertices[drone.place].pad is None)

    def _step(self, drone: FleetDrone, dt_s: float) -> None:
        if drone.failed:
            drone.z_m = max(drone.z_m - _LAND_MPS * dt_s, 0.0)
            return
        if not self.flies(drone):
            self._stand(drone, dt_s)
            drone.cut_s = max(drone.cut_s - dt_s, 0.0)
            return
        drone.charging = False
        drone.charge -= self._draw * dt_s
        drone.flown_s += dt_s
        drone.least_charge = min(drone.least_charge, drone.charge)
        self._trouble(drone, dt_s)
        if not drone.failed:
            self._move(drone, dt_s)
        self._locate(drone)

    def _stand(self, drone: FleetDrone, dt_s: float) -> None:
        """On a pad, which it sees: nobody there is in doubt where it is."""
        drone.doubt_s = drone.doubt_m = 0.0
        dock = self._docks.get(drone.place)
        if dock is None:
            drone.charging = not self._docks
            fill = self._fill if drone.charging else 0.0
            drone.charge = min(drone.charge + fill * dt_s, 1.0)
        elif dock.kind is DockKind.CONTACT:
            drone.charging = drone.contact and drone.charge < 1.0
            drone.charge = min(drone.charge + (dt_s / dock.full_s if drone.contact else 0.0), 1.0)
        else:
            drone.charging = True
            drone.swap_left_s -= dt_s
            drone.charge = drone.charge if drone.swap_left_s > 0.0 else 1.0

    def _land(self, drone: FleetDrone, dock: Dock) -> None:
        drone.contact = dock.kind is DockKind.SWAP or drone.rng.random() >= self._misaligned
        drone.swap_left_s = dock.full_s
        landings, missed = self.landings.get(dock.name, (0, 0))
        self.landings[dock.name] = landings + 1, missed + (not drone.contact)

    def _trouble(self, drone: FleetDrone, dt_s: float) -> None:
        u, rng = self._unknowns, drone.rng
        hour = dt_s / 3600.0
        drone.slow_s = max(drone.slow_s - dt_s, 0.0)
        drone.cut_s = max(drone.cut_s - dt_s, 0.0)
        drone.doubt_s = max(drone.doubt_s - dt_s, 0.0)
        if rng.random() < u.slow_per_h * hour:
            drone.slow_s = rng.expovariate(1 / u.slow_s)
        if rng.random() < u.link_cuts_per_h * hour:
            drone.cut_s = rng.expovariate(1 / u.link_cut_s)
        if rng.random() < u.doubts_per_h * hour:
            drone.doubt_s = rng.expovariate(1 / u.doubt_s)
        drone.doubt_m = u.doubt_m if drone.doubt_s > 0.0 else 0.0
        self._err(drone, dt_s)
        if drone.base and drone.base[0].act is Act.COUNT:
            drone.in_aisle_s += dt_s
            drone.failed = drone.in_aisle_s >= drone.fails_after_s

    def _err(self, drone: FleetDrone, dt_s: float) -> None:
        """A position error that wanders within what the cell allows for; in doubt as far as the doubt
        says."""
        most_m = self._unknowns.error_m + drone.doubt_m
        pull = dt_s / _ERROR_TIME_S
        kick = most_m * math.sqrt(pull)
        x, y = (value * (1 - pull) + drone.rng.gauss(0.0, kick) for value in drone.error_m)
        size = math.hypot(x, y)
        scale = min(1.0, most_m / size) if size else 1.0
        drone.error_m = (x * scale, y * scale)

    def _move(self, drone: FleetDrone, dt_s: float) -> None:
        """One step along the base."""
        if not drone.base:
            drone.speed_mps = 0.0
            return
        action = drone.base[0]
        stops = drone.paused or drone.doubt_s > 0.0
        if action.act is not Act.FLY:
            if not stops or drone.timer_s > 0.0:
                self._wait(drone, action, dt_s)
            return
        if drone.timer_s > 0.0:  # settles at the end of a run
            self._wait(drone, action, dt_s)
            return
        self._fly(drone, dt_s, stops=stops)

    def _wait(self, drone: FleetDrone, action: Action, dt_s: float) -> None:
        if drone.timer_s <= 0.0:
            drone.factor = math.exp(drone.rng.gauss(0.0, self._unknowns.pace_sigma))
            drone.timer_s = action.duration_ms / 1000 * drone.factor
        drone.timer_s -= dt_s
        if drone.timer_s <= 0.0:
            self._finish(drone)

    def _fly(self, drone: FleetDrone, dt_s: float, *, stops: bool) -> None:
        p = self._pace
        slow = self._unknowns.slow_factor if drone.slow_s > 0.0 else 1.0
        left_m = self._run_left_m(drone.base) - drone.along_m
        top_mps = 0.0 if stops else min(p.speed_mps * slow, math.sqrt(2 * p.accel_mps2 * max(left_m, 0.0)))
        change = p.accel_mps2 * dt_s
        drone.speed_mps = min(max(top_mps, drone.speed_mps - change), drone.speed_mps + change)
        if not stops and left_m < 0.05:
            drone.speed_mps = max(drone.speed_mps, 0.05)
        drone.along_m += min(drone.speed_mps * dt_s, max(left_m, 0.0))
        while drone.base and drone.base[0].act is Act.FLY:
            length_m = self._length_m(drone.base[0])
            if len(drone.base) == 1 or not _goes_on(drone.base[0], drone.base[1]):
                if drone.along_m >= length_m - 0.01:
                    drone.along_m, drone.speed_mps = length_m, 0.0
                    drone.timer_s = p.settle_s + dt_s
                return
            if drone.along_m < length_m:
                return
            drone.along_m -= length_m
            self._finish(drone, keeps=True)

    def _run_left_m(self, base: Sequence[Action]) -> float:
        """From the start of the first lane to where the drone has to stand."""
        metres = 0.0
        for i, action in enumerate(base):
            metres += self._length_m(action)
            if i + 1 == len(base) or not _goes_on(action, base[i + 1]) or metres > 6.0:
                break
        return metres

    def _length_m(self, action: Action) -> float:
        return self._lanes.lanes[action.resource - len(self._lanes.vertices)].length_m

    def _finish(self, drone: FleetDrone, *, keeps: bool = False) -> None:
        action = drone.base.popleft()
        drone.place = action.vertex
        drone.done += 1
        drone.timer_s = 0.0
        if dock := self._docks.get(drone.place):
            self._land(drone, dock)
        if not keeps:
            drone.along_m = drone.speed_mps = 0.0

    def _locate(self, drone: FleetDrone) -> None:
        """Where it truly is."""
        vertices = self._lanes.vertices
        here = vertices[drone.place]
        there, part = here, 0.0
        if drone.base:
            action = drone.base[0]
            there = vertices[action.vertex]
            if action.act is Act.FLY:
                part = drone.along_m / self._length_m(action)
            elif drone.timer_s > 0.0 and action.vertex != drone.place:
                part = 1.0 - drone.timer_s / (action.duration_ms / 1000 * drone.factor)
        ex, ey = drone.error_m if part or vertices[drone.place].pad is None else (0.0, 0.0)
        drone.x_m = here.x_m + part * (there.x_m - here.x_m) + ex
        drone.y_m = here.y_m + part * (there.y_m - here.y_m) + ey
        drone.z_m = here.height_m + part * (there.height_m - here.height_m)


def _goes_on(action: Action, following: Action) -> bool:
    """Whether the next lane is flown without a stop between."""
    return following.act is Act.FLY and action.moving and action.quarter == following.quarter
