"""What the guidance becomes as a setpoint."""

from __future__ import annotations

from dataclasses import replace

import pytest

from flightd.control.flight_controller import Conditions
from flightd.core.types import Phase
from flightd.mission.flight.steering import Steering
from flightd.mission.guidance import Guide
from flightd.mission.safety.plausibility_monitor import PlausibilityMonitor
from tests.unit.mission.configured import configured
from tests.unit.mission.driven import SITE, TICK_NS, Flight


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
