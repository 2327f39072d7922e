"""PID, reference profile and limits: what they promise for any input."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flightd.config.control import PidGains
from flightd.control.motion_profile import Profile
from flightd.control.pid import Pid

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
