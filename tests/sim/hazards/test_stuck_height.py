"""A range finder that sticks at a low reading ends a climb long before the roof."""

from __future__ import annotations

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


@pytest.mark.parametrize("seed", range(1, 6))
@pytest.mark.parametrize("stuck_m", [0.1, 0.4])
def test_a_take_off_by_a_stuck_height_ends_within_a_second_of_climb(stuck_m: float, seed: int) -> None:
    flight = IdealFlight(SITE, CONFIG, visits=("A2",), seed=seed)
    flight.faults.misread = lambda _: stuck_m
    flown = flight.fly(60.0)
    assert flown.phase is Phase.ABORTED
    assert "does not follow" in flown.reason
    assert max(k.height_m for _, k in flown.truth) < CONFIG.mission.height_m
    assert flown.truth[-1][1].height_m < 0.2


@pytest.mark.parametrize("seed", range(1, 4))
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
