"""The plan: legs along open lines, a stop at every corner, the heading flown."""

from __future__ import annotations

import itertools
import math

import pytest

from flightd.config.mission import Heading
from flightd.core.errors import InputError
from flightd.mission.plan.flight_plan import HeadingPolicy, make_plan
from flightd.sim.random_sites import random_site


def test_a_plan_stops_at_every_corner_and_ends_above_the_pad() -> None:
    site = random_site(5)
    home = site.home.node
    plan = make_plan(site, site.serpentine_route(), home, home, HeadingPolicy(Heading.ALONG))
    at = site.nodes[home]
    here = (at.x_m, at.y_m)
    for stop in plan.stops:
        assert stop.x_m == pytest.approx(here[0]) or stop.y_m == pytest.approx(here[1]), "a leg is straight"
        if (stop.x_m, stop.y_m) != here:
            assert stop.yaw_rad == pytest.approx(math.atan2(stop.y_m - here[1], stop.x_m - here[0]))
        here = (stop.x_m, stop.y_m)
    assert plan.stops[-1].node == home
    assert {stop.node for stop in plan.stops if stop.visit} == set(site.nodes)


def test_facing_the_shelf_the_nose_turns_only_with_the_shelf() -> None:
    site = random_site(5)
    home = site.home.node
    plan = make_plan(site, site.serpentine_route(), home, home, HeadingPolicy(Heading.SHELF))
    for before, stop in itertools.pairwise(plan.stops):
        here, there = site.nodes[before.node], site.nodes[stop.node]
        if here.aisle == there.aisle:
            assert abs(stop.yaw_rad) == math.pi / 2
        else:  # between aisles the longer side of the picture looks ahead
            assert stop.yaw_rad == pytest.approx(math.atan2(there.y_m - here.y_m, there.x_m - here.x_m))


def test_a_node_that_the_site_lacks_is_named() -> None:
    site = random_site(5)
    with pytest.raises(InputError, match="no node 'Q7'"):
        make_plan(site, ["Q7"], site.home.node, site.home.node, HeadingPolicy(Heading.ALONG))
