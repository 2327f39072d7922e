"""A drone that touched the floor is held to stand until it shows that it flies."""

from __future__ import annotations

import math
import random
from dataclasses import replace

import pytest

from flightd.config.mission import MissionConfig
from flightd.core.types import Attitude, AttitudeSetpoint, Demand, LandedState, Phase, VehicleState
from flightd.mission.flight.touchdown import ReckonedHeight, Standstill, UnheardDescent
from flightd.mission.guidance import MissionInputs, Warnings
from flightd.mission.machine import Intent, State
from tests.unit.mission.states import fresh

TICK_NS = 20_000_000
PARAMS = MissionConfig(site="site-demo.toml")


def told(
    tick: int, height_m: float, climb_mps: float, roll_rad: float = 0.0, wanted_rad: float = 0.0
) -> MissionInputs:
    now_ns = tick * TICK_NS
    attitude = Attitude(now_ns, roll_rad, 0.0, 0.0)
    vehicle = VehicleState(
        attitude, height_m, now_ns, climb_mps, "LAND", True, True, LandedState.IN_AIR, 0.9, 12.0, now_ns
    )
    return MissionInputs(
        now_ns,
        TICK_NS * 1e-9,
        None,
        True,
        height_m,
        True,
        0.0,
        0.0,
        0.0,
        vehicle,
        commanded=AttitudeSetpoint(now_ns, wanted_rad, 0.0),
    )


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


def test_one_that_the_floor_keeps_at_its_height_stands_though_it_tells_a_climb() -> None:
    """0.2 m/s down, told on the floor for a second and more."""
    stands = Standstill(PARAMS)
    for tick in range(100):
        height_m = max(0.4 - 0.2 * tick * 0.02, 0.1)
        stands.step(told(tick, height_m, -0.2), sinks=True)
        assert not (stands.touches and height_m > 0.15)
    for tick in range(100, 130):
        stands.step(told(tick, 0.1, -0.2), sinks=True)
    assert stands.touches


def test_a_height_that_the_lines_contradicted_in_this_landing_tells_nothing_of_the_floor() -> None:
    """Told to be at the floor already, it sinks on from a metre above it, out of sight of the lines."""
    stands = Standstill(PARAMS)
    stands.begin()
    for tick in range(160):
        height_m, climb_mps = (0.3, 0.02) if tick < 30 else (max(0.3 - 0.004 * (tick - 30), 0.1), -0.2)
        warnings = Warnings(height_doubted=tick < 60, height_error_m=-0.7)
        stands.step(replace(told(tick, height_m, climb_mps), warnings=warnings), sinks=True)
        assert not stands.touches
    for tick in range(160, 190):
        stands.step(told(tick, 0.1, 0.0), sinks=True)
    assert stands.touches


def test_the_height_to_slow_down_at_is_that_of_the_lines_where_they_contradict_the_told_one() -> None:
    reckoned, wrong = ReckonedHeight(), Warnings(height_doubted=True, height_error_m=-0.7)
    reckoned.step(told(0, 1.0, -0.35))
    assert reckoned.least_m == 1.0
    reckoned.step(replace(told(1, 0.29, -0.35), warnings=wrong))
    assert reckoned.least_m == pytest.approx(0.99)
    reckoned.step(replace(told(2, 0.29, -0.35), warnings=replace(wrong, height_doubted=False)))
    assert reckoned.least_m == 0.29, "an error that is not sure is none"


def test_a_range_finder_that_sticks_at_the_floor_makes_no_hover_a_standstill() -> None:
    stands = Standstill(PARAMS)
    stuck = Warnings(height_stuck=True)
    for tick in range(100):
        sinks = tick >= 80  # and has not begun to
        stands.step(replace(told(tick, 0.1, 0.02), warnings=stuck), sinks=sinks)
        assert not stands.touches
    for tick in range(100, 130):
        stands.step(replace(told(tick, 0.1, -0.2), warnings=stuck), sinks=True)
        assert not stands.touches
    for tick in range(130, 160):
        stands.step(replace(told(tick, 0.1, 0.0), warnings=stuck), sinks=True)
    assert stands.touches


def test_what_stands_and_tells_a_climb_that_is_known_to_be_wrong_stands() -> None:
    stands = Standstill(PARAMS)
    misled = Warnings(climb_wrong=True, climb_error_mps=-0.8)
    for tick in range(60):
        still_s = stands.step(replace(told(tick, 0.1, -0.8), warnings=misled), sinks=True)
    assert stands.touches
    assert still_s > 1.0


@pytest.mark.parametrize(("error_mps", "lands_itself"), [(0.0, True), (0.8, True), (-0.8, False)])
def test_what_would_rise_by_itself_off_the_floor_is_not_asked_to_land_by_itself(
    error_mps: float, lands_itself: bool
) -> None:
    flight = fresh(State(Phase.FOLLOW, Intent.VISIT))
    flight.set(landed=LandedState.IN_AIR, warnings=Warnings(climb_wrong=True, climb_error_mps=error_mps))
    flight.run(0.02, follow=False)
    assert flight.phase is Phase.LAND
    flight.set(height_m=0.1, climb_mps=error_mps)
    demands = []
    for _ in range(round(6.0 * 50)):
        flight.run(0.02, follow=False)
        demands.append(flight.demand)
    assert demands[-1] is Demand.DISARM
    assert (Demand.LAND in demands) == lands_itself


@pytest.mark.parametrize(("rises_mps", "height_m"), [(0.5, 0.1), (0.2, 0.1), (0.5, float("nan"))])
def test_one_that_rises_flies(rises_mps: float, height_m: float) -> None:
    stands = Standstill(PARAMS)
    for tick in range(150):
        stands.step(told(tick, height_m, 0.0), sinks=True)
    assert stands.touches
    for tick in range(150, 300):
        stands.step(told(tick, height_m + rises_mps * (tick - 150) * 0.02, rises_mps), sinks=True)
    assert not stands.touches


def test_what_does_not_follow_a_lean_stands_whatever_its_sensors_tell() -> None:
    stands = Standstill(PARAMS)
    for tick in range(100):
        stands.step(told(tick, math.nan, 0.22, 0.005 * (tick % 2), 0.07), sinks=True)
        assert stands.touches == (tick * 0.02 > 0.4)


def test_what_follows_its_lean_late_flies() -> None:
    """The autopilot's lag and the telemetry's delay are 0.3 s of a swing."""
    stands = Standstill(PARAMS)
    for tick in range(500):
        wanted, roll = (
            math.radians(8.0) * math.sin(math.tau * (tick * 0.02 - late) / 1.5) for late in (0.0, 0.3)
        )
        stands.step(told(tick, math.nan, 0.22, roll, wanted), sinks=True)
        assert not stands.touches


def test_one_that_stops_to_aim_over_its_pad_is_not_taken_to_stand() -> None:
    """Its climb begins late once it sinks again, as a real height loop's does."""
    stands = Standstill(PARAMS)
    for tick in range(100):
        stands.step(told(tick, 1.6 - 0.007 * tick, -0.35), sinks=True)
    for tick in range(100, 150):
        stands.step(told(tick, 0.85, 0.0), sinks=False)
    for tick in range(150, 175):
        stands.step(told(tick, 0.85, -0.05), sinks=True)
        assert not stands.touches


def test_one_that_was_wrongly_taken_to_touch_is_steered_again_when_it_is_kept_up() -> None:
    stands = Standstill(PARAMS)
    for tick in range(40):
        stands.step(told(tick, 0.85, -0.05, 0.0, 0.07), sinks=True)
    assert stands.touches
    for tick in range(40, 70):
        stands.step(told(tick, 0.85, 0.0), sinks=False)
    assert not stands.touches


def test_one_that_sinks_slowly_without_a_height_flies() -> None:
    stands = Standstill(PARAMS)
    for tick in range(30):
        stands.step(told(tick, math.nan, -0.05, 0.0, 0.07), sinks=True)
    assert stands.touches
    for tick in range(30, 130):
        stands.step(told(tick, math.nan, -0.2), sinks=True)
    assert not stands.touches


@pytest.mark.parametrize(("sinks_s", "stands"), [(3.0, False), (5.5, True)])
def test_one_that_is_not_heard_stands_once_it_must_have_sunk_to_the_floor(
    sinks_s: float, stands: bool
) -> None:
    unheard = UnheardDescent(PARAMS)
    assert not unheard.step(told(0, 1.5, 0.0), 0.0)
    silent = replace(told(1, math.nan, 0.0), telemetry_age_s=3.0)
    steps = [unheard.step(silent, 0.35) for _ in range(round(sinks_s / 0.02))]
    assert steps[-1] is stands
    assert not unheard.step(told(2, 0.9, 0.0), 0.35), "it is heard again"
