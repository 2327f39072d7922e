"""What people close to a fleet: who is in it leaves, and enters nothing else that is closed."""

from __future__ import annotations

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
