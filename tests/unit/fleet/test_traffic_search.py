"""What the search for ways is built of: distances, safe intervals that are kept up to date, and aisles flown
through in one step."""

from __future__ import annotations

import functools
import itertools
import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flightd.fleet.traffic import sipp
from flightd.fleet.traffic.action_graph import ActionGraph, Course
from flightd.fleet.traffic.distances import Distances
from flightd.fleet.traffic.lanes import Lane, LaneGraph, Vertex, lanes_of
from flightd.fleet.traffic.motions import NEVER, MotionNet, at_rest, vertex_of
from flightd.fleet.traffic.reservations import ENDLESS, ReservationTable
from flightd.fleet.traffic.sections import NONE, sections_of
from flightd.fleet.traffic.sipp import Effort, Sipp
from flightd.fleet.traffic.steps import StepTable
from flightd.sim.fleet.planning_bench import BenchCase, measure
from flightd.site.layout import lay_out
from flightd.site.site import Aisle, Pad
from flightd.site.ways import OneWay
from tests.unit.fleet.traffic_rig import PACE, SmallHall, shared_cells

LONG = functools.cache(lambda: SmallHall(3, 10, 4))
CONFLICTS = ((0, 1), (0, 1, 2), (1, 2))
UNTIL_MS = 40


def every_distance(net: MotionNet, goal: int, shut: frozenset[int] = frozenset()) -> list[int]:
    """Bellman and Ford's, lane by lane."""
    best = [NEVER] * len(net.lanes.vertices)
    best[goal] = 0
    for _ in best:
        for vertex, arcs in enumerate(net.lanes.arcs):
            for arc in (arc for arc in arcs if arc.resource not in shut):
                best[vertex] = min(best[vertex], best[arc.to] + net.lower_bound_ms(arc))
    return best


def test_distances_are_the_shortest_ones_also_where_lines_are_one_way() -> None:
    site = lay_out(
        "one way",
        [
            Aisle("A", 0.0, 0.0, (2.0,) * 5, one_way=OneWay.PLUS_X),
            Aisle("B", 0.0, 4.0, (2.0,) * 5),
            Aisle("C", 0.0, 8.0, (2.0,) * 5),
        ],
        [("A1", "B1"), ("A6", "B6"), ("B6", "C6"), ("B3", "C3")],
        [Pad("home", "B1", 0.6)],
    )
    net = MotionNet(lanes_of(site), PACE)
    distances = Distances(net)
    for goal in range(len(net.lanes.vertices)):
        assert list(distances.to(goal)) == every_distance(net, goal)


def test_a_ring_of_one_ways_whose_entry_is_shut_has_an_end() -> None:
    """0 to 1 to 4 to 3 and round again, out from 1 to 2, and in from 5 to 4."""
    at = ((0.0, 0.0), (2.0, 0.0), (4.0, 0.0), (0.0, 4.0), (2.0, 4.0), (4.0, 4.0))
    vertices = [Vertex(str(i), str(i), x_m, y_m, 1.5) for i, (x_m, y_m) in enumerate(at)]
    ways = ((0, 1, 0), (1, 4, 1), (4, 3, 2), (3, 0, 3), (1, 2, 0), (5, 4, 2))
    net = MotionNet(LaneGraph(vertices, [Lane(a, b, 2.0, quarter, True) for a, b, quarter in ways]), PACE)
    entry = frozenset(arc.resource for arc in net.lanes.arcs[5])
    for shut in (frozenset[int](), entry):
        for goal in range(6):
            assert list(Distances(net, shut).to(goal)) == every_distance(net, goal, shut)


def safe_by_force(taken: list[tuple[str, int, int, int]], resource: int) -> list[bool]:
    """Whether each moment, from its begin to its end, is free."""
    return [
        not any(a < moment + 1 and b > moment and resource in CONFLICTS[other] for _, other, a, b in taken)
        for moment in range(UNTIL_MS)
    ]


@settings(max_examples=60, deadline=None)
@given(
    st.lists(
        st.tuples(st.sampled_from("ab"), st.integers(0, 2), st.integers(0, 20), st.integers(1, 10)),
        max_size=8,
    ),
    st.booleans(),
)
def test_safe_intervals_are_what_nobody_has_taken(
    spells: list[tuple[str, int, int, int]], gives_back: bool
) -> None:
    table = ReservationTable(CONFLICTS)
    taken = [(holder, resource, at, at + length) for holder, resource, at, length in spells]
    for each in taken:
        table.take(*each)
    walk = [(0, 0, 5), (1, 5, 9), (2, 12, 15)]
    table.take_all("c", walk)
    taken += [("c", *spell) for spell in walk]
    if gives_back:
        table.give_back("a")
        taken = [each for each in taken if each[0] != "a"]
    for resource in range(3):
        intervals = list(zip(table.starts[resource], table.ends[resource], strict=True))
        assert all(a < b for a, b in intervals)
        assert all(before[1] < after[0] for before, after in itertools.pairwise(intervals))
        assert intervals[-1][1] == ENDLESS
        free = [any(a <= moment and moment + 1 <= b for a, b in intervals) for moment in range(UNTIL_MS)]
        assert free == safe_by_force(taken, resource)


class NoGuide(Distances):
    """Says of every vertex that the goal may be here."""

    def to(self, goal: int) -> list[int]:
        return [0] * len(LONG().lanes.vertices)


def test_what_guides_the_search_makes_no_leg_later() -> None:
    """With weight 1, held against a search that is guided by nothing, between reservations by chance."""
    hall = LONG()
    rng = random.Random(1)
    table = ReservationTable(hall.conflicts)
    for holder in range(60):
        from_ms = rng.randrange(20_000, 80_000)
        resource = rng.randrange(len(hall.lanes.vertices) + len(hall.lanes.lanes))
        table.take(str(holder), resource, from_ms, from_ms + rng.randrange(2_000, 20_000))
    for goal in rng.sample(hall.shelf_nodes, 5):
        ends = []
        for guide in (hall.planner.distances, NoGuide(hall.net)):
            legs = Sipp(hall.net, guide, table).legs(
                at_rest(hall.lanes.pads[0], 0), 0, hall.stop(goal), Effort(100_000)
            )
            ends.append(next(legs).end_ms)
        assert ends[0] == ends[1]


def test_the_middle_of_an_aisle_is_a_section_that_is_flown_through_in_one_step() -> None:
    hall = LONG()
    over = hall.lanes.over
    sections = sections_of(hall.lanes)
    assert [sections[over(f"B{i}")] != NONE for i in range(1, 13)] == [False] * 3 + [True] * 6 + [False] * 3
    steps, entered = StepTable(hall.net).through(at_rest(over("B3"), 0))
    assert entered == sections[over("B5")]
    ahead = {vertex: len(sweeps) for _, vertex, _, sweeps, _ in steps if sections[vertex] == NONE}
    assert ahead[over("B10")] == 7
    assert all(sections[vertex] == NONE for _, vertex, *_ in steps)


def test_stops_before_in_and_behind_a_section_are_as_early_as_can_be() -> None:
    """Alone, with the weight of a fleet, a drone flies straight to any node of the aisle, with one stop."""
    hall = LONG()
    start = hall.lanes.over("B1")
    for node in ("B3", "B4", "B6", "B9", "B10", "B11"):
        request = hall.request(0, [node])
        moved = type(request)("d", at_rest(start, 0), 0, request.stops, request.ends)
        leg = hall.planner.plan([moved]).plans["d"].actions
        counted = next(i for i, action in enumerate(leg) if action.act == "count")
        assert counted == int(node[1:]) - 1
        assert leg[counted].start_ms <= PACE.leg_s((counted) * 2.0) * 1000 + counted + 1


def test_a_fleet_that_flies_through_long_aisles_shares_no_cell() -> None:
    hall = LONG()
    fleet = [hall.request(i, nodes) for i, nodes in enumerate((["A6"], ["A4", "B7"], ["C6"], ["B5"]))]
    planned = hall.planner.plan(fleet)
    assert not planned.without
    courses = {
        each.drone: (vertex_of(each.configuration), planned.plans[each.drone].actions) for each in fleet
    }
    assert not shared_cells(hall.lanes, courses)
    ActionGraph({d: Course(place, 0, actions) for d, (place, actions) in courses.items()}, hall.conflicts)


def test_searches_that_take_long_are_hurried(monkeypatch: pytest.MonkeyPatch) -> None:
    """So that a fleet is planned much sooner, and not much worse; conflicts would be an error there."""
    case = BenchCase(40, 8, 10)
    hurried = measure(case)
    monkeypatch.setattr(sipp, "PATIENT_STATES", 10**9)
    patient = measure(case)
    assert hurried.planned == patient.planned == case.drones
    assert hurried.states < 0.7 * patient.states
    assert hurried.makespan_s < 1.2 * patient.makespan_s
