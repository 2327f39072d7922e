"""What a fleet is given and sent back for: by what its batteries last for, on the ways that are open."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import pytest

from flightd.fleet.traffic.closures import Closure
from flightd.fleet.traffic.dispatcher import Dispatcher, DroneReport
from flightd.fleet.traffic.distances import Distances
from flightd.fleet.traffic.dock_queue import DockQueue, Standing
from flightd.fleet.traffic.docks import Dock, DockKind
from flightd.fleet.traffic.endurance import Endurance
from flightd.fleet.traffic.open_ways import OpenWays
from flightd.fleet.traffic.traffic_control import TrafficControl
from flightd.fleet.traffic.work_queue import NodeWork, WorkQueue
from tests.unit.fleet.test_traffic_control import Floor
from tests.unit.fleet.traffic_rig import CELL, PACE, SmallHall

FULL_S = 1500.0


def work(*nodes: str, dwell_ms: int = 5_000) -> WorkQueue:
    return WorkQueue(NodeWork(node, node[0], i, (node,), dwell_ms) for i, node in enumerate(nodes))


def charge_for(left_s: float) -> float:
    """The charge of a drone that may fly so long still."""
    return Endurance().reserve + left_s / FULL_S


class Steps:
    """A dispatcher a second at a time, by drones that do an action in each, or `wait`."""

    def __init__(self, dispatcher: Dispatcher) -> None:
        self.dispatcher = dispatcher
        self.grounded = ""
        """Nobody may send this one anywhere."""
        self.now_ms = 0

    def go(self, charges: Mapping[str, float], *, wait: bool = False) -> None:
        reports = []
        for drone, charge in charges.items():
            course = self.dispatcher.control.drones[drone]
            done = course.done + (bool(course.base) and not wait)
            reports.append(DroneReport(drone, done, charge, may_start=drone != self.grounded))
        self.now_ms += 1000
        self.dispatcher.step(self.now_ms, reports)

    def all(self, seconds: int, charges: Mapping[str, float], *, wait: bool = False) -> None:
        for _ in range(seconds):
            self.go(charges, wait=wait)


def test_who_does_not_come_home_round_what_is_closed_counts_no_more() -> None:
    floor = Floor(1)
    steps = Steps(Dispatcher(floor.control, work("A4", "A5"), Endurance(FULL_S)))
    course = floor.control.drones["d0"]
    while floor.at("d0") != "A4":
        steps.go({"d0": 1.0})
    short_way_s = 105.0
    steps.all(16, {"d0": charge_for(short_way_s)}, wait=True)
    assert course.stops, "its battery lasts by the way it came"
    west = Closure("west", (("A1", "A2"), ("A2", "A3")), "the near end of aisle A is closed")
    steps.dispatcher.close([west], steps.now_ms)
    assert course.stops, "there is another way"
    steps.go({"d0": charge_for(short_way_s)}, wait=True)
    assert course.stops == ()


def test_who_waits_too_long_on_its_way_to_a_dock_goes_home_instead() -> None:
    hall = SmallHall(3, 6, 2)
    home, dock = hall.lanes.pads
    control = TrafficControl(hall.lanes, PACE, CELL)
    control.enter("d0", home)
    docks = (Dock("D", dock, DockKind.CONTACT, 1800.0),)
    steps = Steps(Dispatcher(control, work("A3"), Endurance(FULL_S), docks=docks, keep_home=True))
    steps.go({"d0": 1.0})
    while not steps.dispatcher.docks.holders:
        steps.go({"d0": 0.6})
    assert [*control.drones["d0"].ends] == [dock, home]
    steps.all(20, {"d0": charge_for(60.0)}, wait=True)
    assert [*control.drones["d0"].ends] == [home]
    assert "d0 turns back on its way to dock D: its battery would not last" in steps.dispatcher.docks.told
    steps.all(60, {"d0": charge_for(60.0)})
    assert control.drones["d0"].place == home


@pytest.mark.parametrize("cut_off", [False, True])
def test_a_dock_that_who_is_charged_does_not_leave_is_not_waited_for_while_another_one_is_free(
    cut_off: bool,
) -> None:
    hall = SmallHall(3, 6, 4)
    pads = {hall.lanes.vertices[pad].node: pad for pad in hall.lanes.pads}
    control = TrafficControl(hall.lanes, replace(PACE, speed_mps=0.2), CELL)
    control.enter("d0", pads["DAA10"], ends=(pads["DAA1"],))
    control.enter("d1", pads["DAB10"])
    docks = [Dock(node, pads[node], DockKind.CONTACT, 1800.0) for node in ("DAA10", "DAB1")]
    queue = work("A6")
    steps = Steps(Dispatcher(control, queue, Endurance(FULL_S), docks=docks, keep_home=True))
    if cut_off:
        steps.dispatcher.close([Closure("spur", (("DAA1", "DAA2"),), "the spur is closed")], 0)
    else:
        steps.grounded = "d0"
    while not queue.done:
        steps.go({"d0": 1.0, "d1": 1.0})
    steps.all(20, {"d0": 1.0, "d1": 0.85}, wait=True)
    assert steps.dispatcher.docks.holders == {"DAA10": "d0", "DAB1": "d1"}


def test_who_is_cut_off_from_home_has_the_dock_that_it_flies_to_however_long_it_waits_on_its_way() -> None:
    hall = SmallHall(3, 6, 4)
    pads = {hall.lanes.vertices[pad].node: pad for pad in hall.lanes.pads}
    control = TrafficControl(hall.lanes, PACE, CELL)
    control.enter("d0", hall.lanes.over("A5"), ends=(pads["DAA1"],))
    control.enter("d1", hall.lanes.over("A3"), ends=(pads["DAB1"],))
    for name, way in (("spur", ("DAA1", "DAA2")), ("aisle", ("A6", "A7"))):
        control.close(name, hall.lanes.lanes_between([way]), 0)
    assert control.give("d1", [hall.stop("A3", 600_000)], (pads["DAB1"],), 0)
    dock = Dock("D", pads["DAA10"], DockKind.CONTACT, 1800.0)
    ways = Distances(control.net), OpenWays(control)
    queue = DockQueue(control, *ways, [dock], 0.9, returns=True)
    queue.step(1000, {"d0": Standing(0.3, None)}, {"d0": 300_000})
    assert control.drones["d0"].ahead[-1].vertex == dock.place, "nowhere else is better"
    assert queue.holders == {"D": "d0"}


def test_what_no_battery_lasts_for_is_told_once_all_were_ready_and_tried_with_a_fuller_one() -> None:
    floor = Floor(2)
    queue = work("C4", dwell_ms=790_000)
    steps = Steps(Dispatcher(floor.control, queue, Endurance(FULL_S)))
    steps.all(90, {"d0": 0.92, "d1": 0.5})
    assert not queue.reasons, "the other one is not ready yet"
    steps.all(90, {"d0": 0.92, "d1": 0.92})
    assert (queue.open, queue.reasons) == ((), {"C4": "no battery reaches it"})
    steps.all(5, {"d0": 0.92, "d1": 1.0})
    assert queue.given == {"C4": "d1"}


def test_work_that_names_a_drone_is_told_as_that_one_alone_cannot_do_it() -> None:
    floor = Floor(2)
    queue = WorkQueue([NodeWork("C4", "C", 0, (), 790_000, drone="d0")])
    steps = Steps(Dispatcher(floor.control, queue, Endurance(FULL_S)))
    steps.all(90, {"d0": 0.92, "d1": 1.0})
    assert queue.reasons == {"C4": "no battery reaches it"}
