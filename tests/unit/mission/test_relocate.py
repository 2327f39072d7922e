"""How high the drone rises to see more of the floor, not knowing where it is, and where it looks then."""

from __future__ import annotations

from dataclasses import replace

import pytest

from flightd.core.types import Phase
from flightd.mission.flight.relocation import Relocator
from flightd.mission.guidance import CEILING_MARGIN_M
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
