"""The order of a route: against the exact optimum, over closed lines, and how its cost grows."""

from __future__ import annotations

import itertools
import random
import string
import time

import numpy as np
import pytest

from flightd.config.mission import Heading
from flightd.mission.plan.flight_plan import HeadingPolicy, make_plan
from flightd.mission.plan.leg_times import Legs, Pace
from flightd.mission.plan.route_optimiser import best_order
from flightd.sim.random_sites import random_site
from flightd.site.layout import lay_out
from flightd.site.site import Aisle, Pad, Site
from flightd.site.ways import NoWayError, OneWay
from tests.unit.mission.configured import configured

PACE = Pace.of(configured().mission)


def hall(aisles: int, nodes: int, one_way: bool = False) -> Site:
    """Equal aisles joined at both ends, neighbouring ones one-way in turn where wanted."""
    names = [a + b for a in string.ascii_uppercase for b in string.ascii_uppercase][:aisles]
    ways = itertools.cycle([OneWay.PLUS_X, OneWay.MINUS_X] if one_way else [None])
    return lay_out(
        "hall",
        [Aisle(n, 0.0, 3.0 * i, (1.5,) * (nodes - 1), one_way=next(ways)) for i, n in enumerate(names)],
        [(f"{a}{end}", f"{b}{end}") for a, b in itertools.pairwise(names) for end in (1, nodes)],
        [Pad("home", "AA1", 0.5)],
    )


def exact_s(legs: Legs, visits: list[str], start: str, home: str | None, quarter: int) -> float:
    """The shortest tour's time, by dynamic programming over the sets of visits (Held and Karp), with the
    heading in which the last one was reached."""
    travel = legs.travel(list(dict.fromkeys([start, *visits, *([home] if home else [])])))
    row = {node: i for i, node in enumerate(travel.nodes)}

    def leg(a: str, b: str, turned: int) -> tuple[float, int]:
        i, j = row[a], row[b]
        turn_s = legs.turn_s[turned, travel.departs[i, j]]
        return float(travel.time_s[i, j] + turn_s), int(travel.arrives[i, j])

    best: dict[tuple[frozenset[str], str, int], float] = {(frozenset(), start, quarter): 0.0}
    for _ in visits:
        longer: dict[tuple[frozenset[str], str, int], float] = {}
        for (done, here, turned), seconds in best.items():
            for there in set(visits) - done:
                more_s, arrived = leg(here, there, turned)
                key = (done | {there}, there, arrived)
                longer[key] = min(longer.get(key, np.inf), seconds + more_s)
        best = longer
    return min(s + (leg(here, home, turned)[0] if home else 0.0) for (_, here, turned), s in best.items())


def tour_s(legs: Legs, nodes: tuple[str, ...], quarter: int) -> float:
    """Time of a tour, leg by leg."""
    travel = legs.travel(list(dict.fromkeys(nodes)))
    row = {node: i for i, node in enumerate(travel.nodes)}
    total = 0.0
    for a, b in itertools.pairwise(nodes):
        i, j = row[a], row[b]
        total += travel.time_s[i, j] + legs.turn_s[quarter, travel.departs[i, j]]
        quarter = int(travel.arrives[i, j])
    return float(total)


def instance(seed: int) -> tuple[Site, HeadingPolicy, list[str], str | None]:
    rng = random.Random(f"route {seed}")
    site = hall(4, 5, one_way=True) if seed % 4 == 0 else random_site(seed)
    policy = HeadingPolicy(rng.choice(list(Heading)), rng.random() < 0.5)
    others = sorted(set(site.nodes) - {site.home.node})
    visits = rng.sample(others, min(len(others), rng.randint(2, 8) if seed % 10 else 10))
    home = rng.choice(
        [site.home.node, None, rng.choice([node for node in others if node not in visits] or [None])]
    )
    return site, policy, visits, home


@pytest.mark.parametrize("first", range(0, 60, 10))
def test_small_tours_are_within_a_twentieth_of_the_exact_optimum(first: int) -> None:
    for seed in range(first, first + 10):
        site, policy, visits, home = instance(seed)
        legs = Legs(site, policy, PACE)
        tour = best_order(legs, visits, site.home.node, home, 0)
        assert sorted(tour.nodes) == sorted([site.home.node, *visits, *([home] if home else [])])
        assert tour.seconds == pytest.approx(tour_s(legs, tour.nodes, 0))
        assert tour.seconds <= 1.05 * exact_s(legs, visits, site.home.node, home, 0), seed


@pytest.mark.parametrize("one_way", [False, True])
def test_a_large_tour_visits_everything_and_is_no_longer_than_the_serpentine(one_way: bool) -> None:
    site = hall(8, 12, one_way)
    legs = Legs(site, HeadingPolicy(Heading.ALONG), PACE)
    given = site.serpentine_route()
    shuffled = random.Random(1).sample(given[:-1], len(given) - 1)
    tour = best_order(legs, shuffled, "AA1", "AA1", 0)
    assert sorted(tour.nodes[:-1]) == sorted(site.nodes)
    assert tour.seconds <= tour_s(legs, given, 0) + 1e-6


def test_the_same_input_gives_the_same_order() -> None:
    site = random_site(5)
    legs = Legs(site, HeadingPolicy(Heading.SHELF), PACE)
    assert len({best_order(legs, sorted(site.nodes), "A1", "A1").nodes for _ in range(3)}) == 1


def test_a_stop_behind_closed_lines_is_refused() -> None:
    aisles = [Aisle("A", 0.0, 0.0, (2.0, 2.0)), Aisle("B", 0.0, 3.0, (2.0, 2.0))]
    pads = [Pad("home", "A1", 0.5)]
    site = lay_out("cut", aisles, [("A1", "B1")], pads, blocked=[("B1", "B2")])
    with pytest.raises(NoWayError, match="from A1 to B2"):
        best_order(Legs(site, HeadingPolicy(Heading.ALONG), PACE), ["A2", "B2"], "A1", "A1")


def test_times_of_the_legs_are_those_that_the_profile_needs() -> None:
    site = hall(2, 4)
    legs = Legs(site, HeadingPolicy(Heading.ALONG), PACE)
    p = configured().mission
    ramp_s = p.speed_mps / p.accel_mps2
    straight_s = 4.5 / p.speed_mps + ramp_s + p.settle_s
    travel = legs.travel(["AA1", "AA4", "AB4"])
    assert travel.time_s[0, 1] == pytest.approx(straight_s)
    corner_s = legs.turn_s[0, 1] + 3.0 / p.speed_mps + ramp_s + p.settle_s
    assert travel.time_s[0, 2] == pytest.approx(straight_s + corner_s)
    plan = make_plan(site, ["AB4"], "AA1", "AA1", HeadingPolicy(Heading.ALONG))
    assert [stop.node for stop in plan.stops][:2] == ["AA4", "AB4"]


def test_planning_grows_no_faster_than_with_the_square_of_the_nodes() -> None:
    def cpu_s(site: Site) -> float:
        legs = Legs(site, HeadingPolicy(Heading.ALONG), PACE)
        began = time.process_time()
        best_order(legs, list(site.nodes), "AA1", "AA1", 0)
        return time.process_time() - began

    few, many = hall(8, 10), hall(16, 20)
    ratio = min(cpu_s(many) for _ in range(2)) / min(cpu_s(few) for _ in range(4))
    assert ratio < 2.5 * (len(many.nodes) / len(few.nodes)) ** 2
