"""Whole missions flown by ideal sight: the closed loop behind the pixels."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from flightd.config.mission import Heading
from flightd.config.schema import load_config
from flightd.core.types import Phase
from flightd.sim.plant.wind import WindParams
from flightd.sim.random_sites import random_site
from flightd.site.site_file import load_site
from tests.sim.ideal.ideal_flight import Flown, IdealFlight, rms_off_line

CONFIGS = Path(__file__).parents[3] / "configs"
CONFIG = load_config(CONFIGS / "sim.toml").with_values(mission={"dwell_s": 0.5})
DEMO = load_site(CONFIGS / "site-demo.toml")
NEAR = ("A1", "A2", "A3")
ROUND = ("A2", "A3", "B3")
"""Whole routes are flown at the random site."""
CORNER = ("A2", "A1", "B1", "B2")
"""Nodes of both aisles, and the way between them."""


def landed_error(flown: Flown) -> float:
    site, k = DEMO, flown.truth[-1][1]
    pad = site.nodes[site.home.node]
    return math.hypot(k.x_m - pad.x_m, k.y_m - pad.y_m)


@pytest.mark.parametrize(("heading", "visits"), [(Heading.ALONG, ROUND), (Heading.SHELF, CORNER)])
def test_a_mission_visits_every_node_on_the_line_and_lands_on_the_pad(
    heading: Heading, visits: tuple[str, ...]
) -> None:
    flight = IdealFlight(DEMO, CONFIG.with_values(mission={"heading": heading}), visits=visits, seed=11)
    flown = flight.fly()
    assert (flown.phase, flown.reason) == (Phase.DONE, "landed on the pad")
    assert flown.visited == list(visits)
    assert rms_off_line(flown, DEMO) <= 0.05
    assert landed_error(flown) <= 0.15


def test_a_random_site_is_flown_too() -> None:
    site = random_site(8)
    flown = IdealFlight(site, CONFIG, seed=3).fly(900)
    assert flown.phase is Phase.DONE
    assert flown.visited == list(site.serpentine_route())
    assert rms_off_line(flown, site) <= 0.05


def test_lines_lost_make_it_level_hold_and_land() -> None:
    flight = IdealFlight(DEMO, CONFIG, visits=NEAR, wind=WindParams(gust_rms_mps=0.0))
    lost_ns: list[int] = []
    step = flight.pilot.step

    def watch(tick):  # type: ignore[no-untyped-def]
        output = step(tick)
        if output.phase is Phase.FOLLOW and not lost_ns and output.goal == "A2":
            flight.faults.blind = True
            lost_ns.append(tick.now_ns)
        return output

    flight.pilot.step = watch  # type: ignore[method-assign]
    flown = flight.fly()
    held = [o for o in flown.outputs if o.phase is Phase.HOLD]
    first = held[0]
    assert first.setpoint is not None
    assert (first.setpoint.stamp_ns - lost_ns[0]) * 1e-9 < 0.45
    lost_at = next(k for o, (_, k) in zip(flown.outputs, flown.truth, strict=True) if o is first)
    at_rest = next(k for o, (_, k) in zip(flown.outputs, flown.truth, strict=True) if o is held[60])
    assert math.hypot(at_rest.vx_mps, at_rest.vy_mps) < 0.15
    assert math.hypot(at_rest.x_m - lost_at.x_m, at_rest.y_m - lost_at.y_m) < 1.0
    still = [o.setpoint for o in flown.outputs if o.phase is Phase.LAND]
    for setpoint in still[20:]:
        assert setpoint is not None
        assert max(abs(setpoint.roll_rad), abs(setpoint.pitch_rad)) < math.radians(2.1), "trim only"
        assert setpoint.yaw_rate_radps == 0.0
    assert len(held) + len(still) < 50 * 3.5, "what is not seen is not waited for in the air"
    assert flown.phase is Phase.ABORTED
    assert not flight.airframe.height_m > 0.2


def test_the_pilot_taking_over_ends_the_stream_at_once() -> None:
    flight = IdealFlight(DEMO, CONFIG, visits=NEAR)
    step = flight.pilot.step

    def watch(tick):  # type: ignore[no-untyped-def]
        if flight.pilot.mission.phase is Phase.HOVER:
            flight.in_control = False
        return step(tick)

    flight.pilot.step = watch  # type: ignore[method-assign]
    flown = flight.fly(60)
    assert flown.phase is Phase.PILOT
    assert flown.outputs[-1].setpoint is None
