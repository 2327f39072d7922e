"""What the estimator makes of the attitude that is told while the drone stands."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from flightd.core.tick import TickInput
from flightd.core.types import Attitude, AttitudeSetpoint, LandedState, VehicleState
from flightd.localisation.state_estimator import StateEstimator
from tests.unit.mission.configured import configured
from tests.unit.mission.driven import SITE

TICK_NS = 20_000_000
TOLD_RAD = math.radians(1.5), math.radians(-0.6)
BELIEVED = 0.7**2 / (0.7**2 + 0.5**2)
"""Of what legs and attitude are thought to be wrong by, the attitude's share."""
FADES_S = 8.0
NOTHING = (0.0, 0.0)


def level_after(seconds: float) -> object:
    """What of it is left so long after the drone stood."""
    left = BELIEVED * math.exp(-seconds / FADES_S)
    return pytest.approx((left * TOLD_RAD[0], left * TOLD_RAD[1]), rel=0.01)


class Standing:
    """An estimator that is told of a drone at each tick, as `told` does."""

    def __init__(self, *, hovers_unsteered: bool = False) -> None:
        self.estimator = StateEstimator(SITE, configured(), 0.5, (SITE.home.node, 0.0))
        self.now_ns = 10**12
        self.tilt_rad = TOLD_RAD
        self.commanded: AttitudeSetpoint | None = None
        self._hovers_unsteered = hovers_unsteered

    def told(self, seconds: float, landed: LandedState | None, *, armed: bool) -> tuple[float, float]:
        """Which attitude is level afterwards; None: nothing is told."""
        for _ in range(round(seconds * 50)):
            self.now_ns += TICK_NS
            if landed is None:
                self.estimator.take(TickInput(self.now_ns), None)
                continue
            attitude = Attitude(self.now_ns, *self.tilt_rad, 0.0)
            vehicle = VehicleState(
                attitude, 0.1, self.now_ns, 0.0, "GUIDED", True, armed, landed, 0.8, 12.0, self.now_ns
            )
            vehicle = replace(vehicle, hovers_unsteered=self._hovers_unsteered)
            if armed is not self.estimator.armed:
                self.estimator.begin((SITE.home.node, 0.0), armed=armed)
            self.estimator.take(
                TickInput(self.now_ns, vehicle=vehicle, attitudes=(attitude,)), self.commanded
            )
        return self.estimator.step(self.now_ns).conditions.level_rad


@pytest.mark.parametrize("stands_armed_s", [0.0, 3.0])
def test_a_take_off_is_level_by_what_was_told_on_the_floor_for_as_long_as_that_lasts(
    stands_armed_s: float,
) -> None:
    drone = Standing()
    assert drone.told(1.0, None, armed=False) == NOTHING
    assert drone.told(3.0, LandedState.ON_GROUND, armed=False) == NOTHING
    drone.told(stands_armed_s, LandedState.ON_GROUND, armed=True)
    assert drone.told(2.0, LandedState.IN_AIR, armed=True) == level_after(2.0)
    assert drone.told(14.0, LandedState.IN_AIR, armed=True) == level_after(16.0)


def test_what_is_told_once_it_is_to_rise_is_not_told_of_a_drone_that_stands() -> None:
    drone = Standing()
    drone.told(3.0, LandedState.ON_GROUND, armed=True)
    drone.commanded = AttitudeSetpoint(drone.now_ns, 0.0, 0.0, 0.0, 0.5)
    drone.tilt_rad = (0.0, 0.0)
    assert drone.told(1.0, LandedState.ON_GROUND, armed=True) == level_after(1.0)


def test_each_flight_is_told_anew() -> None:
    drone = Standing()
    drone.told(3.0, LandedState.ON_GROUND, armed=True)
    drone.told(20.0, LandedState.IN_AIR, armed=True)
    assert drone.told(3.0, LandedState.ON_GROUND, armed=True) == level_after(23.0), (
        "it may lean where it landed"
    )
    drone.tilt_rad = (-TOLD_RAD[0], -TOLD_RAD[1])
    assert drone.told(3.0, LandedState.ON_GROUND, armed=False) == NOTHING
    drone.tilt_rad = TOLD_RAD
    drone.told(3.0, LandedState.ON_GROUND, armed=False)
    assert drone.told(1.0, LandedState.IN_AIR, armed=True) == level_after(1.0)


def test_of_a_drone_that_was_found_flying_nothing_is_known() -> None:
    drone = Standing()
    assert drone.told(3.0, LandedState.IN_AIR, armed=True) == NOTHING
    drone = Standing()
    drone.told(3.0, LandedState.ON_GROUND, armed=False)
    drone.told(1.5, None, armed=False)
    assert drone.told(1.0, LandedState.IN_AIR, armed=True) == NOTHING, "it was not seen to rise from there"


def test_what_levels_itself_by_how_it_stands_says_nothing() -> None:
    drone = Standing(hovers_unsteered=True)
    assert drone.told(3.0, LandedState.ON_GROUND, armed=True) == NOTHING


def found_stuck(heard_every: int, *, sticks: bool = False) -> bool:
    """Whether a range finder counts as stuck that is heard each so many ticks of a climb, where the vehicle
    repeats its last height meanwhile."""
    drone = Standing()
    drone.told(1.0, LandedState.ON_GROUND, armed=True)
    commanded = AttitudeSetpoint(drone.now_ns, 0.0, 0.0, 0.0, 0.8)
    height_m, heard_ns = 0.1, drone.now_ns
    for tick in range(100):
        drone.now_ns += TICK_NS
        if tick % heard_every == 0:
            height_m, heard_ns = height_m if sticks else 0.1 + 0.8 * tick * 0.02, drone.now_ns
        now_ns, attitude = drone.now_ns, Attitude(drone.now_ns, 0.0, 0.0, 0.0)
        vehicle = VehicleState(
            attitude, height_m, heard_ns, 0.8, "GUIDED", True, True, LandedState.IN_AIR, 0.8, 12.0, now_ns
        )
        drone.estimator.take(TickInput(now_ns, vehicle=vehicle, attitudes=(attitude,)), commanded)
    return drone.estimator.height_stuck


def test_a_range_finder_that_is_silent_for_half_a_second_of_a_climb_is_not_stuck() -> None:
    assert not found_stuck(heard_every=30)
    assert found_stuck(heard_every=5, sticks=True)
