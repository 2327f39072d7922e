"""Small halls, fleets in them, and a checker of plans that shares no code with the planner."""

from __future__ import annotations

import itertools
import random
from collections.abc import Mapping, Sequence

from flightd.fleet.traffic.cells import CellSize, Conflicts, conflicts_of
from flightd.fleet.traffic.lanes import LaneGraph, lanes_of
from flightd.fleet.traffic.motions import MotionNet, at_rest
from flightd.fleet.traffic.plan import Action, Stop
from flightd.fleet.traffic.prioritised import PrioritisedPlanner
from flightd.fleet.traffic.tours import Request
from flightd.fleet.traffic.traffic_control import TrafficControl
from flightd.mission.plan.leg_times import Pace
from flightd.sim.fleet.hall import fleet_hall

PACE = Pace(1.5, 0.5, 0.5, 1.0, 0.8, 0.8, 1.5, 0.4, 3.0, 4.0, 5.0)
CELL = CellSize()
DWELL_MS = 10_000


class SmallHall:
    """A hall with everything that planning needs."""

    def __init__(self, aisles: int = 3, nodes: int = 4, drones: int = 4) -> None:
        self.site = fleet_hall(aisles, nodes, drones)
        self.lanes: LaneGraph = lanes_of(self.site)
        self.conflicts: Conflicts = conflicts_of(self.lanes, CELL)
        self.net = MotionNet(self.lanes, PACE)
        self.planner = PrioritisedPlanner(self.net, self.conflicts)
        self.shelf_nodes = tuple(node.id for node in self.site.nodes.values() if len(node.aisle) < 3)

    def stop(self, node: str, dwell_ms: int = DWELL_MS) -> Stop:
        return Stop(self.lanes.over(node), self.lanes.column_of[node], dwell_ms)

    def request(self, number: int, nodes: Sequence[str], priority: float = 0.0) -> Request:
        """A drone on its pad, with nodes to count at."""
        pad = self.lanes.pads[number]
        stops = tuple(self.stop(node) for node in nodes)
        return Request(f"drone-{number}", at_rest(pad, 0), 0, stops, (pad,), priority)


def gap(lanes: LaneGraph, a: int, b: int) -> tuple[float, float]:
    """How far two resources are apart across and upwards, one axis after the other."""
    one, two = lanes.boxes[a], lanes.boxes[b]
    dx = max(one.x0_m - two.x1_m, two.x0_m - one.x1_m, 0.0)
    dy = max(one.y0_m - two.y1_m, two.y0_m - one.y1_m, 0.0)
    dz = max(one.z0_m - two.z1_m, two.z0_m - one.z1_m, 0.0)
    return (dx * dx + dy * dy) ** 0.5, dz


def shared_cells(
    lanes: LaneGraph, courses: Mapping[str, tuple[int, Sequence[Action]]], cell: CellSize = CELL
) -> list[tuple[str, str, int]]:
    """(drone, drone, time) of every meeting of plans, each from the vertex on which it begins."""
    taken = {drone: _taken(place, actions) for drone, (place, actions) in courses.items()}
    found = []
    for (a, ones), (b, twos) in itertools.combinations(taken.items(), 2):
        for r, from_ms, to_ms in ones:
            for q, since_ms, until_ms in twos:
                begins = max(from_ms, since_ms)
                if begins < min(to_ms, until_ms):
                    across_m, upright_m = gap(lanes, r, q)
                    if across_m < cell.separation_m - 1e-6 and upright_m < cell.upright_m - 1e-6:
                        found.append((a, b, begins))
    return found


def _taken(place: int, actions: Sequence[Action]) -> list[tuple[int, int, int]]:
    spells = []
    at, since_ms = place, 0
    for action in actions:
        spells += [(at, since_ms, action.start_ms), (action.resource, action.start_ms, action.end_ms)]
        at, since_ms = action.vertex, action.end_ms
    return [*spells, (at, since_ms, 1 << 62)]


def check_air(control: TrafficControl) -> None:
    """No two drones have air that meets, released or taken."""
    for one, two in itertools.combinations(control.drones.values(), 2):
        for r in one.wreck or one.air:
            for q in two.wreck or two.air:
                across_m, upright_m = gap(control.lanes, r, q)
                assert across_m >= CELL.separation_m - 1e-6 or upright_m >= CELL.upright_m - 1e-6


def fly_out(control: TrafficControl, seed: int = 0) -> dict[str, int]:
    """Where all are when nobody has anything ahead that it may do: done in any order, and nobody meets."""
    rng = random.Random(seed)
    for now_ms in itertools.count(step=1000):
        control.release(now_ms)
        check_air(control)
        ready = [drone for drone, course in control.drones.items() if course.base]
        if not ready:
            break
        drone = rng.choice(ready)
        control.done(drone, control.drones[drone].done + 1, now_ms)
    return {drone: course.place for drone, course in control.drones.items()}


def fly_at_pace(control: TrafficControl, anew: Sequence[str], every_ms: int) -> dict[str, int]:
    """The same at the pace that is planned, some being planned `anew` again and again."""
    for now_ms in range(0, 2_000_000, 1000):
        if now_ms % every_ms == 0:
            control.replan(anew, now_ms)
        control.release(now_ms)
        check_air(control)
        for drone, course in control.drones.items():
            if course.base and now_ms >= course.since_ms + course.base[0].duration_ms:
                control.done(drone, course.done + 1, now_ms)
        if not any(course.ahead for course in control.drones.values()):
            return {drone: course.place for drone, course in control.drones.items()}
    raise AssertionError("they never come to rest")
