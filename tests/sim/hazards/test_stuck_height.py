"""A range finder that sticks at a low reading ends a climb long before the roof."""

from __future__ import annotations

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
    flight.faults.stuck_m = stuck_m
    flown = flight.fly(60.0)
    assert flown.phase is Phase.ABORTED
    assert "does not follow" in flown.reason
    assert max(k.height_m for _, k in flown.truth) < CONFIG.mission.height_m
    assert flown.truth[-1][1].height_m < 0.2
