"""A range finder that sticks at a low reading ends a climb long before the roof.  `FLIGHTD_SEEDS=5` flies it
with so many noises."""

from __future__ import annotations

import math
import os
import random
from collections.abc import Callable
from pathlib import Path

import pytest

from flightd.config.schema import load_config
from flightd.core.types import Phase
from flightd.site.site_file import load_site
from tests.sim.ideal.ideal_flight import IdealFlight

CONFIGS = Path(__file__).parents[3] / "configs"
CONFIG = load_config(CONFIGS / "sim.toml")
SITE = load_site(CONFIGS / "site-demo.toml")
SEEDS = range(1, 1 + int(os.environ.get("FLIGHTD_SEEDS", "1")))


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("stuck_m", [0.1, 0.4])
def test_a_take_off_by_a_stuck_height_ends_within_a_second_of_climb(stuck_m: float, seed: int) -> None:
    flight = IdealFlight(SITE, CONFIG, visits=("A2",), seed=seed)
    flight.faults.misread = lambda _: stuck_m
    flown = flight.fly(60.0)
    assert flown.phase is Phase.ABORTED
    assert "does not follow" in flown.reason
    assert max(k.height_m for _, k in flown.truth) < CONFIG.mission.height_m
    assert flown.truth[-1][1].height_m < 0.2


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize(
    "misread",
    [
        pytest.param(lambda height_m, draw: draw.choice((0.1, 0.22)), id="swings"),
        pytest.param(lambda height_m, draw: 0.35 * height_m, id="follows by a third"),
        pytest.param(lambda height_m, draw: 0.5 * height_m, id="follows by half"),
    ],
)
def test_a_take_off_by_a_height_that_moves_but_does_not_follow_ends_below_the_roof(
    misread: Callable[[float, random.Random], float], seed: int
) -> None:
    flight, draw = IdealFlight(SITE, CONFIG, visits=("A2",), seed=seed), random.Random(seed)
    flight.faults.misread = lambda height_m: misread(height_m, draw)
    flight.faults.bare = True  # no width of a line tells
    flown = flight.fly(60.0)
    assert flown.phase is Phase.ABORTED
    assert "does not follow" in flown.reason
    assert max(k.height_m for _, k in flown.truth) < CONFIG.mission.height_m + 0.5
    assert flown.truth[-1][1].height_m < 0.2


@pytest.mark.parametrize("share", [0.8, 0.85])
def test_a_range_finder_that_reads_a_fifth_too_little_from_the_floor_on_is_found_by_the_lines(
    share: float,
) -> None:
    """It follows the climb, so that only the width of the lines contradicts it."""
    flight = IdealFlight(SITE, CONFIG, visits=("A2",), seed=1)
    flight.faults.misread = lambda height_m: share * height_m
    flown = flight.fly(60.0)
    assert flown.phase is Phase.ABORTED
    assert max(k.height_m for _, k in flown.truth) < CONFIG.mission.height_m + 0.5
    assert flown.truth[-1][1].height_m < 0.2


@pytest.mark.parametrize(("stuck_m", "fps"), [(0.1, 30), (0.1, 15), (1.0, 20)])
def test_a_sonar_that_sticks_and_tells_the_climb_too_is_found_by_the_lines(stuck_m: float, fps: int) -> None:
    """Height and climb rate agree, as an AR.Drone's do: they are of the same sensor."""
    flight = IdealFlight(SITE, CONFIG, visits=("A2",), seed=1)
    flight.frame_ns = round(1e9 / fps)
    flight.faults.misread = lambda height_m: min(height_m, stuck_m)
    flight.faults.climb_by_range = True
    flown = flight.fly(60.0)
    assert flown.phase is Phase.ABORTED
    assert max(k.height_m for _, k in flown.truth) < CONFIG.mission.height_m + 0.5
    assert flown.truth[-1][1].height_m < 0.2


@pytest.mark.parametrize(
    ("error_mps", "lasts_s", "over_m"), [(-0.5, 10.0, 0.5), (-1.0, 3.0, 0.6), (-0.8, 14.0, 0.5)]
)
def test_an_autopilot_whose_barometer_is_misled_is_kept_at_its_height_and_landed(
    error_mps: float, lasts_s: float, over_m: float
) -> None:
    """It flies by what it believes: without a word against it, ever higher.  The error grows by 2 m/s2, as
    that of an accelerometer that is shaken into its stops."""
    flight = IdealFlight(SITE, CONFIG, visits=("A2",), seed=1)
    left_ns: list[int] = []

    def drift(_: Phase, now_ns: int) -> None:
        if flight.airframe.height_m > 0.8:
            left_ns.append(now_ns)
        since_s = (now_ns - left_ns[0]) * 1e-9 if left_ns else math.inf
        on = since_s < lasts_s
        flight.sensors.fault.climb_drift_mps = max(error_mps, -2.0 * since_s) if on else 0.0
        flight.faults.bare = bool(left_ns) and flight.airframe.height_m < 0.3  # no line is wide enough there
        flight.faults.landing_unreported = on  # by what it believes to climb it does not stand

    flight.on_tick = drift
    flown = flight.fly(60.0)
    assert flown.phase is Phase.ABORTED
    heights_m = [k.height_m for phase, k in flown.truth if phase is not Phase.TAKE_OFF]
    assert max(heights_m) < CONFIG.mission.height_m + over_m
    down = next(i for i, (phase, k) in enumerate(flown.truth) if phase is Phase.LAND and k.height_m < 0.13)
    assert max(k.height_m for _, k in flown.truth[down:]) < 0.2, "down is down"
    assert flown.truth[-1][1].height_m < 0.2
