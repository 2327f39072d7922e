"""A compass among steel: wrong by another angle at each place, and the estimator follows it slowly."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import pytest

from flightd.sim.plant.airframe import Airframe
from flightd.sim.sensors.instruments import SensorParams, Sensors
from flightd.sim.sensors.steel_field import SteelField

MOST_RAD = math.radians(20.0)


@pytest.mark.parametrize("seed", range(5))
def test_it_is_smooth_bounded_and_no_constant(seed: int) -> None:
    field = SteelField(MOST_RAD, seed)
    row = [field.error_rad(0.1 * x, 1.0) for x in range(400)]
    assert max(map(abs, row)) <= MOST_RAD
    assert max(row) - min(row) > 0.3 * MOST_RAD
    assert max(abs(b - a) for a, b in itertools.pairwise(row)) < math.radians(4.0)
    assert [SteelField(MOST_RAD, seed).error_rad(0.1 * x, 1.0) for x in range(400)] == row


def heading_errors(params: SensorParams, places_m: list[float], each_s: float) -> list[float]:
    airframe, sensors = Airframe(seed=3), Sensors(params, 3)
    found = []
    for x_m in places_m:
        airframe.x_m = x_m
        for _ in range(round(each_s / 0.02)):
            sensors.update(0.02, airframe)
        found.append(sensors.yaw_error_rad - params.heading_offset_rad)
    return found


def test_the_estimators_heading_comes_to_what_the_compass_reads() -> None:
    params = SensorParams(compass_rad=MOST_RAD, yaw_drift_radps=0.0)
    field = SteelField(MOST_RAD, 3)
    here, soon = heading_errors(params, [0.0, 3.0], 1.0)
    later = heading_errors(params, [0.0, 3.0], 40.0)[1]
    assert here == pytest.approx(field.error_rad(0.0, 0.0))
    assert later == pytest.approx(field.error_rad(3.0, 0.0), abs=1e-3)
    assert min(here, later) < soon < max(here, later), "not at once"


def test_without_steel_it_is_right() -> None:
    params = replace(SensorParams(), yaw_drift_radps=0.0)
    assert heading_errors(params, [0.0, 3.0], 2.0) == [0.0, 0.0]
