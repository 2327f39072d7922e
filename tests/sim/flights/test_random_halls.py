"""Halls that nobody tuned anything for are flown to their first scan; `random_halls` flies more of them."""

from __future__ import annotations

from pathlib import Path

import pytest

from flightd.sim.scenario.scenario import Scenario
from tests.rigs.small_camera import with_small_camera
from tests.sim.flights.random_halls import fly_to_first_scan

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("seed", [10, 38])
def test_a_random_hall_is_flown_to_its_first_scan(seed: int, tmp_path: Path) -> None:
    flown = fly_to_first_scan(seed, tmp_path, with_small_camera(Scenario()))
    assert flown.scanned, f"{flown.ended}; flightd map new {flown.options}"
