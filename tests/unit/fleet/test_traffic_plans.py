"""Plans of a fleet never conflict, and the order that is made of them has no circle: all reach their ends."""

from __future__ import annotations

import functools
import itertools
import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flightd.fleet.traffic.action_graph import (
    ActionGraph,
    ConflictingPlansError,
    Course,
    CyclicDependenciesError,
)
from flightd.fleet.traffic.cells import CellSize, conflicts_of
from flightd.fleet.traffic.lanes import lanes_of
from flightd.fleet.traffic.motions import Act, MotionNet, at_rest, vertex_of
from flightd.fleet.traffic.plan import Action
from flightd.fleet.traffic.prioritised import PrioritisedPlanner
from flightd.fleet.traffic.tours import Request
from flightd.site.layout import lay_out
from flightd.site.site import Aisle, Pad
from flightd.site.ways import KeepOut, OneWay
from tests.unit.fleet.traffic_rig import CELL, PACE, SmallHall, gap, shared_cells

SMALL = functools.cache(SmallHall)


@st.composite
def fleets(draw: st.DrawFn) -> list[Request]:
    hall = SMALL()
    nodes = draw(st.permutations(hall.shelf_nodes))
    counts = draw(st.lists(st.integers(0, 2), min_size=2, max_size=4))
    rest = iter(nodes)
    return [
        hall.request(i, list(itertools.islice(rest, count)), priority=draw(st.integers(0, 2)))
        for i, count in enumerate(counts)
    ]


@settings(max_examples=60, deadline=None)
@given(fleets(), st.integers(0, 1000))
def test_plans_share_no_cell_and_any_pace_flies_them_to_their_ends(fleet: list[Request], seed: int) -> None:
    hall = SMALL()
    planned = hall.planner.plan(fleet)
    assert not planned.without
    courses = {
        each.drone: (vertex_of(each.configuration), planned.plans[each.drone].actions) for each in fleet
    }
    assert not shared_cells(hall.lanes, courses)
    graph = ActionGraph(
        {d: Course(place, 0, actions) for d, (place, actions) in courses.items()}, hall.conflicts
    )
    place_of = {key: i for i, key in enumerate(graph.order)}
    assert all(place_of[before] < place_of[after] for before, after in graph.edges())
    _fly_in_any_order(hall, graph, courses, random.Random(seed))


def _fly_in_any_order(
    hall: SmallHall,
    graph: ActionGraph,
    courses: dict[str, tuple[int, tuple[Action, ...]]],
    rng: random.Random,
) -> None:
    """Begin and end actions by chance; nobody meets, and somebody can always go on."""
    done = dict.fromkeys(courses, 0)
    under_way: set[str] = set()
    while any(done[drone] < len(actions) for drone, (_, actions) in courses.items()):
        ready = [
            drone
            for drone, (_, actions) in courses.items()
            if drone not in under_way
            and done[drone] < len(actions)
            and all(done[other] > its for other, its in graph.waits_for((drone, done[drone])))
        ]
        assert ready or under_way
        drone = rng.choice([*ready, *under_way])
        if drone in under_way:
            under_way.discard(drone)
            done[drone] += 1
        else:
            under_way.add(drone)
        air = {
            drone: actions[done[drone]].resource
            if drone in under_way
            else (actions[done[drone] - 1].vertex if done[drone] else place)
            for drone, (place, actions) in courses.items()
        }
        for a, b in itertools.combinations(air, 2):
            across_m, upright_m = gap(hall.lanes, air[a], air[b])
            assert across_m >= CELL.separation_m - 1e-6 or upright_m >= CELL.upright_m - 1e-6


def test_a_drone_without_a_way_is_raised_over_those_that_block_it() -> None:
    """The first drone, planned first, goes to stay where the second comes out of its dock."""
    hall = SMALL(2, 4, 2)
    first, second = hall.lanes.pads
    over_pad = hall.lanes.arcs[second][0].to
    exit_of_dock = next(arc.to for arc in hall.lanes.arcs[over_pad] if arc.to != second)
    fleet = [
        Request("blocks", at_rest(first, 0), 0, (), (exit_of_dock,), priority=1.0),
        Request("passes", at_rest(second, 0), 0, (hall.stop("B2"),), (second,)),
    ]
    planned = hall.planner.plan(fleet)
    assert not planned.without
    assert planned.plans["blocks"].end_ms > planned.plans["passes"].end_ms - 10_000


def test_plans_that_conflict_are_refused() -> None:
    hall = SMALL()
    lane = hall.lanes.arcs[hall.lanes.over("A1")][0]
    one = Action(Act.FLY, lane.resource, lane.to, 0, 0, 100)
    later = Action(Act.FLY, lane.resource, hall.lanes.over("A1"), 0, 50, 150)
    with pytest.raises(ConflictingPlansError, match="a and b"):
        ActionGraph(
            {"a": Course(hall.lanes.over("A1"), 0, [one]), "b": Course(lane.to, 0, [later])}, hall.conflicts
        )


def test_nobody_passes_where_another_stays() -> None:
    hall = SMALL()
    lane = hall.lanes.arcs[hall.lanes.over("A1")][0]
    passes = Action(Act.FLY, lane.resource, lane.to, 0, 0, 100)
    with pytest.raises(ConflictingPlansError, match="where b stays"):
        ActionGraph(
            {"a": Course(hall.lanes.over("A1"), 0, [passes]), "b": Course(lane.to, 0, [])}, hall.conflicts
        )


def test_a_circle_of_actions_is_a_deadlock_and_refused() -> None:
    """The first drone's actions are not in the order of their times: the second waits for its last one, its
    first one for the second."""
    hall = SMALL()
    lane = hall.lanes.arcs[hall.lanes.over("A2")][0].resource
    one = [Action(Act.FLY, lane, hall.lanes.over("C1"), 0, *times) for times in ((10, 20), (0, 5))]
    two = [Action(Act.FLY, lane, hall.lanes.over("B4"), 0, 5, 10)]
    with pytest.raises(CyclicDependenciesError, match="a, b wait for each other"):
        ActionGraph({"a": Course(0, 0, one), "b": Course(0, 0, two)}, hall.conflicts)


def test_a_straight_flight_takes_what_the_pace_says() -> None:
    """The motions of a launch, cruising and braking add up to the one trapezoid."""
    hall = SMALL()
    over = hall.lanes.over
    request = Request("d", at_rest(over("A1"), 0), 0, (), (over("A6"),))
    plan = hall.planner.plan([request]).plans["d"]
    assert [action.act for action in plan.actions] == [Act.FLY] * 5
    assert plan.end_ms == pytest.approx(PACE.leg_s(10.0) * 1000, abs=len(plan.actions) + 1)


def test_lanes_keep_to_one_ways_blocked_lines_and_keep_outs_at_their_height() -> None:
    site = lay_out(
        "two levels",
        [
            Aisle("A", 0.0, 0.0, (2.0, 2.0, 2.0), one_way=OneWay.PLUS_X),
            Aisle("B", 0.0, 4.0, (2.0, 2.0, 2.0)),
        ],
        [("A1", "B1"), ("A4", "B4")],
        [Pad("home", "B1", 0.6)],
        ceiling_m=6.0,
        blocked=[("B2", "B3")],
        keep_outs=[KeepOut(2.5, -0.5, 3.5, 0.5, 3.0, 6.0)],
    )
    lanes = lanes_of(site, (1.5, 4.0))

    def leads(a: str, b: str) -> bool:
        return any(lanes.vertices[arc.to].name == b for arc in lanes.arcs[lanes.index[a]])

    assert leads("A1", "A2")
    assert not leads("A2", "A1")
    assert leads("A2", "A3")
    assert not leads("A2@4m", "A3@4m")
    assert not leads("B2", "B3")
    assert leads("B1", "B1@4m")
    assert leads("B1", "pad home")
    conflicts = conflicts_of(lanes, CellSize(upright_m=2.0))
    assert lanes.index["A2@4m"] not in conflicts[lanes.index["A2"]]
    assert lanes.index["A2@4m"] in conflicts[lanes.column_of["A2"]]
    fleet = [Request("d", at_rest(lanes.pads[0], 0), 0, (), (lanes.index["B3"],))]
    plan = PrioritisedPlanner(MotionNet(lanes, PACE), conflicts).plan(fleet).plans["d"]
    assert [lanes.vertices[action.vertex].name for action in plan.actions if action.act is not Act.TURN] == [
        "B1", "A1", "A2", "A3", "A4", "B4", "B3",
    ]  # fmt: skip
