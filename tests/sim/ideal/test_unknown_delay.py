"""A camera's delay that nobody knows: the loop answers as fast as configured, and does not swing for it."""

from __future__ import annotations

from dataclasses import dataclass

import pytest

from flightd.config.paths import shipped
from flightd.config.schema import load_config
from flightd.core.types import Phase
from flightd.sim.plant.wind import WindParams
from flightd.sim.unknowns import Unknowns
from flightd.site.site_file import load_site
from tests.sim.ideal.ideal_flight import IdealFlight

CONFIG = load_config(shipped("sim.toml"))
SITE = load_site(shipped("site-demo.toml"))
STILL = WindParams(gust_rms_mps=0.0, vertical_gust_rms_mps=0.0)
PUSHED_MPS = 0.4
SEEN_FROM_M = 0.9
"""A take-off that saw no line until here would soon end."""
SECOND = 50
"""Ticks of one."""
OVERSHOOT = 0.3
"""A loop with 0.36 of critical damping comes back beyond its place by so much of what it was pushed aside."""


@dataclass
class Pushed:
    """How far across its line the drone was pushed, came back beyond where it was within two seconds, and was
    from there in the two after them (m); how well the delay was known a second after the first line was seen,
    or after it leapt (s)."""

    aside_m: float
    beyond_m: float
    later_m: float
    sigma_s: float


def pushed(off_s: float, phase: Phase, seed: int, *, leap_s: float = 0.0, seconds: float = 12.0) -> Pushed:
    """Pushed aside once at the beginning of that phase, by a camera that is later than configured by `off_s`
    and from then on by `leap_s` more, without a line in view until `SEEN_FROM_M`."""
    flight = IdealFlight(
        SITE, CONFIG, visits=("A2",), seed=seed, wind=STILL, unknowns=Unknowns(camera_delay_s=off_s)
    )
    across_m: list[float] = []
    heights_m: list[float] = []
    flight.faults.bare = True

    def push(now: Phase, _now_ns: int) -> None:
        heights_m.append(flight.airframe.height_m)
        flight.faults.bare = flight.faults.bare and heights_m[-1] < SEEN_FROM_M
        if not across_m and now is phase:
            flight.airframe.vy_mps += PUSHED_MPS
            flight.faults.delay_ns = round(leap_s * 1e9)
        if across_m or now is phase:
            across_m.append(flight.airframe.y_m)

    flight.on_tick = push
    result = flight.fly(seconds)
    assert not [event.text for event in result.events if event.name == "hazard" and "swings" in event.text]
    seen = next(tick for tick, height_m in enumerate(heights_m) if height_m >= SEEN_FROM_M)
    tracks = result.outputs[SECOND + (len(heights_m) - len(across_m) if leap_s else seen)].tracks
    assert tracks is not None
    after_m = [across - across_m[0] for across in across_m]
    swings_m, later_m = after_m[: 2 * SECOND], after_m[2 * SECOND : 4 * SECOND]
    assert len(later_m) == 2 * SECOND
    return Pushed(max(swings_m), -min(swings_m), max(map(abs, later_m)), tracks.sensors.delay_sigma_s)


@pytest.mark.parametrize("seed", [3, 4])
@pytest.mark.parametrize("off_s", [-0.06, 0.06])
def test_two_sigmas_of_the_delay_are_learnt_from_the_first_leans_and_damped(off_s: float, seed: int) -> None:
    found = pushed(off_s, Phase.TURN, seed)
    assert found.sigma_s < 0.01
    assert found.beyond_m < OVERSHOOT * found.aside_m


@pytest.mark.parametrize("leap_s", [-0.05, 0.05])
def test_a_delay_that_leaps_as_it_is_pushed_is_learnt_within_a_second_and_damped(leap_s: float) -> None:
    """Until the leap is found the drone is flown by a wrong speed: it comes back too far, but once."""
    found = pushed(0.0, Phase.HOVER, 3, leap_s=leap_s, seconds=16.0)
    assert found.sigma_s < 0.01
    assert found.later_m < 0.25 * found.aside_m
