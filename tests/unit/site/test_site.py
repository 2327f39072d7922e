"""What a laid-out site promises to routes and localisation."""

import itertools
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flightd.sim.random_sites import random_site
from flightd.site.layout import CROSS_CLEARANCE_M, LayoutError, lay_out
from flightd.site.site import Aisle, Edge, Pad, PaintedLine, Side, Site

sites = st.builds(random_site, st.integers(0, 10_000))


def two_aisles() -> Site:
    return lay_out(
        "two",
        [Aisle("A", 0.0, 0.0, (1.5, 2.0)), Aisle("B", 0.0, 3.0, (1.0, 2.5))],
        [("A1", "B1"), ("B3", "A3")],
        [Pad("home", "A1", 0.5)],
    )


def test_nodes_stand_at_the_running_sum_of_the_spacings() -> None:
    site = two_aisles()
    assert [(node.id, node.x_m, node.y_m) for node in site.aisle_nodes("B")] == [
        ("B1", 0.0, 3.0),
        ("B2", 1.0, 3.0),
        ("B3", 3.5, 3.0),
    ]


def test_a_cross_and_the_own_cross_lines_of_its_nodes_are_one_stroke() -> None:
    across = [line for line in two_aisles().lines if line.x0_m == line.x1_m]
    assert across == [
        PaintedLine(0.0, -0.5, 0.0, 3.5, 0.075),
        PaintedLine(1.0, 2.5, 1.0, 3.5, 0.075),
        PaintedLine(1.5, -0.5, 1.5, 0.5, 0.075),
        PaintedLine(3.5, -0.5, 3.5, 3.5, 0.075),
    ]


def test_shelves_leave_the_crosses_free() -> None:
    site = two_aisles()
    between = [shelf for shelf in site.shelves if 0.0 < shelf.y_m < 3.0]
    assert {(shelf.aisle, shelf.side) for shelf in between} == {("A", Side.RIGHT), ("B", Side.LEFT)}
    for shelf in between:
        assert shelf.x0_m >= CROSS_CLEARANCE_M - 1e-9
        assert shelf.x1_m <= 3.5 - CROSS_CLEARANCE_M + 1e-9
    assert len(site.shelves) == 4


def test_nearest_node_and_neighbours() -> None:
    site = two_aisles()
    assert site.nearest(1.2, 0.4).id == "A2"
    assert site.neighbours("A1") == ("A2", "B1")
    with pytest.raises(KeyError):
        site.neighbours("Z9")


def test_the_shortest_way_counts_metres_not_nodes() -> None:
    long_way = Aisle("A", 0.0, 0.0, (9.0,), shelves=())
    dense = Aisle("B", 0.0, 2.0, (3.0, 3.0, 3.0), shelves=())
    site = lay_out("ways", [long_way, dense], [("A1", "B1"), ("A2", "B4")], [Pad("home", "A1", 0.5)])
    assert site.path("A1", "A2") == ("A1", "A2")
    assert site.path("B1", "B4") == ("B1", "B2", "B3", "B4")  # 9 m and three edges, not 13 m and three


def test_serpentine_of_two_aisles_turns_at_the_far_end_and_ends_at_home() -> None:
    assert two_aisles().serpentine_route() == ("A1", "A2", "A3", "B3", "B2", "B1", "A1")


def test_home_in_the_middle_aisle_does_the_shorter_side_first() -> None:
    aisles = [Aisle(name, 0.0, 3.0 * i, (2.0,)) for i, name in enumerate("ABCD")]
    crosses = [(f"{a}{i}", f"{b}{i}") for a, b in itertools.pairwise("ABCD") for i in (1, 2)]
    site = lay_out("four", aisles, crosses, [Pad("home", "B1", 0.5)])
    assert site.serpentine_route() == ("B1", "B2", "A2", "A1", "C1", "C2", "D2", "D1", "B1")


@settings(max_examples=60, deadline=None)
@given(sites)
def test_the_serpentine_visits_every_node_once_and_expands_to_neighbours(site: Site) -> None:
    route = site.serpentine_route()
    assert route[0] == route[-1] == site.home.node
    assert sorted(route[:-1]) == sorted(site.nodes)
    for a, b in itertools.pairwise(site.expand(route)):
        assert b in site.neighbours(a)


@settings(max_examples=60, deadline=None)
@given(sites, st.data())
def test_paths_are_as_short_as_relaxing_every_edge_finds(site: Site, data: st.DataObject) -> None:
    names = st.sampled_from(sorted(site.nodes))
    start, goal = data.draw(names), data.draw(names)
    best_m = dict.fromkeys(site.nodes, math.inf) | {start: 0.0}
    for _ in site.nodes:  # Bellman-Ford
        for edge in site.edges:
            step_m = site.distance_m(edge.a, edge.b)
            best_m[edge.a] = min(best_m[edge.a], best_m[edge.b] + step_m)
            best_m[edge.b] = min(best_m[edge.b], best_m[edge.a] + step_m)
    way = site.path(start, goal)
    assert (way[0], way[-1]) == (start, goal)
    assert site.length_m(way) == pytest.approx(best_m[goal])


@settings(max_examples=60, deadline=None)
@given(sites)
def test_every_edge_lies_on_paint(site: Site) -> None:
    for edge in site.edges:
        a, b = site.nodes[edge.a], site.nodes[edge.b]
        x_m, y_m = (a.x_m + b.x_m) / 2, (a.y_m + b.y_m) / 2
        assert any(
            min(line.x0_m, line.x1_m) - 0.01 <= x_m <= max(line.x0_m, line.x1_m) + 0.01
            and min(line.y0_m, line.y1_m) - 0.01 <= y_m <= max(line.y0_m, line.y1_m) + 0.01
            for line in site.lines
        ), edge


def test_a_random_site_is_the_same_for_the_same_seed() -> None:
    assert random_site(7) == random_site(7)
    assert random_site(7) != random_site(8)


def test_random_sites_have_unequal_spacings_and_all_colours() -> None:
    many = [random_site(seed) for seed in range(60)]
    assert all(any(len(set(aisle.spacing_m)) > 1 for aisle in site.aisles) for site in many)
    assert {site.line_colour for site in many} == {"yellow", "white", "red", "blue"}
    assert sum(site.line_colour == "yellow" for site in many) > len(many) / 2


A, B = Aisle("A", 0.0, 0.0, (2.0, 2.0)), Aisle("B", 0.0, 3.0, (1.5, 2.5))
HOME = (Pad("home", "A1", 0.5),)


@pytest.mark.parametrize(
    ("aisles", "crosses", "pads", "words"),
    [
        ((), (), HOME, "there is none"),
        ((A, A), (), HOME, "taken"),
        ((A, B), (), HOME, "aisle B cannot be reached from A1; add a [[cross]]"),
        ((A, B), (("A2", "B2"),), HOME, "not be square"),
        ((A, B), (("A1", "A2"),), HOME, "in one aisle"),
        ((A, B), (("A1", "B9"),), HOME, "no node B9"),
        ((A, B), (("A1", "B1"), ("B1", "A1")), HOME, "already joined"),
        ((A, B), (("A1", "B1"),), (), "[[pad]]"),
        ((A, B), (("A1", "B1"),), (Pad("home", "Q1", 0.5),), "no node Q1"),
        ((A, B), (("A1", "B1"),), (*HOME, Pad("home", "A2", 0.5)), "taken"),
        ((A, Aisle("B", 0.0, 1.0, (1.5,))), (("A1", "B1"),), HOME, "cross lines need"),
        ((A, Aisle("B", 0.0, 2.0, (1.5,))), (("A1", "B1"),), HOME, "shelves need"),
        ((Aisle("A", 0.0, 0.0, (0.2,)),), (), HOME, "too close"),
        ((Aisle("A", 0.0, 0.0, (2.0,), cross_half_m=0.05),), (), HOME, "does not show"),
        ((Aisle("A", 0.0, 0.0, (2.0,), cross_half_m=1.5),), (), HOME, "into the shelf"),
        ((Aisle("A", 0.0, 0.0, (2.0,), shelf_height_m=9.0),), (), HOME, "above the ceiling"),
        ((A, B, Aisle("C", 0.0, 6.0, (2.0,))), (("A1", "C1"),), HOME, "runs over aisle B"),
    ],
)
def test_a_floor_that_cannot_be_is_refused_by_name(
    aisles: tuple[Aisle, ...], crosses: tuple[tuple[str, str], ...], pads: tuple[Pad, ...], words: str
) -> None:
    with pytest.raises(LayoutError) as refused:
        lay_out("bad", aisles, crosses, pads, ceiling_m=6.0)
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)


def test_crosses_are_kept_left_to_right() -> None:
    assert two_aisles().crosses == (Edge("A1", "B1"), Edge("A3", "B3"))
