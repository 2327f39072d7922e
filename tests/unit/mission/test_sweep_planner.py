"""The legs past the shelves of an aisle: joined, over all that is wanted, at the right height and side."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import asdict, replace
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flightd.config.front_camera import FrontCameraConfig
from flightd.config.schema import Config
from flightd.mission.plan.itinerary import in_best_order
from flightd.mission.plan.leg_times import Pace
from flightd.mission.plan.sweep_leg import SweepLeg
from flightd.mission.scan.code_assignment import Assigner, FrontSight
from flightd.mission.scan.sweep_planner import SweepPlanner
from flightd.mission.scan.sweep_speed import SweepOptics
from flightd.mission.scan.told_sweeps import told
from flightd.mission.scan.views import ViewPlanner
from flightd.site.site import Side, Site
from flightd.site.site_file import parse_site
from tests.unit.mission.configured import configured
from tests.unit.mission.shelves import BARE_ENDS, SIGHT, SITE, one_aisle

NODES = ("A1", "A2", "A3", "A4")
ALL = frozenset(SITE.locations)
CONFIG = configured()


def sweeps(site: Site = SITE, sight: FrontSight = SIGHT, config: Config = CONFIG) -> SweepPlanner:
    assigner = Assigner(site, sight)
    return SweepPlanner(
        site, ViewPlanner(site, sight, assigner, config.scan), assigner, SweepOptics.of(config)
    )


PLANNER = sweeps()


@settings(max_examples=40)
@given(
    st.sets(st.sampled_from(sorted(ALL)), min_size=1),
    st.sampled_from(NODES),
    st.floats(-math.pi, math.pi),
    st.floats(0.5, 3.0),
)
def test_legs_are_joined_and_pass_all_that_is_wanted_before_two_nodes_and_more(
    wanted: set[str], here: str, yaw_rad: float, height_m: float
) -> None:
    legs = PLANNER.legs(NODES, frozenset(wanted), here, yaw_rad, height_m)
    assert not legs or legs[0].nodes[0] == here
    assert all(a.end == b.nodes[0] for a, b in pairwise(legs))
    assert [leg.last for leg in legs] == [False] * (len(legs) - 1) + [True] * bool(legs)
    passed = {(code, node) for leg in legs for code in leg.locations for node in leg.nodes}
    for side in Side:
        for level in (1, 2):
            places = [SITE.locations[code] for code in wanted]
            places = [place for place in places if (place.side, place.level) == (side, level)]
            swept = len({place.node for place in places}) > 1
            assert all(((place.code, place.node) in passed) is swept for place in places)
    for leg in legs:
        assert {SITE.locations[code].side for code in leg.locations} == {leg.side}
        assert math.sin(leg.yaw_rad) == pytest.approx(1.0 if leg.side is Side.RIGHT else -1.0)
        assert 0.0 < leg.speed_mps <= CONFIG.mission.speed_mps


def test_it_flies_up_one_side_and_down_the_other_from_end_to_end() -> None:
    legs = PLANNER.legs(NODES, ALL, "A1", -math.pi / 2, 0.9)
    assert [(leg.side, leg.levels, leg.end) for leg in legs] == [
        (Side.LEFT, (1,), "A4"),
        (Side.LEFT, (2,), "A1"),
        (Side.RIGHT, (2,), "A4"),
        (Side.RIGHT, (1,), "A1"),
    ]
    pace = Pace.of(CONFIG.mission)
    assert 4 * 3.9 / 0.8 < PLANNER.seconds(legs, pace, -math.pi / 2) < 60.0


BARE = replace(
    SITE, locations={code: place for code, place in SITE.locations.items() if place.node in {"A2", "A3"}}
)
"""Nothing hangs before the end nodes."""


@pytest.mark.parametrize("here", ["A1", "A4"])
def test_a_leg_leads_on_over_an_end_node_without_shelves(here: str) -> None:
    far = "A4" if here == "A1" else "A1"
    legs = sweeps(BARE).legs(NODES, frozenset(BARE.locations), here, -math.pi / 2, 0.9)
    assert [far in leg.nodes for leg in legs] == [True, True, False, False]
    assert legs[0].nodes[0] == here
    assert all(a.end == b.nodes[0] for a, b in pairwise(legs))
    inner = NODES[:3] if here == "A1" else NODES[1:]
    legs = sweeps(BARE).legs(inner, frozenset(BARE.locations), here, -math.pi / 2, 0.9)
    assert not any(far in leg.nodes for leg in legs), "it is not to be visited"


def test_the_last_leg_does_it_where_it_need_not_come_back() -> None:
    one = replace(
        BARE, locations={c: p for c, p in BARE.locations.items() if (p.side, p.level) == ("left", 1)}
    )
    legs = sweeps(one).legs(NODES, frozenset(one.locations), "A1", -math.pi / 2, 0.9)
    assert [leg.nodes for leg in legs] == [NODES]
    three = replace(
        BARE, locations={c: p for c, p in BARE.locations.items() if (p.side, p.level) != ("right", 2)}
    )
    legs = sweeps(three).legs(NODES, frozenset(three.locations), "A1", -math.pi / 2, 0.9)
    assert ["A4" in leg.nodes for leg in legs] == [False, False, True]


def test_legs_end_where_the_next_begins_and_where_the_aisle_is_left() -> None:
    planner, everything = sweeps(BARE_ENDS), frozenset(BARE_ENDS.locations)
    legs = planner.legs(("B1", "B2", "B3", "B4", "B5"), everything, "B1", math.pi / 2, 0.9)
    assert [(leg.nodes[0], leg.end) for leg in legs] == [
        ("B1", "B5"),
        ("B5", "B2"),
        ("B2", "B4"),
        ("B4", "B1"),  # nothing hangs before B1, but there the way to another aisle begins
    ]
    # one front is longer than the other: on to its end, not back to that first
    legs = planner.legs(("C1", "C2", "C3", "C4", "C5"), everything, "C1", -math.pi / 2, 0.9)
    assert [leg.side for leg in legs] == [Side.LEFT, Side.LEFT, Side.RIGHT, Side.RIGHT]
    assert [(leg.nodes[0], leg.end) for leg in legs] == [
        ("C1", "C4"),
        ("C4", "C1"),
        ("C1", "C5"),
        ("C5", "C1"),
    ]


def test_levels_whose_places_fit_one_picture_are_flown_past_together() -> None:
    front = FrontCameraConfig(width_px=2400, height_px=2400)
    tall = sweeps(sight=FrontSight(front.lens(), front.mount()))
    assert {lane.levels for lane in tall.lanes("A", ALL)} == {(1, 2)}
    assert {lane.levels for lane in PLANNER.lanes("A", ALL)} == {(1,), (2,)}


@settings(max_examples=40)
@given(
    st.lists(st.floats(0.1, 3.0), min_size=1, max_size=5),
    st.floats(0.5, 1.5),
    st.none() | st.floats(1.5, 3.0),
)
def test_whatever_the_limits_of_the_height_each_place_is_on_one_lane_and_no_two_show_the_same(
    heights_m: list[float], least_m: float, most_m: float | None
) -> None:
    levels_m = sorted({round(height_m, 1) for height_m in heights_m})
    site = one_aisle(levels_m)
    scan = {"min_height_m": least_m, "max_height_m": most_m}
    lanes = sweeps(site, config=configured().with_values(scan=scan)).lanes("A", site.locations)
    assert sorted(place.code for lane in lanes for place in lane.places) == sorted(site.locations)
    for one, other in pairwise(lanes):
        assert one.side is not other.side or other.height_m - one.height_m >= 0.05


ONE_WAY = """
[site]
name = "one way"
ceiling_m = 6.0
[[aisle]]
id = "A"
x_m = 0.0
y_m = 0.0
spacing_m = [1.3, 1.3]
one_way = "+x"
[[aisle]]
id = "B"
x_m = 0.0
y_m = 3.4
spacing_m = [1.3, 1.3]
[[cross]]
nodes = ["A1", "B1"]
[[cross]]
nodes = ["A3", "B3"]
[[rack]]
bay_width_m = 1.2
levels_m = [0.9]
[[pad]]
id = "home"
node = "A1"
size_m = 0.5
"""
"""The first of two aisles is flown one way."""


def test_a_one_way_aisle_is_counted_by_stopping() -> None:
    site = parse_site(ONE_WAY, "one way")
    planner = sweeps(site)
    everything = frozenset(site.locations)
    assert not planner.legs(("A1", "A2", "A3"), everything, "A1", 0.0, 1.0)
    assert planner.legs(("B1", "B2", "B3"), everything, "B1", 0.0, 1.0)


def test_nobody_asks_at_each_node_of_a_closed_aisle_what_may_be_flown_past(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Each question goes through all lanes, and a flight asks at each of its stops, in a control tick."""
    asked = list[str]()

    def legs(planner: SweepPlanner, run: Sequence[str], *args: object) -> tuple[SweepLeg, ...]:
        asked.append(run[0])
        return asks(planner, run, *args)  # type: ignore[arg-type]

    asks = SweepPlanner.legs
    monkeypatch.setattr(SweepPlanner, "legs", legs)
    site = parse_site(ONE_WAY, "one way")
    everything = frozenset(site.locations)
    assert not list(sweeps(site).stop_by_stop(("A1", "A2", "A3"), everything, 0.0, 1.0))
    assert asked == []
    assert list(sweeps(site).stop_by_stop(("B1", "B2", "B3"), everything, 0.0, 1.0))
    assert asked == ["B1"]


def test_the_plan_says_once_what_is_alike_and_what_limits_it() -> None:
    first, second = told(PLANNER.judged(NODES, ALL, 0.0, 0.0))
    assert (first.levels, second.levels, first.places + second.places) == ((1,), (2,), len(ALL))
    assert first.limit == "cruise"
    assert "mission.speed_mps" in first.text
    assert "2.50 px per module, a blur of 0.53 in 2 ms" in first.text


@pytest.mark.parametrize(
    ("site", "run", "sweep", "why", "words"),
    [
        (
            SITE,
            NODES,
            {"module_m": 0.001},
            "labels",
            "labels are not surely read; labels get 0.83 px per module, 2.5 are needed",
        ),
        (
            one_aisle(bay_m=2.6, positions=1),
            NODES,
            {},
            "width",
            "its places are as wide as the picture, or it is read too seldom",
        ),
        (SITE, ("A2",), {}, "nodes", "before one node only"),
        (parse_site(ONE_WAY, "one way"), ("A1", "A2", "A3"), {}, "line", "not open and clear both ways"),
    ],
)
def test_the_plan_says_of_what_is_not_flown_past_why(
    site: Site, run: tuple[str, ...], sweep: dict[str, float], why: str, words: str
) -> None:
    planner = sweeps(site, config=configured().with_values(scan={"sweep": sweep}))
    codes = frozenset(site.locations)
    assert not planner.legs(run, codes, run[0], 0.0, 0.0)
    sweeps_told = told(planner.judged(run, codes, 0.0, 0.0))
    assert not any(each.swept for each in sweeps_told)
    assert json.dumps([asdict(each) for each in sweeps_told], allow_nan=False)
    texts = [each.text for each in sweeps_told if each.stops_for == why]
    assert texts
    assert all("by stopping; " in text and words in text for text in texts)


@settings(max_examples=40)
@given(
    st.sets(st.sampled_from(sorted(ALL)), min_size=1),
    st.lists(st.sampled_from(NODES), min_size=1, max_size=4, unique=True),
)
def test_what_is_told_as_flown_past_is_what_is_flown_past(wanted: set[str], run: list[str]) -> None:
    judged = PLANNER.judged(run, frozenset(wanted), 0.0, 0.0)
    legs = PLANNER.legs(run, frozenset(wanted), run[0], 0.0, 0.0)
    flown = {(one.lane.side, one.lane.levels) for one in judged if one.stops_for is None}
    assert flown == {(leg.side, leg.levels) for leg in legs}
    assert sum(len(one.lane.places) for one in judged) == len(
        [code for code in wanted if SITE.locations[code].node in run]
    )


@settings(max_examples=40)
@given(st.sets(st.sampled_from(NODES), min_size=1), st.sampled_from(NODES), st.permutations(NODES))
def test_the_best_order_is_no_longer_than_any_other(due: set[str], here: str, other: list[str]) -> None:
    order, rest = in_best_order(SITE, here, sorted(due), (), "A1")
    assert set(order) == due
    assert rest == ()
    any_order = [node for node in other if node in due]
    assert SITE.length_m((here, *order, "A1")) <= SITE.length_m((here, *any_order, "A1")) + 1e-6
