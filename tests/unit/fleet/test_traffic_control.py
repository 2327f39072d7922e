"""What a fleet does when a drone is late, cut off, in doubt or fails: others are delayed, and never meet
it."""

from __future__ import annotations

import math

import pytest

from flightd.fleet.traffic.lanes import LaneGraph
from flightd.fleet.traffic.motions import Act
from flightd.fleet.traffic.plan import Action
from flightd.fleet.traffic.traffic_control import HORIZON_MS, TrafficControl
from tests.unit.fleet.traffic_rig import CELL, PACE, SmallHall, check_air, gap


class Floor:
    """Drones that do at once what they are released to, unless they are stopped."""

    def __init__(self, drones: int = 2) -> None:
        self.hall = SmallHall(3, 6, drones)
        self.lanes: LaneGraph = self.hall.lanes
        self.control = TrafficControl(self.lanes, PACE, CELL)
        self.told: dict[str, list[Action]] = {}
        self.done: dict[str, int] = {}
        self.now_ms = 0
        self.stopped: set[str] = set()
        self.counted: list[str] = []
        for i, pad in enumerate(self.lanes.pads):
            self.control.enter(f"d{i}", pad)
            self.told[f"d{i}"], self.done[f"d{i}"] = [], 0

    def give(self, drone: str, *nodes: str) -> bool:
        stops = [self.hall.stop(node) for node in nodes]
        return self.control.give(drone, stops, self.control.drones[drone].ends, self.now_ms)

    def step(self) -> bool:
        """Release, and let each drone do one action; whether anything was done."""
        self.now_ms += 5_000
        for drone, actions in self.control.release(self.now_ms).items():
            self.told[drone] += actions
        self.check()
        moved = False
        for drone in sorted(self.told):
            if self.done[drone] < len(self.told[drone]) and drone not in self.stopped:
                if drone in self.control.paused():
                    continue
                self.done[drone] += 1
                moved = True
                for vertex in self.control.done(drone, self.done[drone], self.now_ms):
                    self.counted.append(self.lanes.vertices[vertex].node)
        return moved

    def check(self) -> None:
        check_air(self.control)

    def run(self, steps: int = 400) -> None:
        for _ in range(steps):
            if not self.step():
                break

    def at(self, drone: str) -> str:
        return self.lanes.vertices[self.control.drones[drone].place].name

    def until(self, drone: str, node: str) -> None:
        """Step until a drone is over a node."""
        for _ in range(400):
            if self.at(drone) == node:
                return
            self.step()
        raise AssertionError(f"{drone} never came to {node}")


def test_all_stops_are_visited_and_everybody_is_back_on_its_pad() -> None:
    floor = Floor(4)
    tours = [("A3", "A5"), ("A4",), ("B3", "C4"), ("C3", "B5")]
    for i, nodes in enumerate(tours):
        assert floor.give(f"d{i}", *nodes)
    floor.run()
    assert sorted(floor.counted) == ["A3", "A4", "A5", "B3", "B5", "C3", "C4"]
    assert [floor.at(f"d{i}") for i in range(4)] == [f"pad P{i}" for i in range(1, 5)]


def test_a_base_reaches_no_further_than_the_horizon() -> None:
    floor = Floor()
    floor.give("d0", "A3", "A4", "A5")
    told = floor.control.release(0)["d0"]
    assert sum(action.duration_ms for action in told[:-1]) < HORIZON_MS
    assert sum(action.duration_ms for action in told) >= HORIZON_MS
    assert floor.control.release(0) == {}


def test_a_base_ends_where_the_drone_would_not_come_home_from() -> None:
    floor = Floor()
    floor.give("d0", "A3")
    pad, over_pad = floor.lanes.pads[0], floor.lanes.arcs[floor.lanes.pads[0]][0].to
    asked: list[tuple[int, int]] = []

    def comes_home(_drone: str, vertex: int, after_ms: int) -> bool:
        asked.append((vertex, after_ms))
        return vertex in {pad, over_pad}

    told = floor.control.release(0, comes_home)["d0"]
    assert {action.vertex for action in told} == {over_pad}
    assert asked[-1][0] != over_pad
    assert [after_ms for _, after_ms in asked] == sorted(after_ms for _, after_ms in asked)
    assert floor.control.release(0, comes_home) == {}
    assert "d0" in floor.control.release(0)


def test_who_stands_still_delays_those_that_come_after_it_and_nobody_else() -> None:
    floor = Floor(4)
    for drone, node in (("d0", "A4"), ("d1", "A5"), ("d2", "C4")):
        assert floor.give(drone, node)
    floor.until("d0", "A4")
    floor.stopped.add("d0")
    floor.run(100)
    assert "C4" in floor.counted
    assert floor.at("d2") == "pad P3"
    floor.stopped.clear()
    floor.run()
    assert sorted(floor.counted) == ["A4", "A5", "C4"]


def test_a_drone_that_fails_is_flown_round_and_its_stops_are_left_to_others() -> None:
    floor = Floor(4)
    assert floor.give("d0", "A4", "A5", "A6")
    assert floor.give("d1", "A3", "A7")
    floor.until("d0", "A4")
    wreck = floor.control.drones["d0"]
    assert floor.control.fail("d0", floor.now_ms) == ()
    assert wreck.failed
    assert wreck.stops == ()
    floor.run()
    assert floor.at("d1") == "pad P2"
    assert floor.give("d2", "A7")
    floor.run()
    assert "A7" in floor.counted
    assert floor.at("d2") == "pad P3"
    assert not floor.give("d3", "A4")


def test_who_is_shut_in_behind_a_failed_drone_leaves_by_the_other_end() -> None:
    floor = Floor(4)
    assert floor.control.give("d1", (), [floor.lanes.over("B6")], 0)
    floor.run()
    assert floor.give("d0", "B3")
    floor.until("d0", "B3")
    assert floor.control.fail("d0", floor.now_ms) == ()
    assert floor.control.give("d1", (), [floor.lanes.index["pad P2"]], floor.now_ms)
    way = {floor.lanes.vertices[action.vertex].name for action in floor.control.drones["d1"].ahead}
    assert "B8" in way
    floor.run()
    assert floor.at("d1") == "pad P2"


def test_a_closed_aisle_is_left_and_not_entered() -> None:
    floor = Floor(4)
    assert floor.give("d0", "A4", "A5")
    assert floor.give("d1", "C3", "C4")
    floor.until("d0", "A4")
    lanes = floor.lanes.lanes_between((f"A{i}", f"A{i + 1}") for i in range(2, 7))
    assert floor.control.close("A", lanes, floor.now_ms) == ()
    floor.run()
    assert [floor.at(drone) for drone in ("d0", "d1")] == ["pad P1", "pad P2"]
    assert "A5" not in floor.counted
    assert not floor.give("d2", "A5")
    floor.control.open("A")
    assert floor.give("d2", "A5")
    floor.run()
    assert "A5" in floor.counted


def test_others_stop_before_the_grown_cell_of_a_drone_in_doubt_and_are_planned_round_it() -> None:
    floor = Floor(4)
    assert floor.give("d0", "A5", "A6")
    floor.until("d0", "A5")
    place = floor.control.drones["d0"].place
    floor.control.doubt("d0", 2.5, floor.now_ms)
    assert "d0" in floor.control.paused()
    assert floor.give("d1", "A3")
    for _ in range(60):
        floor.step()
        course = floor.control.drones["d1"]
        for resource in course.air:
            across_m, _ = gap(floor.lanes, resource, place)
            assert across_m >= CELL.separation_m + 2.5 - 1e-6
    floor.control.avoid("d0", floor.now_ms)
    floor.run(100)
    assert floor.at("d1") == "pad P2"
    floor.control.doubt("d0", 0.0, floor.now_ms)
    floor.run()
    assert floor.at("d0") == "pad P1"
    assert "A6" in floor.counted


@pytest.mark.parametrize("doubt_m", [math.inf, math.nan])
def test_a_doubt_without_a_number_is_no_certainty(doubt_m: float) -> None:
    floor = Floor()
    floor.control.doubt("d0", doubt_m, 0)
    zone = floor.control.closed_by()["d0"]
    floor.control.doubt("d0", 3.0, 0)
    assert zone == floor.control.closed_by()["d0"]
    floor.control.doubt("d0", 0.0, 0)
    assert floor.control.closed_by() == {}


def test_who_was_released_into_a_cell_that_grows_is_paused() -> None:
    floor = Floor(4)
    assert floor.give("d2", "A6")
    floor.until("d2", "A6")
    assert floor.give("d0", "A4")
    floor.until("d0", "A2")
    assert floor.control.drones["d0"].base
    assert not floor.control.paused()
    floor.control.doubt("d2", 10.0, floor.now_ms)
    assert floor.control.paused() == {"d0", "d2"}


def test_without_any_way_a_drone_holds_until_there_is_one() -> None:
    floor = Floor()
    assert floor.give("d0", "A4")
    floor.until("d0", "A4")
    lanes = floor.lanes.lanes_between([("A1", "A2"), ("A2", "A3"), ("A6", "A7"), ("A7", "A8")])
    assert floor.control.close("A", lanes, floor.now_ms) == ("d0",)
    floor.run()
    assert floor.at("d0") == "A4"
    floor.control.open("A")
    assert floor.control.replan(["d0"], floor.now_ms) == ()
    floor.run()
    assert floor.at("d0") == "pad P1"


def test_who_waits_for_a_drone_that_does_not_get_on_goes_first() -> None:
    floor = Floor(4)
    assert floor.give("d0", "A6", "A3")
    assert floor.give("d1", "A4")
    floor.until("d0", "A6")
    floor.stopped.add("d0")
    floor.run(60)
    assert floor.control.waits("d1") == ("d0",)
    floor.control.overtake(["d0"], floor.now_ms)
    floor.run()
    assert floor.counted == ["A4"]


def test_planning_anew_leaves_what_is_under_way_as_long_as_it_takes() -> None:
    floor = Floor()
    assert floor.give("d0", "A4", "A5")
    floor.until("d0", "A4")
    count = floor.control.drones["d0"].base[0]
    floor.now_ms += 60_000
    assert floor.control.replan(["d0"], floor.now_ms) == ()
    after = floor.control.drones["d0"].base[0]
    assert (after.act, after.duration_ms) == (Act.COUNT, count.duration_ms)


def test_a_count_is_one_action_that_takes_all_the_air_over_its_node() -> None:
    floor = Floor()
    floor.give("d0", "B4")
    floor.run()
    counts = [action for action in floor.told["d0"] if action.act is Act.COUNT]
    assert [action.resource for action in counts] == [floor.lanes.column_of["B4"]]
    with pytest.raises(KeyError):
        floor.lanes.over("B99")
