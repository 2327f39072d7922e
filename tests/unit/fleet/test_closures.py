"""What people close to a fleet: who is in it leaves, and enters nothing else that is closed."""

from __future__ import annotations

import pytest

from flightd.fleet.traffic.closures import ClosedAir, Closure
from flightd.fleet.traffic.dispatcher import Dispatcher, DroneReport
from flightd.fleet.traffic.endurance import Endurance
from flightd.fleet.traffic.work_queue import NodeWork, WorkQueue
from tests.unit.fleet.test_traffic_control import Floor

BY_A = tuple((f"A{i}", f"A{i + 1}") for i in range(2, 7))


def names(floor: Floor, vertices: frozenset[int]) -> set[str]:
    return {floor.lanes.vertices[vertex].name for vertex in vertices}


def test_a_zone_has_what_lies_within_it_and_not_its_ends() -> None:
    floor = Floor()
    zone = ClosedAir(floor.lanes).close("A", floor.lanes.lanes_between(BY_A))
    vertices = frozenset(resource for resource in zone if resource < len(floor.lanes.vertices))
    assert names(floor, vertices) == {"A3", "A4", "A5", "A6"}
    assert {floor.lanes.column_of[f"A{i}"] for i in (3, 4, 5, 6)} <= zone


def test_two_halves_that_are_closed_one_by_one_have_the_node_between_them_until_one_is_open() -> None:
    floor = Floor()
    air, between = ClosedAir(floor.lanes), floor.lanes.over("A4")
    assert between not in air.close("near", floor.lanes.lanes_between(BY_A[:2]))
    assert {between, floor.lanes.column_of["A4"]} <= air.close("far", floor.lanes.lanes_between(BY_A[2:]))
    assert all(between in zone for zone in air.zones)
    assert air.within({"d0": [between]}) == {"near": ("d0",), "far": ("d0",)}
    air.open("near")
    assert between not in air.air


def test_who_is_in_one_closed_way_does_not_leave_through_another_one() -> None:
    floor = Floor(4)
    control = floor.control
    assert floor.give("d0", "A5")
    floor.until("d0", "A5")
    assert control.close("near its pad", floor.lanes.lanes_between([("A2", "A3")]), floor.now_ms) == ()
    assert control.close("where it is", floor.lanes.lanes_between(BY_A[2:]), floor.now_ms) == ()
    assert control.inside() == {"near its pad": (), "where it is": ("d0",)}
    way = {floor.lanes.vertices[action.vertex].name for action in control.drones["d0"].ahead}
    assert "A7" in way
    assert "A2" not in way
    floor.run()
    assert floor.at("d0") == "pad P1"
    assert control.inside() == {"near its pad": (), "where it is": ()}


@pytest.mark.parametrize(("at", "by"), [("A3", "A2"), ("A4", "A2"), ("A5", "A7"), ("A6", "A7")])
def test_who_is_in_a_closed_aisle_leaves_by_the_nearer_end_wherever_it_lives(at: str, by: str) -> None:
    floor = Floor(4)
    assert floor.give("d0", at)
    floor.until("d0", at)
    assert floor.control.close("A", floor.lanes.lanes_between(BY_A), floor.now_ms) == ()
    way = [floor.lanes.vertices[action.vertex].name for action in floor.control.drones["d0"].ahead]
    assert by in way
    assert {"A2", "A7"} - {by} - set(way), "it does not pass the whole aisle"
    floor.run()
    assert floor.at("d0") == "pad P1"


def test_who_leaves_what_is_closed_is_not_cut_off_but_by_something_else_that_is() -> None:
    floor = Floor(4)
    control = floor.control
    assert floor.give("d0", "A4")
    floor.until("d0", "A4")
    control.close("A", floor.lanes.lanes_between(BY_A), floor.now_ms)
    assert not control.is_cut_off("d0")
    control.close("its pad", floor.lanes.lanes_between([("DAA1", "DAA2")]), floor.now_ms)
    assert control.is_cut_off("d0")
    control.open("its pad")
    assert not control.is_cut_off("d0")


def test_who_finds_the_nearer_end_taken_leaves_by_the_other_one() -> None:
    floor = Floor(4)
    assert floor.control.give("d1", (), [floor.lanes.over("A2")], 0)
    floor.run()
    assert floor.control.fail("d1", floor.now_ms) == ()
    assert floor.give("d0", "A4")
    floor.until("d0", "A4")
    assert floor.control.close("A", floor.lanes.lanes_between(BY_A), floor.now_ms) == ()
    floor.run()
    assert floor.at("d0") == "pad P1"


def test_a_way_home_leads_through_what_is_closed_only_for_who_is_in_it() -> None:
    floor = Floor()
    control = floor.control
    lanes = floor.lanes.lanes_between(BY_A)
    control.close("A", lanes, 0)
    assert not control.is_clear("d0", lanes)
    assert not control.is_clear("d0", lanes, [floor.lanes.over("A2")])
    assert control.is_clear("d0", lanes, [floor.lanes.over("A4")])


def test_what_waits_in_what_is_closed_is_held_back_until_it_is_open() -> None:
    floor = Floor(1)
    work = [NodeWork(node, node[0], i, (node,), 5_000) for i, node in enumerate(("A4", "B4"))]
    queue = WorkQueue(work)
    dispatcher = Dispatcher(floor.control, queue, Endurance())
    dispatcher.close([Closure("A", BY_A, "aisle A is closed")], 0)
    assert dispatcher.held_back() == {"A4": "aisle A is closed"}
    dispatcher.step(0, [DroneReport("d0", 0, 1.0)])
    assert queue.given == {"B4": "d0"}
    dispatcher.close([], 1_000)
    assert (dispatcher.held_back(), queue.open) == ({}, ("A4",))
