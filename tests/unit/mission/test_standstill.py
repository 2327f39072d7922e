"""A drone that touched the floor is held to stand until it shows that it flies."""

from __future__ import annotations

import random

import pytest

from flightd.config.mission import MissionConfig
from flightd.core.types import Attitude, LandedState, VehicleState
from flightd.mission.flight.touchdown import Standstill
from flightd.mission.guidance import MissionInputs

TICK_NS = 20_000_000
PARAMS = MissionConfig(site="site-demo.toml")


def told(tick: int, height_m: float, climb_mps: float) -> MissionInputs:
    now_ns = tick * TICK_NS
    attitude = Attitude(now_ns, 0.0, 0.0, 0.0)
    vehicle = VehicleState(
        attitude, height_m, now_ns, climb_mps, "LAND", True, True, LandedState.IN_AIR, 0.9, 12.0, now_ns
    )
    return MissionInputs(now_ns, TICK_NS * 1e-9, None, True, height_m, True, 0.0, 0.0, 0.0, vehicle)


@pytest.mark.parametrize("height_m", [0.1, 1.62])
def test_a_climb_that_wanders_on_the_floor_takes_nothing_off_it(height_m: float) -> None:
    draw, stands = random.Random(3), Standstill(PARAMS)
    climb_mps, touched = 0.0, []
    for tick in range(60):
        stands.step(told(tick, height_m + 0.35 * (60 - tick) * 0.02, -0.35), sinks=True)
    for tick in range(60, 60 + 50 * 60):
        climb_mps += 0.02 / 0.1 * -climb_mps + 0.03 * draw.gauss(0.0, 1.0)
        stands.step(told(tick, height_m, climb_mps), sinks=True)
        touched.append(stands.touches)
    assert touched.index(True) < 60
    assert all(touched[touched.index(True) :])


@pytest.mark.parametrize(("rises_mps", "height_m"), [(0.5, 0.1), (0.2, 0.1), (0.5, float("nan"))])
def test_one_that_rises_flies(rises_mps: float, height_m: float) -> None:
    stands = Standstill(PARAMS)
    for tick in range(100):
        stands.step(told(tick, height_m, 0.0), sinks=True)
    assert stands.touches
    for tick in range(100, 250):
        stands.step(told(tick, height_m + rises_mps * (tick - 100) * 0.02, rises_mps), sinks=True)
    assert not stands.touches
