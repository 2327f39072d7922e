"""The transition table over every phase and every trigger, and the plan."""

from __future__ import annotations

import itertools
import math

import pytest

from flightd.config.mission import Heading
from flightd.core.errors import InputError
from flightd.core.types import Phase
from flightd.mission.plan.flight_plan import HeadingPolicy, make_plan
from flightd.mission.safety.hazards import Action, triggers_of
from flightd.mission.transition_table import next_phase
from flightd.mission.triggers import Trigger
from flightd.sim.random_sites import random_site

FLYING = [
    p
    for p in Phase
    if p not in {Phase.PREFLIGHT, Phase.ARMING, Phase.SWAP, Phase.DONE, Phase.ABORTED, Phase.PILOT}
]


_PROGRESS = {
    (Phase.PREFLIGHT, Trigger.READY): Phase.ARMING,
    (Phase.PREFLIGHT, Trigger.FOUND_FLYING): Phase.RECOVER,
    (Phase.SWAP, Trigger.READY): Phase.ARMING,
    (Phase.HOVER, Trigger.SCAN_DUE): Phase.CLIMB,
    (Phase.CLIMB, Trigger.AT_VIEW): Phase.SCAN,
    (Phase.SCAN, Trigger.VIEW_DONE): Phase.CLIMB,
    (Phase.SCAN, Trigger.DWELLED): Phase.TURN,
    (Phase.LAND, Trigger.DOWN_TO_SWAP): Phase.SWAP,
    (Phase.ARMING, Trigger.ARMED): Phase.TAKE_OFF,
    (Phase.TAKE_OFF, Trigger.AT_HEIGHT): Phase.ACQUIRE,
    (Phase.ACQUIRE, Trigger.ACQUIRED): Phase.TURN,
    (Phase.TURN, Trigger.TURNED): Phase.FOLLOW,
    (Phase.FOLLOW, Trigger.ARRIVED): Phase.HOVER,
    (Phase.HOVER, Trigger.DWELLED): Phase.TURN,
    (Phase.HOVER, Trigger.ROUTE_DONE): Phase.LAND,
    (Phase.HOLD, Trigger.LINES_FOUND): Phase.ACQUIRE,
    (Phase.RELOCATE, Trigger.POSITION_SURE): Phase.ACQUIRE,
    (Phase.LAND, Trigger.DISARMED): Phase.DONE,
}
_SAFE = {Phase.HOLD, Phase.RELOCATE, Phase.LAND, Phase.ABORTED, Phase.PILOT}


@pytest.mark.parametrize("phase", list(Phase))
@pytest.mark.parametrize("trigger", list(Trigger))
def test_a_trigger_leads_on_as_planned_or_into_safety(phase: Phase, trigger: Trigger) -> None:
    following, taken = next_phase(phase, {trigger})
    if (phase, trigger) in _PROGRESS:
        assert following is _PROGRESS[phase, trigger]
    elif taken is not None:
        assert following in _SAFE
        assert phase not in {Phase.LAND, Phase.HOLD} or following is not Phase.HOLD, "never back to waiting"
    else:
        assert following is phase


@pytest.mark.parametrize("phase", FLYING)
def test_the_pilot_wins_over_everything_else_in_the_air(phase: Phase) -> None:
    assert next_phase(phase, set(Trigger))[0] is Phase.PILOT


@pytest.mark.parametrize("phase", [p for p in FLYING if p is not Phase.LAND])
def test_every_flying_phase_lands_on_a_critical_battery_lost_links_or_an_order(phase: Phase) -> None:
    lost = triggers_of(Action.LAND, Action.STOP) | {Trigger.GROUND_LOST, Trigger.RECORD_LOST}
    for trigger in (*lost, Trigger.LAND_HERE):
        assert next_phase(phase, {trigger})[0] is Phase.LAND


@pytest.mark.parametrize(
    "phase", [Phase.ACQUIRE, Phase.FOLLOW, Phase.HOVER, Phase.TURN, Phase.CLIMB, Phase.SCAN]
)
def test_lost_lines_hold_before_any_progress(phase: Phase) -> None:
    progress = {Trigger.ARRIVED, Trigger.DWELLED, Trigger.TURNED, Trigger.ACQUIRED, Trigger.VIEW_DONE}
    assert next_phase(phase, progress | {Trigger.LINES_LOST})[0] is Phase.HOLD


@pytest.mark.parametrize("phase", [Phase.DONE, Phase.ABORTED, Phase.PILOT])
def test_the_end_is_final(phase: Phase) -> None:
    assert next_phase(phase, set(Trigger)) == (phase, None)


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
