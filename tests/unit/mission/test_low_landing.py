"""How far a landing leans near the floor, where it may stand already, and how fast whoever is late."""

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


def leans_deg(phase: Phase, heights_m: list[float]) -> list[float]:
    """The lean at the end of half a second at each height, of a drone a metre off its reference."""
    config, flight = configured(), Flight()
    steering = Steering(config.control, PlausibilityMonitor(SITE, config))
    flight.to(Phase.FOLLOW)
    assert flight.guidance is not None
    inputs, leans, setpoint = flight.inputs, list[float](), None
    assert inputs.pose is not None
    reference = replace(flight.guidance.reference, x_m=inputs.pose.x_m + 1.0)
    guidance = replace(flight.guidance, phase=phase, guide=Guide.STEER, reference=reference)
    for height_m in heights_m:
        for _ in range(25):
            inputs = replace(inputs, now_ns=inputs.now_ns + TICK_NS, height_m=height_m)
            setpoint = steering.step(inputs, guidance, (0.0, 0.0), 0.0)
        assert setpoint is not None
        leans.append(math.degrees(math.hypot(setpoint.roll_rad, setpoint.pitch_rad)))
    return leans


def test_a_landing_near_the_floor_leans_by_little_also_once_no_height_is_told() -> None:
    high, low, unmeasured, high_again = leans_deg(Phase.LAND, [1.0, 0.4, math.nan, 1.0])
    assert min(high, high_again) > 8.0
    assert 4.0 < low <= 5.001
    assert 4.0 < unmeasured <= 5.001


def test_a_landing_that_never_was_low_and_a_hover_lean_as_they_have_to() -> None:
    assert min(leans_deg(Phase.LAND, [1.0, math.nan])) > 8.0
    assert min(leans_deg(Phase.HOVER, [0.4, math.nan])) > 8.0


def test_while_it_is_not_known_how_late_pictures_are_a_lean_changes_more_slowly() -> None:
    config, flight = configured(), Flight()
    flight.to(Phase.FOLLOW)
    inputs, guidance = flight.inputs, flight.guidance
    assert guidance is not None
    assert inputs.pose is not None
    here = replace(guidance.reference, x_m=inputs.pose.x_m, y_m=inputs.pose.y_m, vx_mps=0.0, vy_mps=0.0)
    leans = list[float]()
    for ease in (1.0, 0.9, 0.35):
        steering = Steering(config.control, PlausibilityMonitor(SITE, config))
        for tick, away_m in enumerate((0.0, 3.0)):
            now = replace(inputs, now_ns=inputs.now_ns + tick * TICK_NS)
            reference = replace(here, x_m=here.x_m + away_m)
            wanted = replace(guidance, guide=Guide.STEER, reference=reference)
            setpoint = steering.step(now, wanted, (0.0, 0.0), 0.0, conditions=Conditions(ease=ease))
        assert setpoint is not None
        leans.append(abs(setpoint.pitch_rad))
    sure, nearly, unsure = leans
    assert nearly == pytest.approx(0.81 * sure, rel=0.02)
    assert unsure == pytest.approx(0.4 * sure, rel=0.02)
