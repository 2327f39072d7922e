"""How high the drone rises to see more of the floor, not knowing where it is, and where it looks then."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from flightd.core.types import Phase
from flightd.mission.flight.relocation import Relocator
from flightd.mission.guidance import CEILING_MARGIN_M
from flightd.mission.triggers import Trigger
from flightd.site.site_file import parse_site
from tests.unit.mission.configured import configured
from tests.unit.mission.driven import TICK_NS, Flight

SITE = """
[site]
name = "hall"
ceiling_m = 6.0

[[aisle]]
id = "A"
x_m = 0.0
y_m = 0.0
spacing_m = [1.5]

[[pad]]
id = "home"
node = "A1"

[[keep_out]]
x0_m = 9.0
y0_m = -1.0
x1_m = 10.0
y1_m = 1.0
from_m = 2.5
"""


@pytest.mark.parametrize(
    ("flown_m", "wanted_m"), [(1.0, 2.0), (1.5, 2.2), (2.2, 2.2), (3.0, 4.0), (5.2, 5.5), (5.6, 5.6)]
)
def test_the_climb_ends_below_the_ceiling_and_below_every_keep_out_above(
    flown_m: float, wanted_m: float
) -> None:
    site = parse_site(SITE, "hall")
    relocator = Relocator(configured().mission, site.ceiling_m - CEILING_MARGIN_M, site.overhead_m)
    assert relocator.height_m(flown_m) == pytest.approx(wanted_m)
    assert relocator.raised_m(flown_m, 0.1) == pytest.approx(min(flown_m + 0.1, wanted_m))


@pytest.mark.parametrize("knows", [False, True], ids=["it may be anywhere", "the map knows a way"])
def test_it_moves_on_where_the_map_knows_a_way_and_else_back_the_way_it_came(*, knows: bool) -> None:
    config = configured().mission
    relocator, flight = Relocator(config, 5.5, ()), Flight()
    flight.to(Phase.FOLLOW)
    inputs = flight.inputs
    assert inputs.pose is not None
    x_m, y_m = inputs.pose.x_m, inputs.pose.y_m
    for tick in range(100):
        pose = replace(inputs.pose, x_m=x_m + 0.01 * tick)
        inputs = replace(inputs, now_ns=inputs.now_ns + TICK_NS, pose=pose)
        relocator.step(inputs, Phase.FOLLOW, 1.0)
    relocator.begin()
    anchor, looks = (pose.x_m, y_m), []
    inputs = replace(inputs, way_out=(0.0, 0.25) if knows else None)
    for _ in range(round(2.5 * config.expert.relocate_look_s * 1e9 / TICK_NS)):
        inputs = replace(inputs, now_ns=inputs.now_ns + TICK_NS)
        relocator.step(inputs, Phase.RELOCATE, 1.0)
        then, anchor = anchor, relocator.next_look(inputs, anchor)
        if anchor != then:
            looks.append(anchor)
    if knows:
        assert looks == [(pose.x_m, y_m + 0.25), (pose.x_m, y_m + 0.5)]
    else:
        assert len(looks) == 1, "it came only one metre"
        assert looks[0] == pytest.approx((pose.x_m - 0.6, y_m), abs=0.11)


def test_a_climb_to_look_that_is_no_longer_wanted_ends_soon() -> None:
    """As usual it would go on for 0.3 m, in rough air for more than is safe above the commanded height."""
    flight = Flight()
    flight.to(Phase.FOLLOW)
    flight.integrity = 0.5
    flight.to(Phase.RELOCATE)
    flown_m = configured().mission.height_m
    flight.run(10.0, lambda: flight.inputs.height_m > flown_m + 0.25)
    flight.integrity = 1.0
    flight.run(10.0, lambda: flight.mission.height_goal_m == flown_m)
    from_m = highest_m = flight.inputs.height_m
    for _ in range(100):
        flight.run(0.02)
        highest_m = max(highest_m, flight.inputs.height_m)
    assert 0.05 < highest_m - from_m < 0.22


@pytest.mark.parametrize("onward_m", [0.0, 1.5])
def test_at_what_lies_there_for_good_it_does_not_doubt_for_ever(onward_m: float) -> None:
    """Tape across a leg: in doubt for 5 s, sure for 2 s, in doubt again; beside it one that flies on, and
    doubts somewhere else."""
    relocator, flight = Relocator(configured().mission, 5.5, ()), Flight()
    flight.to(Phase.FOLLOW)
    told = flight.inputs
    assert told.pose is not None
    sought_s, x_m = 0.0, told.pose.x_m
    for _ in range(12):
        for phase, integrity, seconds in ((Phase.RELOCATE, 0.9, 5.0), (Phase.FOLLOW, 1.0, 2.0)):
            for tick in range(round(seconds * 1e9 / TICK_NS)):
                x_m += onward_m / seconds * 0.02 * (phase is Phase.FOLLOW)
                pose = replace(told.pose, x_m=x_m, integrity=integrity)
                told = replace(told, now_ns=told.now_ns + TICK_NS, pose=pose)
                if Trigger.POSITION_UNKNOWN in relocator.step(told, phase, 0.02 * tick):
                    assert not onward_m
                    assert sought_s == pytest.approx(configured().mission.relocate_s, abs=1.0)
                    return
                sought_s += 0.02 if phase is Phase.RELOCATE else 0.0
    assert onward_m


def test_a_way_that_was_reckoned_wrongly_or_out_of_sight_is_not_flown_back() -> None:
    flight = Flight()
    flight.to(Phase.FOLLOW)
    for spoilt in ("not", "jump", "blind", "new flight"):
        relocator, s = Relocator(configured().mission, 5.5, ()), replace(flight.inputs, way_out=None)
        assert s.pose is not None
        x_m = s.pose.x_m
        for tick in range(120):
            pose = replace(s.pose, x_m=x_m + 0.01 * tick)
            if tick == 119 and spoilt == "jump":
                pose = replace(pose, y_m=pose.y_m + 0.8)
            s = replace(s, now_ns=s.now_ns + TICK_NS, pose=pose)
            relocator.step(s, Phase.FOLLOW, 1.0)
        if spoilt == "blind":
            relocator.step(replace(s, x_age_s=0.5, y_age_s=0.5, features_age_s=0.5), Phase.HOLD, 1.0)
        if spoilt == "new flight":
            relocator.step(replace(s, pose=None), Phase.PREFLIGHT, 1.0)
        relocator.begin()
        assert s.pose is not None
        anchor = s.pose.x_m, s.pose.y_m
        later = replace(s, now_ns=s.now_ns + 5_000_000_000)
        relocator.next_look(s, anchor)
        assert (relocator.next_look(later, anchor) != anchor) is (spoilt == "not"), spoilt


@pytest.mark.parametrize("height_m", [1.5, math.nan], ids=["at a height", "at one not known"])
def test_a_position_that_jumps_is_doubted_and_forgotten_with_its_flight(height_m: float) -> None:
    relocator, flight = Relocator(configured().mission, 5.5, ()), Flight()
    flight.to(Phase.FOLLOW)
    inputs = replace(flight.inputs, height_m=height_m)
    assert inputs.pose is not None
    assert not relocator.step(inputs, Phase.FOLLOW, 1.0)
    jumped = replace(inputs, pose=replace(inputs.pose, x_m=inputs.pose.x_m + 1.5))
    assert relocator.step(jumped, Phase.FOLLOW, 1.0) == {Trigger.POSITION_DOUBTED}
    assert not relocator.step(replace(inputs, pose=None), Phase.PREFLIGHT, 1.0)
    assert not relocator.step(inputs, Phase.ACQUIRE, 1.0)
    assert relocator.shift_m == 0.0
