"""A landing because no climb rate is told: by our own setpoints where something keeps their climb, else the
autopilot's own."""

from __future__ import annotations

import math

import pytest

from flightd.core.types import Demand, LandedState, Phase
from flightd.mission.guidance import Guide
from flightd.mission.machine import Intent, State
from flightd.mission.triggers import Trigger
from tests.unit.mission.driven import Flight
from tests.unit.mission.states import fresh

TICK_S = 0.02
SINK_MPS = 0.3


def lost(**vehicle: object) -> Flight:
    """At rest on a leg, then landed because of its climb rate; the vehicle is known like that."""
    flight = fresh(State(Phase.FOLLOW, Intent.VISIT))
    pose = flight.inputs.pose
    assert pose is not None
    assert pose.vx_mps == pose.vy_mps == 0.0
    flight.set(landed=LandedState.IN_AIR, **vehicle)
    flight.run(1.2, until=lambda: flight.phase is Phase.LAND, follow=False)
    assert flight.phase is Phase.LAND
    assert flight.mission.reason == Trigger.CLIMB_LOST.value
    return flight


def sunk(flight: Flight, seconds: float) -> set[Demand]:
    """What is demanded while it sinks as it is commanded to, steered by the lines."""
    demands = set()
    for _ in range(round(seconds / TICK_S)):
        flight.set(height_m=flight.inputs.height_m - SINK_MPS * TICK_S)
        flight.run(TICK_S, follow=False)
        assert flight.guidance is not None
        assert flight.guidance.guide is Guide.STEER
        assert flight.guidance.reference.climb_mps < 0.0
        demands.add(flight.demand)
    assert flight.inputs.height_m > 0.5
    return demands


def test_where_the_autopilot_keeps_a_commanded_climb_our_own_setpoints_land() -> None:
    assert sunk(lost(climb_mps=math.nan, keeps_climb=True), 2.0) == {Demand.FLY}


def test_where_nothing_keeps_it_the_autopilot_lands() -> None:
    assert sunk(lost(climb_mps=math.nan), 2.0) == {Demand.LAND}


@pytest.mark.parametrize("keeps_climb", [False, True])
def test_where_the_heights_rate_keeps_it_our_own_setpoints_land(keeps_climb: bool) -> None:
    flight = lost(climb_mps=-SINK_MPS, climb_contradicted=True, keeps_climb=keeps_climb)
    assert sunk(flight, 2.0) == {Demand.FLY}


def test_once_the_heights_rate_is_lost_too_the_autopilot_lands_for_good() -> None:
    flight = lost(climb_mps=-SINK_MPS, climb_contradicted=True)
    assert sunk(flight, 0.5) == {Demand.FLY}
    flight.set(climb_mps=math.nan)
    assert sunk(flight, 0.5) == {Demand.LAND}
    flight.set(climb_mps=-SINK_MPS)
    assert sunk(flight, 0.5) == {Demand.LAND}, "nothing takes it back out of its own landing"
