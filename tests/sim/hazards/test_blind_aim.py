"""A camera that dies just above the pad: nothing is left to aim by, and it comes down at once."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from flightd.config.schema import load_config
from flightd.core.types import Phase
from flightd.sim.plant.wind import Wind, WindParams
from flightd.site.site_file import load_site
from tests.sim.ideal.ideal_flight import IdealFlight

CONFIGS = Path(__file__).parents[3] / "configs"
CONFIG = load_config(CONFIGS / "sim.toml")
SITE = load_site(CONFIGS / "site-demo.toml")
GUST_BELOW_M, AIMS_BELOW_M = 1.3, 0.9
"""What blows it off the pad begins here, and it aims again."""
WAY_M = 0.9
"""The free way to both sides of the pad: the shelves less the drone."""
DOWN_S = 3.0
"""From 0.9 m: what goes unseen for a moment, and the descent."""


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("how", ["blind", "frozen", "blank"])
def test_it_hovers_no_longer_over_its_pad_than_it_sees_it(how: str, seed: int) -> None:
    flight = IdealFlight(SITE, CONFIG, visits=("A1",), seed=seed, wind=WindParams(0.3, 0.2))
    blown: list[int] = []
    died_ns: list[int] = []

    def die(phase: Phase, now_ns: int) -> None:
        if phase is Phase.LAND and not blown and flight.airframe.height_m < GUST_BELOW_M:
            blown.append(now_ns)
            flight.airframe.wind = Wind(WindParams(1.5, 0.8, gust_rms_mps=0.3), seed)
        if phase is Phase.LAND and not died_ns and flight.airframe.height_m < AIMS_BELOW_M:
            died_ns.append(now_ns)
            setattr(flight.faults, how, True)

    flight.on_tick = die
    flown = flight.fly(120.0)
    after = [k for _, k in flown.truth if k.stamp_ns >= died_ns[0]]
    down = next(k for k in after if k.height_m < 0.12)
    off_m = math.dist((down.x_m, down.y_m), SITE.pad_centre(SITE.home))
    took_s = (down.stamp_ns - died_ns[0]) * 1e-9
    assert took_s < DOWN_S
    assert off_m < WAY_M
