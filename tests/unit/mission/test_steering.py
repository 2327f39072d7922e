"""What the guidance becomes as a setpoint."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from flightd.control.flight_controller import Conditions
from flightd.core.types import Phase
from flightd.mission.flight.steering import Steering
from flightd.mission.guidance import Guide
from flightd.mission.safety.plausibility_monitor import PlausibilityMonitor
from tests.unit.mission.configured import configured
from tests.unit.mission.driven import SITE, TICK_NS, Flight


@pytest.mark.parametrize(
    ("leapt", "dead_reckoned", "against_mps2"),
    [(True, True, 0.5), (True, False, 0.1 + 0.25), (False, True, 0.1), (False, False, 0.1)],
)
def test_a_brake_leans_against_a_leap_by_what_is_known_of_the_motion(
    leapt: bool, dead_reckoned: bool, against_mps2: float
) -> None:
    """While the speed is dead-reckoned, by all that no told lean explains, as the speed is; then by the push
    and as much of the leap as is believed of a drone that sees nothing."""
    config, flight = configured(), Flight()
    steering = Steering(config.control, PlausibilityMonitor(SITE, config))
    flight.to(Phase.FOLLOW)
    assert flight.guidance is not None
    guidance = replace(flight.guidance, guide=Guide.BRAKE, dead_reckoned=dead_reckoned)
    conditions = Conditions(
        unleant_mps2=(0.0, 0.5), leapt=leapt, blind_mps2=(0.0, 0.25) if leapt else (0.0, 0.0)
    )
    inputs, setpoint = flight.inputs, None
    assert inputs.pose is not None
    still = replace(inputs.pose, vx_mps=0.0, vy_mps=0.0, yaw_rad=0.0)
    for _ in range(100):
        inputs = replace(inputs, now_ns=inputs.now_ns + TICK_NS, pose=still)
        setpoint = steering.step(inputs, guidance, (0.0, 0.1), 0.0, conditions=conditions)
    assert setpoint is not None
    assert setpoint.roll_rad == pytest.approx(-math.atan(against_mps2 / 9.80665), abs=0.002)


def test_level_is_the_attitude_that_is_told_of_a_level_drone() -> None:
    config, flight = configured(), Flight()
    steering = Steering(config.control, PlausibilityMonitor(SITE, config))
    flight.to(Phase.FOLLOW)
    assert flight.guidance is not None
    inputs, level, aslant = flight.inputs, (0.02, -0.01), (0.5, -0.5)
    leans = []
    for level_rad in (level, aslant):
        for _ in range(100):
            inputs = replace(inputs, now_ns=inputs.now_ns + TICK_NS)
            guidance, conditions = (
                replace(flight.guidance, guide=Guide.LEVEL),
                Conditions(level_rad=level_rad),
            )
            setpoint = steering.step(inputs, guidance, (0.0, 0.0), 0.0, conditions=conditions)
        assert setpoint is not None
        leans.append((setpoint.roll_rad, setpoint.pitch_rad))
    assert leans[0] == pytest.approx(level)
    assert max(map(abs, leans[1])) <= config.control.max_tilt_rad + 1e-9, "limits come last"


@pytest.mark.parametrize(
    ("sight_s", "most_rad"), [(0.2, None), (0.6, math.radians(5.0)), (1.5, math.radians(5.0))]
)
def test_above_its_pad_it_leans_little_by_what_it_no_longer_sees(
    sight_s: float, most_rad: float | None
) -> None:
    config, flight = configured(), Flight()
    steering = Steering(config.control, PlausibilityMonitor(SITE, config))
    flight.to(Phase.FOLLOW)
    assert flight.guidance is not None
    assert flight.inputs.pose is not None
    reference = flight.guidance.reference
    guidance = replace(flight.guidance, phase=Phase.LAND, guide=Guide.STEER)
    aside = replace(flight.inputs.pose, x_m=reference.x_m - 0.5, y_m=reference.y_m - 0.5)
    inputs = replace(flight.inputs, pose=aside, height_m=0.8, x_age_s=sight_s, y_age_s=sight_s)
    most = 0.0
    for _ in range(50):
        inputs = replace(inputs, now_ns=inputs.now_ns + TICK_NS)
        setpoint = steering.step(inputs, guidance, (0.0, 0.0), 0.0)
        assert setpoint is not None
        most = max(most, math.hypot(setpoint.roll_rad, setpoint.pitch_rad))
    if most_rad is None:
        assert most > math.radians(7.0), "what it sees it answers in full"
    else:
        assert math.radians(3.0) < most <= most_rad + 1e-9
