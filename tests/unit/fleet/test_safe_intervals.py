"""SIPP finds the earliest way: held against a search through every moment, on tiny nets drawn at random."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any, cast

from hypothesis import given, settings
from hypothesis import strategies as st

from flightd.fleet.traffic.distances import Distances
from flightd.fleet.traffic.motions import NEVER, Act, Motion, MotionNet, Part, at_rest
from flightd.fleet.traffic.plan import Stop
from flightd.fleet.traffic.reservations import ReservationTable
from flightd.fleet.traffic.sipp import Effort, Sipp

VERTICES = 4
LANES = 5
UNTIL_MS = 60
"""Everything in these nets is over by then."""


@dataclass
class TinyNet:
    """Vertices 0..3 and lanes 4..8; motions between configurations, drawn."""

    motions: dict[int, list[Motion]]
    busy: list[tuple[int, int, int]]
    ramps_fit: bool = False
    launch_ms: int = 0
    stop_ms: int = 0
    lanes: Any = field(
        default_factory=lambda: SimpleNamespace(
            vertices=[SimpleNamespace(node=str(i)) for i in range(VERTICES)], arcs=[()] * VERTICES
        )
    )

    def onward(self, configuration: int) -> list[Motion]:
        return self.motions.get(configuration, [])


class NoGuide(Distances):
    """Says of every vertex that the goal may be here."""

    def __init__(self) -> None:
        pass

    def to(self, goal: int) -> list[int]:
        return [0] * VERTICES


@st.composite
def nets(draw: st.DrawFn) -> TinyNet:
    motions: dict[int, list[Motion]] = {}
    for _ in range(draw(st.integers(3, 12))):
        a, b = draw(st.tuples(st.integers(0, VERTICES - 1), st.integers(0, VERTICES - 1)))
        begins, ends = draw(st.tuples(st.booleans(), st.booleans()))
        first = draw(st.integers(1, 3))
        second = draw(st.integers(0, 3))
        lanes = draw(st.tuples(*[st.integers(VERTICES, VERTICES + LANES - 1)] * 2))
        duration = first + second
        # whoever leaves a vertex or comes to one is near it
        parts = [Part(Act.FLY, a, b, 0, first), Part(Act.FLY, lanes[0], b, 0, first)]
        if second:
            parts.append(Part(Act.FLY, lanes[1], b, first, duration))
        parts.append(Part(Act.FLY, b, b, first if second else 0, duration))
        before, after = draw(st.tuples(st.integers(0, 1), st.integers(0, 1)))
        motion = Motion(at_rest(b, after) + ends, duration, tuple(parts))
        motions.setdefault(at_rest(a, before) + begins, []).append(motion)
    for vertex, turn_ms in draw(st.dictionaries(st.integers(0, VERTICES - 1), st.integers(1, 6))).items():
        for quarter in (0, 1):
            turned = Part(Act.TURN, vertex, vertex, 0, turn_ms)
            motion = Motion(at_rest(vertex, 1 - quarter), turn_ms, (turned,))
            motions.setdefault(at_rest(vertex, quarter), []).append(motion)
    busy = draw(
        st.lists(
            st.tuples(st.integers(0, VERTICES + LANES - 1), st.integers(0, 20), st.integers(1, 10)),
            max_size=8,
        )
    )
    return TinyNet(motions, [(r, start, start + length) for r, start, length in busy])


def earliest_by_force(net: TinyNet, goal: int) -> int | None:
    """Every configuration at every moment, from vertex 0 at moment 0; the goal has to be kept for good."""

    def is_free(resource: int, from_ms: int, to_ms: int) -> bool:
        return not any(r == resource and a < to_ms and b > from_ms for r, a, b in net.busy)

    reached: list[set[int]] = [set() for _ in range(UNTIL_MS + 10)]
    if not any(r == 0 and a == 0 for r, a, _ in net.busy):
        reached[0].add(at_rest(0, 0))
    for moment in range(UNTIL_MS):
        there = not reached[moment].isdisjoint((at_rest(goal, 0), at_rest(goal, 1)))
        if there and is_free(goal, moment, NEVER):
            return moment
        for configuration in reached[moment]:
            if not configuration & 1 and is_free(configuration >> 3, moment, moment + 1):
                reached[moment + 1].add(configuration)
            for motion in net.onward(configuration):
                if all(is_free(p.resource, moment + p.in_ms, moment + p.out_ms) for p in motion.parts):
                    reached[moment + motion.duration_ms].add(motion.target)
    return None


@settings(max_examples=120, deadline=None)
@given(nets(), st.integers(1, VERTICES - 1))
def test_the_first_leg_is_as_early_as_any_way_through_all_moments(net: TinyNet, goal: int) -> None:
    table = ReservationTable(tuple((i,) for i in range(VERTICES + LANES)))
    for i, (resource, from_ms, to_ms) in enumerate(net.busy):
        table.take(str(i), resource, from_ms, to_ms)
    sipp = Sipp(cast(MotionNet, net), NoGuide(), table)
    leg = next(sipp.legs(at_rest(0, 0), 0, Stop(goal, goal, 0), Effort(10_000)), None)
    assert (leg.end_ms if leg else None) == earliest_by_force(net, goal)
    if leg is not None:
        for action in leg.actions:
            assert not table.holders(action.resource, action.start_ms, action.end_ms)


def test_a_stop_is_done_only_where_there_is_time_for_it() -> None:
    """The air over the goal is taken twice; what is done there takes longer than the gap between."""
    motion = Motion(at_rest(1, 0), 2, (Part(Act.FLY, 4, 1, 0, 2),))
    net = TinyNet({at_rest(0, 0): [motion]}, [])
    table = ReservationTable(tuple((i,) for i in range(VERTICES + LANES)))
    table.take("other", 5, 6, 8)
    table.take("other", 5, 12, 20)
    sipp = Sipp(cast(MotionNet, net), NoGuide(), table)
    leg = next(sipp.legs(at_rest(0, 0), 0, Stop(1, 5, 5), Effort(100)))
    assert [(action.act, action.start_ms, action.end_ms) for action in leg.actions] == [
        (Act.FLY, 0, 2),
        (Act.COUNT, 20, 25),
    ]


def test_a_search_ends_when_its_effort_is_spent() -> None:
    motion = Motion(at_rest(1, 0), 2, (Part(Act.FLY, 4, 1, 0, 2),))
    sipp = Sipp(
        cast(MotionNet, TinyNet({at_rest(0, 0): [motion]}, [])), NoGuide(), ReservationTable(((),) * 9)
    )
    assert next(sipp.legs(at_rest(0, 0), 0, Stop(1, 1, 0), Effort(1)), None) is None
