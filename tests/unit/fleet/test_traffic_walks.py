"""Whatever happens to a fleet in whatever order: no released air meets, no graph has a circle, all land."""

from __future__ import annotations

import os

from hypothesis import given, settings
from hypothesis import strategies as st

from tests.unit.fleet.test_traffic_control import Floor

WALKS = int(os.environ.get("FLIGHTD_WALKS", "25"))

DRONES = ("d0", "d1", "d2", "d3")
NODES = tuple(f"{aisle}{i}" for aisle in "ABC" for i in range(2, 8))
LINES = tuple((f"{aisle}{i}", f"{aisle}{i + 1}") for aisle in "ABC" for i in range(2, 7))

EVENTS = st.one_of(
    st.tuples(st.just("step"), st.integers(1, 6)),
    st.tuples(
        st.just("give"), st.sampled_from(DRONES), st.lists(st.sampled_from(NODES), max_size=3, unique=True)
    ),
    st.tuples(st.just("stop"), st.sampled_from(DRONES)),
    st.tuples(st.just("doubt"), st.sampled_from(DRONES), st.sampled_from((0.0, 0.5, 3.0))),
    st.tuples(st.just("avoid"), st.sampled_from(DRONES)),
    st.tuples(st.just("overtake"), st.sampled_from(DRONES)),
    st.tuples(st.just("replan"), st.sets(st.sampled_from(DRONES), min_size=1)),
    st.tuples(st.just("fail"), st.sampled_from(DRONES)),
    st.tuples(st.just("close"), st.sets(st.sampled_from(LINES), min_size=1, max_size=3)),
    st.tuples(st.just("open")),
)


class Walk:
    """One fleet, the events that come over it, and what was closed."""

    def __init__(self) -> None:
        self.floor = Floor(4)
        self.closed: list[str] = []

    def happens(self, event: tuple[object, ...]) -> None:
        floor, control = self.floor, self.floor.control
        match event:
            case ("step", int(times)):
                for _ in range(times):
                    floor.step()
            case ("give", str(drone), list(nodes)) if not control.drones[drone].ahead:
                if not control.drones[drone].failed:
                    floor.give(drone, *nodes)
            case ("stop", str(drone)):
                floor.stopped ^= {drone}
            case ("doubt", str(drone), float(metres)) if not control.drones[drone].failed:
                control.doubt(drone, metres, floor.now_ms)
            case ("avoid", str(drone)) if not control.drones[drone].failed:
                control.avoid(drone, floor.now_ms)
            case ("overtake", str(drone)):
                control.overtake([drone], floor.now_ms)
            case ("replan", set(drones)):
                control.replan(drones, floor.now_ms)
            case ("fail", str(drone)) if not any(course.failed for course in control.drones.values()):
                control.fail(drone, floor.now_ms)
            case ("close", set(lines)):
                self.closed.append(f"closed {len(self.closed)}")
                control.close(self.closed[-1], floor.lanes.lanes_between(lines), floor.now_ms)
            case ("open",):
                self.open()
        floor.check()

    def open(self) -> None:
        while self.closed:
            self.floor.control.open(self.closed.pop())

    def ends(self) -> None:
        """Everything is well again but for who failed: the others come home."""
        floor, control = self.floor, self.floor.control
        self.open()
        floor.stopped.clear()
        flying = [drone for drone, course in control.drones.items() if not course.failed]
        for drone in flying:
            control.doubt(drone, 0.0, floor.now_ms)
        held = control.replan(flying, floor.now_ms)
        floor.run()
        for drone in flying:
            if drone not in held:
                assert floor.at(drone) == f"pad P{int(drone[1]) + 1}"
        failed = [drone for drone, course in control.drones.items() if course.failed]
        assert not held or failed


@settings(max_examples=WALKS, deadline=None)
@given(st.lists(EVENTS, max_size=30))
def test_no_air_meets_and_all_come_home_whatever_happens(events: list[tuple[object, ...]]) -> None:
    walk = Walk()
    for event in events:
        walk.happens(event)
    walk.ends()
