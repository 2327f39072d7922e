from __future__ import annotations

import pytest

from flightd.core.types import Phase
from flightd.mission.flight.leg_direction import LegDirection
from flightd.mission.plan.flight_plan import Stop

GOAL = Stop("A2", 3.0, 1.0, yaw_rad=0.0, visit=True)
ALONG, ACROSS = (GOAL.x_m - 2.0, GOAL.y_m + 0.1), (GOAL.x_m + 0.1, GOAL.y_m - 2.0)


@pytest.mark.parametrize("phase", [Phase.HOLD, Phase.RELOCATE, Phase.ACQUIRE])
def test_a_leg_keeps_its_direction_while_it_is_interrupted(phase: Phase) -> None:
    leg = LegDirection()
    assert leg.step(phase, GOAL, ALONG) is None
    assert leg.step(Phase.FOLLOW, GOAL, ALONG) is True
    assert leg.step(phase, GOAL, ACROSS) is True
    assert leg.step(Phase.FOLLOW, GOAL, ACROSS) is False
    assert leg.step(Phase.HOVER, GOAL, ACROSS) is None
    assert leg.step(phase, GOAL, ACROSS) is None
