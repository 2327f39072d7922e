"""PID, reference profile and limits: what they promise for any input."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flightd.config.control import ControlConfig, PidGains
from flightd.control.flight_controller import Conditions, FlightController, Motion, Reference
from flightd.control.motion_profile import Profile
from flightd.control.pid import Pid
from flightd.core.geometry import GRAVITY_MPS2

GAINS = PidGains(kp=2.0, ki=1.0, kd=1.0)
INTEGRAL_LIMIT, OUTPUT_LIMIT = 0.5, 1.0
finite = st.floats(-1e3, 1e3)


@given(st.lists(st.tuples(finite, finite, st.floats(1e-3, 0.1)), max_size=50))
def test_output_and_integral_never_exceed_their_limits(steps: list[tuple[float, float, float]]) -> None:
    pid = Pid(GAINS, INTEGRAL_LIMIT, OUTPUT_LIMIT)
    for error, rate, dt in steps:
        assert abs(pid.step(error, rate, dt)) <= OUTPUT_LIMIT
        assert abs(pid.integral) <= INTEGRAL_LIMIT


def test_the_integral_takes_a_steady_disturbance_out() -> None:
    pid, position, velocity = Pid(GAINS, INTEGRAL_LIMIT, OUTPUT_LIMIT), 0.0, 0.0
    for _ in range(4000):
        push = pid.step(-position, velocity, 0.01) + 0.3
        velocity += push * 0.01
        position += velocity * 0.01
    assert abs(position) < 1e-3
    assert pid.integral == pytest.approx(-0.3, abs=1e-2)


def test_the_integral_does_not_wind_up_while_the_output_is_saturated() -> None:
    pid = Pid(GAINS, INTEGRAL_LIMIT, OUTPUT_LIMIT)
    for _ in range(1000):
        pid.step(10.0, 0.0, 0.01)
    assert pid.integral == 0.0


def test_a_jump_of_the_set_point_does_not_kick_through_the_derivative() -> None:
    pid = Pid(PidGains(kp=0.1, ki=0.0, kd=5.0), integral_limit=0.0, output_limit=10.0)
    assert pid.step(1.0, 0.0, 0.01) == pytest.approx(0.1)


@given(start=st.floats(-20, 20), target=st.floats(-20, 20), dt=st.floats(0.005, 0.05))
def test_the_reference_arrives_without_overshoot_within_its_limits(
    start: float, target: float, dt: float
) -> None:
    profile = Profile(start, max_speed=0.8, max_accel=0.5)
    low, high = min(start, target) - 1e-6, max(start, target) + 1e-6
    seconds = abs(target - start) / 0.8 + 0.8 / 0.5 * 2 + 1.0
    for _ in range(int(seconds / dt)):
        profile.step(target, dt)
        assert abs(profile.velocity) <= 0.8 + 1e-9
        assert abs(profile.acceleration) <= 0.5 + 1e-9
        assert low - 1e-3 <= profile.position <= high + 1e-3
    assert profile.position == pytest.approx(target, abs=1e-6)
    assert profile.velocity == 0.0


@given(target=st.floats(-20, 20), steps=st.integers(1, 400), dt=st.floats(0.005, 0.05))
def test_a_waiting_reference_comes_to_rest_and_feeds_nothing_forward(
    target: float, steps: int, dt: float
) -> None:
    profile = Profile(0.0, max_speed=0.8, max_accel=0.5)
    for _ in range(steps):
        profile.step(target, dt)
    left_m = abs(target - profile.position) + 0.5 * dt * dt
    began = profile.position
    for _ in range(int(0.8 / 0.5 / dt) + 3):
        profile.brake(dt)
        assert abs(profile.acceleration) <= 0.5 + 1e-9
    assert (profile.velocity, profile.acceleration) == (0.0, 0.0)
    assert abs(profile.position - began) <= left_m + 1e-6


def _blown(push_mps2: float, told_mps2: float, start_m: float) -> float:
    """How far beyond its place a point mass that starts at rest ends up: leans take 0.2 s and 60 ms, and
    reach to 1.7 m/s^2."""
    controller, sent = FlightController(ControlConfig()), [-push_mps2] * 4
    y_m, v_mps, lean_mps2, furthest_m = start_m, 0.0, -push_mps2, start_m
    for tick in range(500):
        setpoint = controller.step(
            tick * 20_000_000,
            Motion(0.0, y_m, 0.0, v_mps, 0.0, 0.0, 1.6),
            Reference(0.0, 0.0, 0.0, 1.6),
            0.02,
            Conditions((0.0, told_mps2)),
        )
        sent.append(math.tan(setpoint.roll_rad) * GRAVITY_MPS2)
        lean_mps2 += (sent[-4] - lean_mps2) * 0.1
        v_mps += (lean_mps2 + push_mps2) * 0.02
        y_m += v_mps * 0.02
        furthest_m = max(furthest_m, y_m)
    assert abs(y_m) < 0.1, "it arrives"
    return furthest_m


@pytest.mark.parametrize("start_m", [-0.3, -0.6])
def test_it_goes_no_faster_with_a_strong_push_than_it_can_stop(start_m: float) -> None:
    """Of 1.7 m/s^2 that it may lean a push of 1.5, of which it knows 1.2, leaves 0.2 to stop it by."""
    assert _blown(1.5, 1.2, start_m) < 0.15
    assert _blown(1.2, 1.2, start_m) < 0.15


def test_what_is_wanted_goes_on_as_it_moves() -> None:
    """The motion is foreseen: held against what is wanted now, the drone would trail it."""
    wanted = Reference(1.0, 2.0, 0.3, 1.6, vx_mps=0.8, vy_mps=-0.2, ax_mps2=-0.5, ay_mps2=0.1).after(0.2)
    assert (wanted.x_m, wanted.y_m) == pytest.approx((1.0 + 0.16 - 0.01, 2.0 - 0.04 + 0.002))
    assert (wanted.vx_mps, wanted.vy_mps) == pytest.approx((0.7, -0.18))
    assert (wanted.yaw_rad, wanted.height_m) == (0.3, 1.6)
