"""Where drones planned one after the other find no way, all are pushed home, if there is a way at all."""

from __future__ import annotations

import functools
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flightd.fleet.traffic.action_graph import ActionGraph, Course
from flightd.fleet.traffic.cells import Conflicts, conflicts_of
from flightd.fleet.traffic.lacam import moves_home, without_detours
from flightd.fleet.traffic.lanes import Lane, LaneGraph, Vertex
from flightd.fleet.traffic.motions import NEVER, MotionNet, at_rest
from flightd.fleet.traffic.pibt import Mover
from flightd.fleet.traffic.prioritised import FixedBookings, PrioritisedPlanner
from flightd.fleet.traffic.pushing import Pushed, cut_off, plan_by_pushing
from flightd.fleet.traffic.tours import Request
from flightd.fleet.traffic.traffic_control import TrafficControl
from tests.unit.fleet.traffic_rig import CELL, PACE, SmallHall, fly_at_pace, fly_out, shared_cells

SPACING_M = 4.0
HALL = functools.cache(SmallHall)


@dataclass(frozen=True)
class Puzzle:
    """A small graph, and on it drones each with the vertex where it stands and the one that it wants to."""

    lanes: LaneGraph
    starts: tuple[int, ...]
    goals: tuple[int, ...]

    @functools.cached_property
    def conflicts(self) -> Conflicts:
        return conflicts_of(self.lanes, CELL)

    @property
    def drones(self) -> list[str]:
        return [f"d{i}" for i in range(len(self.starts))]

    def control(self) -> TrafficControl:
        control = TrafficControl(self.lanes, PACE, CELL)
        for drone, start, goal in zip(self.drones, self.starts, self.goals, strict=True):
            control.enter(drone, start, ends=(goal,))
        return control

    def planned_alone(self) -> bool:
        """Whether a plan of one drone after the other is found."""
        requests = [
            Request(drone, at_rest(start, 0), 0, (), (goal,))
            for drone, start, goal in zip(self.drones, self.starts, self.goals, strict=True)
        ]
        planner = PrioritisedPlanner(MotionNet(self.lanes, PACE), self.conflicts)
        return not planner.plan(requests).without

    def can_be_solved(self) -> bool:
        """By a search over all places of all drones, one move of one drone after the other."""
        near = [frozenset(each) for each in self.conflicts]
        seen, todo = {self.starts}, deque([self.starts])
        while todo:
            at = todo.popleft()
            if at == self.goals:
                return True
            for i, place in enumerate(at):
                for arc in self.lanes.arcs[place]:
                    if any(other in near[arc.resource] for other in (*at[:i], *at[i + 1 :])):
                        continue
                    moved = (*at[:i], arc.to, *at[i + 1 :])
                    if moved not in seen:
                        seen.add(moved)
                        todo.append(moved)
        return False


def grid(columns: int, rows: int, ways: Sequence[tuple[int, int, bool]]) -> LaneGraph:
    """Vertices in rows, and lanes between neighbours, each one-way or not."""
    vertices = [
        Vertex(f"{x}/{y}", f"{x}/{y}", SPACING_M * x, SPACING_M * y, 1.5)
        for y in range(rows)
        for x in range(columns)
    ]
    lanes = [Lane(a, b, SPACING_M, 0 if b == a + 1 else 1, one_way) for a, b, one_way in ways]
    return LaneGraph(vertices, lanes)


@st.composite
def puzzles(draw: st.DrawFn) -> Puzzle:
    """All vertices can be reached from all: a tree of lanes both ways, and some more lanes."""
    columns, rows = draw(st.sampled_from(((3, 3), (4, 2), (5, 2), (7, 1))))
    size = columns * rows
    neighbours = [(i, i + 1) for i in range(size) if (i + 1) % columns]
    neighbours += [(i, i + columns) for i in range(size - columns)]
    tree_of = list(range(size))
    ways: list[tuple[int, int, bool]] = []
    for a, b in draw(st.permutations(neighbours)):
        if tree_of[a] != tree_of[b]:
            old = tree_of[b]
            tree_of = [tree_of[a] if each == old else each for each in tree_of]
            ways.append((a, b, False))
        elif draw(st.integers(0, 4)) == 0:
            ways.append((a, b, draw(st.booleans())))
    drones = draw(st.integers(2, 4))
    starts, goals = (tuple(draw(st.permutations(range(size)))[:drones]) for _ in range(2))
    return Puzzle(grid(columns, rows, ways), starts, goals)


@dataclass
class Tally:
    """How many puzzles have a solution, and for how many it was found; of those in `hard` no plan of one
    drone after the other is found."""

    solvable: int = 0
    solved: int = 0
    hard: int = 0
    hard_solved: int = 0

    def add(self, puzzle: Puzzle, *, solved: bool) -> None:
        solvable = puzzle.can_be_solved()
        assert solvable or not solved
        if solvable:
            self.solvable += 1
            self.solved += solved
            if not puzzle.planned_alone():
                self.hard += 1
                self.hard_solved += solved


def test_nearly_every_puzzle_that_has_a_solution_is_solved_and_flown_to_its_end() -> None:
    tally = Tally()

    @settings(max_examples=150, deadline=None, derandomize=True, database=None)
    @given(puzzles(), st.integers(0, 1000))
    def solve(puzzle: Puzzle, seed: int) -> None:
        control = puzzle.control()
        held = control.replan(puzzle.drones, 0)
        places = fly_out(control, seed)
        for drone, goal in zip(puzzle.drones, puzzle.goals, strict=True):
            assert drone in held or places[drone] == goal
        tally.add(puzzle, solved=not held)

    solve()
    assert tally.hard >= 10, tally
    assert tally.hard_solved >= 0.9 * tally.hard, tally
    assert tally.solved >= 0.95 * tally.solvable, tally


def corridor(*starts_and_goals: tuple[int, int]) -> Puzzle:
    """Seven vertices in a row, and one beside the middle, number 10."""
    row = [(i, i + 1, False) for i in range(6)]
    starts, goals = zip(*starts_and_goals, strict=True)
    return Puzzle(grid(7, 2, [*row, (3, 10, False)]), starts, goals)


@pytest.mark.parametrize(
    "puzzle",
    [
        pytest.param(corridor((1, 5), (2, 4), (4, 2), (5, 1)), id="two pairs pass each other"),
        pytest.param(corridor((0, 2), (1, 1), (2, 0)), id="three turn round their order"),
        pytest.param(corridor((10, 6), (2, 10), (4, 0), (5, 5)), id="who has the bay gives it up"),
    ],
)
def test_in_a_corridor_with_one_bay_all_change_places(puzzle: Puzzle) -> None:
    assert not puzzle.planned_alone()
    control = puzzle.control()
    assert control.replan(puzzle.drones, 0) == ()
    assert tuple(fly_out(control).values()) == puzzle.goals


def test_who_cannot_pass_each_other_at_all_hold() -> None:
    puzzle = Puzzle(grid(7, 1, [(i, i + 1, False) for i in range(6)]), (2, 4), (5, 1))
    assert not puzzle.can_be_solved()
    control = puzzle.control()
    assert control.replan(puzzle.drones, 0)
    assert len(set(fly_out(control).values())) == 2


@dataclass(frozen=True)
class Closed:
    """A hall of so many aisles and nodes, in which people close ways while drones are over some nodes."""

    size: tuple[int, int]
    at: tuple[str, ...]
    ways: tuple[tuple[str, str], ...]

    @property
    def hall(self) -> SmallHall:
        return HALL(*self.size, len(self.at))

    def control(self) -> TrafficControl:
        control = TrafficControl(self.hall.lanes, PACE, CELL)
        for i, (node, pad) in enumerate(zip(self.at, self.hall.lanes.pads, strict=True)):
            control.enter(f"d{i}", self.hall.lanes.over(node), ends=(pad,))
        return control

    def close(self, control: TrafficControl) -> tuple[str, ...]:
        """Who holds after all were planned anew."""
        control.close("some", self.hall.lanes.lanes_between(self.ways), 0)
        return control.replan(control.drones, 0)

    def planned_alone(self) -> bool:
        """Whether a plan of one drone after the other is found; who is cut off stays where it is."""
        control = self.control()
        control.closed.close("some", self.hall.lanes.lanes_between(self.ways))
        assert all(control.closed.air.isdisjoint(course.air) for course in control.drones.values())
        stays = {drone: course.place for drone, course in control.drones.items() if control.is_cut_off(drone)}
        requests = [
            Request(drone, at_rest(course.place, 0), 0, (), course.ends)
            for drone, course in control.drones.items()
            if drone not in stays
        ]
        taken = [(drone, place, 0, NEVER) for drone, place in stays.items()]
        return not self.hall.planner.plan(requests, FixedBookings(taken, control.closed.air)).without


@pytest.mark.parametrize(
    "closed",
    [
        pytest.param(
            Closed(
                (2, 4),
                ("A5", "B4", "DAA7", "DAA4"),
                (("DAB4", "DAB5"), ("DAA2", "A1"), ("DAB3", "DAB4"), ("B2", "B3")),
            ),
            id="four drones, three aisles cut",
        ),
        pytest.param(
            Closed(
                (2, 4),
                ("DAB3", "DAA2", "A5", "DAA7"),
                (("A6", "DAB7"), ("DAA2", "A1"), ("B4", "B5"), ("B1", "B2")),
            ),
            id="four drones, both crosses cut",
        ),
        pytest.param(
            Closed(
                (2, 6),
                ("DAC4", "DAA9", "DAC10", "DAC8", "DAA7", "DAB3"),
                (("DAB3", "DAB4"), ("A7", "A8"), ("B5", "B6"), ("DAB2", "DAC2")),
            ),
            id="six drones",
        ),
    ],
)
def test_where_people_closed_ways_all_come_home(closed: Closed) -> None:
    control = closed.control()
    assert closed.close(control) == ()
    assert not closed.planned_alone()
    places = fly_out(control)
    assert tuple(places.values()) == closed.hall.lanes.pads


@pytest.mark.parametrize("every_ms", [5_000, 10_000, 15_000])
def test_who_is_cut_off_makes_room_for_others_and_goes_on_with_it_when_planned_anew(every_ms: int) -> None:
    ways = ("DAA2", "A1"), ("DAA1", "DAA2"), ("B4", "B5"), ("DAB3", "DAB4")
    closed = Closed((2, 4), ("A1", "B2", "B4", "DAA8"), ways)
    assert not closed.planned_alone()
    control = closed.control()
    assert closed.close(control) == ("d0",)
    places = fly_at_pace(control, ["d0"], every_ms)
    assert tuple(places.values())[1:] == closed.hall.lanes.pads[1:]
    assert places["d0"] != closed.hall.lanes.over("A1")
    control.open("some")
    assert control.replan(["d0"], 0) == ()
    assert fly_out(control)["d0"] == closed.hall.lanes.pads[0]


def pushed(puzzle: Puzzle, *, shut: frozenset[int] = frozenset()) -> list[Pushed]:
    return [
        Pushed(drone, at_rest(start, 0), 0, (goal,), shut=shut)
        for drone, start, goal in zip(puzzle.drones, puzzle.starts, puzzle.goals, strict=True)
    ]


def test_head_to_head_in_one_aisle_each_comes_to_the_pad_behind_the_other() -> None:
    hall = HALL(2, 4, 2)
    left, right = hall.lanes.pads
    at = {"a": hall.lanes.over("A2"), "b": hall.lanes.over("A4")}
    drones = [Pushed("a", at_rest(at["a"], 0), 0, (right,)), Pushed("b", at_rest(at["b"], 0), 0, (left,))]
    plans = plan_by_pushing(hall.net, hall.conflicts, drones)
    assert plans is not None
    assert plans["a"].actions[-1].vertex == right
    assert plans["b"].actions[-1].vertex == left
    courses = {drone: (at[drone], plan.actions) for drone, plan in plans.items()}
    assert not shared_cells(hall.lanes, courses)
    ActionGraph({d: Course(place, 0, actions) for d, (place, actions) in courses.items()}, hall.conflicts)


def test_a_way_that_is_shut_is_flown_round_and_who_has_none_is_cut_off() -> None:
    """By a ring of lanes, the short way shut; and along a row with a lane shut."""
    ring = grid(
        3, 2, [(0, 1, False), (1, 2, False), (0, 3, False), (2, 5, False), (3, 4, False), (4, 5, False)]
    )
    puzzle = Puzzle(ring, (0,), (1,))
    net = MotionNet(ring, PACE)
    shut = frozenset({next(arc.resource for arc in ring.arcs[0] if arc.to == 1)})
    plans = plan_by_pushing(net, puzzle.conflicts, pushed(puzzle, shut=shut))
    assert plans is not None
    assert [action.vertex for action in plans["d0"].actions if action.vertex != action.resource] == [
        3,
        4,
        5,
        2,
        1,
    ]
    assert cut_off(net, pushed(puzzle, shut=shut)) == frozenset()
    row = Puzzle(grid(3, 1, [(0, 1, False), (1, 2, False)]), (0, 2), (2, 1))
    shut = frozenset({next(arc.resource for arc in row.lanes.arcs[0])})
    assert cut_off(MotionNet(row.lanes, PACE), pushed(row, shut=shut)) == {"d0"}


def test_the_same_is_planned_twice_and_no_more_is_decided_than_may_be() -> None:
    puzzle = corridor((0, 2), (1, 1), (2, 0))
    net = MotionNet(puzzle.lanes, PACE)
    plans = [plan_by_pushing(net, puzzle.conflicts, pushed(puzzle)) for _ in range(2)]
    assert plans[0] is not None
    assert plans[0] == plans[1]
    left_ms = [[abs(goal - vertex) for vertex in range(14)] for goal in puzzle.goals]
    movers = [Mover(goal, frozenset(), ms) for goal, ms in zip(puzzle.goals, left_ms, strict=True)]
    assert moves_home(puzzle.lanes, puzzle.conflicts, movers, puzzle.starts) is not None
    assert moves_home(puzzle.lanes, puzzle.conflicts, movers, puzzle.starts, most=6) is None


def test_a_detour_is_left_out_unless_somebody_passes_meanwhile() -> None:
    puzzle = corridor((3, 3), (1, 5))
    arc = {
        (here, arc.to): arc for here in range(len(puzzle.lanes.vertices)) for arc in puzzle.lanes.arcs[here]
    }
    aside = [(0, arc[3, 10]), (0, arc[10, 3])]
    passes = [(1, arc[here, here + 1]) for here in range(1, 5)]
    back = [*passes, *aside]
    assert without_detours(back, puzzle.starts, puzzle.conflicts) == passes
    needed = [aside[0], *passes, aside[1]]
    assert without_detours(needed, puzzle.starts, puzzle.conflicts) == needed
