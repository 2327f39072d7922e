"""One-way and blocked lines, keep-outs and pads: what routes respect and what the layout refuses."""

from __future__ import annotations

import itertools
import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flightd.config.mission import Heading
from flightd.core.errors import InputError
from flightd.mission.plan.flight_plan import HeadingPolicy, make_plan
from flightd.site.layout import LayoutError, lay_out
from flightd.site.site import Aisle, Pad, Site
from flightd.site.site_file import parse_site, site_toml
from flightd.site.ways import BODY_RADIUS_M, KeepOut, NoWayError, OneWay

POLICY = HeadingPolicy(Heading.ALONG)
HOME = (Pad("home", "A1", 0.5),)


def ladder(
    one_way: dict[str, OneWay] | None = None,
    blocked: tuple[tuple[str, str], ...] = (),
    keep_outs: tuple[KeepOut, ...] = (),
    one_way_crosses: tuple[tuple[str, str], ...] = (),
    pads: tuple[Pad, ...] = HOME,
) -> Site:
    """Aisles A, B, C of four nodes 2 m apart, 3 m from aisle to aisle, joined at both ends."""
    ways = one_way or {}
    aisles = [Aisle(name, 0.0, 3.0 * i, (2.0,) * 3, one_way=ways.get(name)) for i, name in enumerate("ABC")]
    crosses = [(f"{a}{end}", f"{b}{end}") for a, b in itertools.pairwise("ABC") for end in (1, 4)]
    return lay_out(
        "ladder",
        aisles,
        [
            *[c for c in crosses if c[::-1] not in one_way_crosses],
            *[c for c in one_way_crosses if c not in crosses],
        ],
        pads,
        one_way_crosses=one_way_crosses,
        blocked=blocked,
        keep_outs=keep_outs,
    )


def test_a_one_way_aisle_is_flown_in_its_direction_only() -> None:
    site = ladder({"A": OneWay.PLUS_X, "B": OneWay.MINUS_X})
    assert site.path("A1", "A3") == ("A1", "A2", "A3")
    assert site.path("A3", "A2") == ("A3", "A4", "B4", "B3", "B2", "B1", "A1", "A2")
    assert site.path("A3", "A2", against_one_way=True) == ("A3", "A2")


def test_the_serpentine_enters_one_way_aisles_at_the_right_end() -> None:
    site = ladder({"A": OneWay.PLUS_X, "B": OneWay.PLUS_X})
    route = site.serpentine_route()
    assert route == ("A1", "A2", "A3", "A4", "B1", "B2", "B3", "B4", "C4", "C3", "C2", "C1", "A1")


def test_a_one_way_cross_leads_from_its_first_node_to_its_second() -> None:
    site = ladder(one_way_crosses=(("B1", "A1"),))
    assert site.path("B1", "A1") == ("B1", "A1")
    assert site.path("A1", "B1") == ("A1", "A2", "A3", "A4", "B4", "B3", "B2", "B1")


def test_a_blocked_line_is_flown_round_even_in_need() -> None:
    site = ladder(blocked=(("A3", "A2"),))
    for in_need in (False, True):
        way = site.path("A2", "A3", against_one_way=in_need)
        assert way == ("A2", "A1", "B1", "B2", "B3", "B4", "A4", "A3")


def test_what_is_blocked_all_round_is_left_out_and_refused_by_name() -> None:
    site = ladder(blocked=(("B1", "B2"), ("B2", "B3")))
    assert site.cut_off == {"B2"}
    assert sorted(site.serpentine_route()[:-1]) == sorted(set(site.nodes) - {"B2"})
    with pytest.raises(NoWayError, match="no open way from A1 to B2"):
        make_plan(site, ["B2"], "A1", "A1", POLICY)


def test_a_keep_out_closes_the_lines_that_it_comes_near_at_its_heights() -> None:
    near = KeepOut(2.7, 0.2, 3.3, 1.0, from_m=2.0, to_m=3.0)
    site = ladder(keep_outs=(near,))
    assert site.path("A2", "A3")[1] == "A1"
    assert site.between(0.5, 1.9).path("A2", "A3") == ("A2", "A3")
    assert site.between(1.5, 2.5).path("A2", "A3")[1] == "A1"
    beside = KeepOut(2.7, 0.65, 3.3, 1.0)
    assert ladder(keep_outs=(beside,)).path("A2", "A3") == ("A2", "A3")


def test_a_line_is_open_only_where_a_gust_beside_it_leaves_the_body_free() -> None:
    gust_m = 0.26
    nearer = KeepOut(2.7, BODY_RADIUS_M + gust_m, 3.3, 1.0)
    assert ladder(keep_outs=(nearer,)).path("A2", "A3")[1] == "A1"
    assert not ladder(keep_outs=(nearer,)).is_clear((2.0, 0.0, 1.5), (4.0, 0.0, 1.5))


def test_home_is_a_pad_to_start_from() -> None:
    pads = (Pad("dock", "A1", 0.5, start=False), Pad("ramp", "C1", 0.5, charge=False))
    assert ladder(pads=pads).home.node == "C1"


@pytest.mark.parametrize(
    ("site", "words"),
    [
        (lambda: ladder(blocked=(("A1", "A3"),)), "blocked[0].nodes: no painted line joins A1 and A3"),
        (lambda: ladder(blocked=(("A1", "Z3"),)), "blocked[0].nodes: there is no node Z3"),
        (lambda: ladder(keep_outs=(KeepOut(1, 1, 1, 2),)), "keep_out[0]: is empty"),
        (lambda: ladder(keep_outs=(KeepOut(1, 1, 2, 2, 3, 2),)), "keep_out[0].from_m: 3 m"),
        (lambda: ladder(keep_outs=(KeepOut(-1, -1, 1, 1),)), "keep_out[0]: covers A1"),
        (
            lambda: ladder(dict.fromkeys("ABC", OneWay.PLUS_X)),
            "aisle[0] (A).one_way: no legal way leads from A1 to A2 and back",
        ),
        (
            lambda: ladder(blocked=(("B1", "B2"), ("B2", "B3")), pads=(*HOME, Pad("far", "B2", 0.5))),
            "pad[1] (far).node: B2 is cut off from A1",
        ),
        (lambda: ladder(pads=(Pad("home", "A1", 0.5, start=False),)), "none to start from"),
        (lambda: ladder(pads=(Pad("home", "A1", 0.5, charge=False),)), "none to charge on"),
    ],
)
def test_what_cannot_be_is_refused_by_key(site: object, words: str) -> None:
    with pytest.raises(LayoutError) as refused:
        site()  # type: ignore[operator]
    assert words in str(refused.value)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10_000))
def test_every_plan_flies_open_lines_in_their_direction(seed: int) -> None:
    site = restricted(seed)
    plan = make_plan(site, site.serpentine_route(), site.home.node, site.home.node, POLICY)
    legal = {(a, b) for edge in site.edges if not site.is_closed(edge) for a, b in directions(edge)}
    here = site.home.node
    for stop in plan.stops:
        for a, b in itertools.pairwise(site.path(here, stop.node)):
            assert (a, b) in legal
        here = stop.node
    assert {stop.node for stop in plan.stops if stop.visit} == set(site.nodes) - site.cut_off


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10_000))
def test_restrictions_are_written_and_read_back(seed: int) -> None:
    site = restricted(seed)
    assert parse_site(site_toml(site), "x.toml") == site


def directions(edge: object) -> list[tuple[str, str]]:
    both = [(edge.a, edge.b), (edge.b, edge.a)]  # type: ignore[attr-defined]
    return both[:1] if edge.one_way else both  # type: ignore[attr-defined]


def restricted(seed: int) -> Site:
    """A ladder with random restrictions that leave a way home."""
    rng = random.Random(seed)
    while True:
        plain = ladder()
        edges = [(edge.a, edge.b) for edge in plain.edges]
        crosses = [(e.b, e.a) if rng.random() < 0.5 else (e.a, e.b) for e in plain.crosses]
        x_m, y_m = rng.uniform(0, 6), rng.uniform(0, 6)
        try:
            return ladder(
                {name: rng.choice(list(OneWay)) for name in "ABC" if rng.random() < 0.4},
                tuple(pair for pair in edges if rng.random() < 0.1),
                (KeepOut(x_m, y_m, x_m + 0.5, y_m + 0.5, 0.0, rng.choice((1.0, 5.0))),),
                tuple(pair for pair in crosses if rng.random() < 0.2),
                (*HOME, Pad("far", "C4", 0.6, start=rng.random() < 0.5, charge=rng.random() < 0.5)),
            )
        except LayoutError:
            continue


def test_the_file_names_file_key_and_node() -> None:
    text = site_toml(ladder()) + '\n[[blocked]]\nnodes = ["A1", "C1"]\n'
    with pytest.raises(InputError, match=r"hall\.toml: blocked\[0\]\.nodes: no painted line joins A1 and C1"):
        parse_site(text, "hall.toml")
