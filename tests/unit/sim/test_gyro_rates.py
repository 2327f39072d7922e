"""The yaw's rate from the rates of the body, leaning or not."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flightd.core.geometry import angle_rates
from flightd.sim.plant.airframe import Airframe
from flightd.sim.sensors.instruments import SensorParams, Sensors

_LEAN = st.floats(-0.7, 0.7)
_RATE = st.floats(-2.0, 2.0)


@given(roll=_LEAN, pitch=_LEAN, roll_speed=_RATE, pitch_speed=_RATE, yaw_speed=_RATE)
def test_the_rates_of_the_angles_are_found_in_what_gyros_of_a_leaning_body_feel(
    roll: float, pitch: float, roll_speed: float, pitch_speed: float, yaw_speed: float
) -> None:
    airframe = Airframe()
    airframe.roll_rad, airframe.pitch_rad = roll, pitch
    airframe.roll_speed_radps, airframe.pitch_speed_radps = roll_speed, pitch_speed
    airframe.yaw_speed_radps = yaw_speed
    k = airframe.kinematics(0)
    told = angle_rates(roll, pitch, (k.roll_rate_radps, k.pitch_rate_radps, k.yaw_rate_radps))
    assert told == pytest.approx((yaw_speed, roll_speed, pitch_speed), abs=1e-9)


def test_simulated_gyros_drift_as_the_told_heading_and_err_in_scale() -> None:
    params = SensorParams(yaw_drift_radps=0.01, gyro_share=0.1, gyro_noise_radps=0.0)
    airframe = Airframe()
    airframe.yaw_speed_radps = 1.0
    felt = []
    for seed in range(20):
        sensors = Sensors(params, seed)
        before = sensors.yaw_error_rad
        sensors.update(0.001, airframe)
        drift_radps = (sensors.yaw_error_rad - before) / 0.001
        _, _, yaw_radps = sensors.body_rates_radps(airframe.kinematics(0))
        felt.append(yaw_radps - drift_radps)
    assert all(math.isclose(one, 1.0, abs_tol=0.1) for one in felt)
    assert max(felt) - min(felt) > 0.05


def test_gyros_of_roll_and_pitch_are_told_with_what_is_left_of_their_biases() -> None:
    sensors = Sensors(
        SensorParams(gyro_noise_radps=0.0, yaw_drift_radps=0.0, tilt_rate_bias_radps=(0.01, -0.02))
    )
    assert sensors.body_rates_radps(Airframe().kinematics(0)) == pytest.approx((0.01, -0.02, 0.0))
