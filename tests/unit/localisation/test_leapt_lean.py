"""What the estimator makes of a roll that is told otherwise from one sample to the next."""

from __future__ import annotations

import math

import pytest

from flightd.control.flight_controller import Conditions
from flightd.core.geometry import GRAVITY_MPS2
from flightd.core.tick import TickInput
from flightd.core.types import Attitude, AttitudeSetpoint, LandedState, VehicleState
from flightd.localisation.state_estimator import StateEstimator
from flightd.sim.plant.kinematics import Kinematics
from tests.sim.ideal.ideal_sight import IdealEye
from tests.unit.mission.configured import configured
from tests.unit.mission.driven import SITE

TICK_NS = 20_000_000
LEAP_RAD = math.radians(3.0)
SWING_RAD, FAST = math.radians(3.0), 2.0 * math.pi


class Hovering:
    """An estimator that is told of a drone that rolls to and fro over its pad."""

    def __init__(self, yaw_rad: float) -> None:
        config = configured()
        self._yaw_rad = yaw_rad
        self.estimator = StateEstimator(SITE, config, 0.5, (SITE.home.node, yaw_rad))
        self._eye = IdealEye(SITE, config.camera.lens(), config.camera.mount(), None, 1)
        self._delay_ns = round(config.camera.latency_s * 1e9)
        self.now_ns = 10**12
        self._seq = 0

    def told(self, seconds: float, *, leapt_rad: float = 0.0, height_m: float = 1.6) -> Conditions:
        """What is known afterwards, were it told to lean by so much more."""
        for _ in range(round(seconds * 50)):
            self.now_ns += TICK_NS
            at_s = self.now_ns * 1e-9
            roll_rad, rate = SWING_RAD * math.sin(FAST * at_s), SWING_RAD * FAST * math.cos(FAST * at_s)
            attitude = Attitude(self.now_ns, roll_rad + leapt_rad, 0.0, self._yaw_rad, 0.0, rate, 0.0)
            vehicle = VehicleState(
                attitude, height_m, self.now_ns, 0.0, "GUIDED", True, True, LandedState.IN_AIR, 0.8, 12.0,
                self.now_ns,
            )  # fmt: skip
            if not self.estimator.armed:
                self.estimator.begin((SITE.home.node, self._yaw_rad), armed=True)
            self._seq += 1
            seen = self._eye.see(
                Kinematics(
                    self.now_ns, *SITE.pad_centre(SITE.home), height_m, 0.0, 0.0, 0.0, roll_rad, 0.0,
                    self._yaw_rad, rate, 0.0, 0.0,
                ),
                self._seq, self.now_ns,
            )  # fmt: skip
            tick = TickInput(self.now_ns, vehicle=vehicle, attitudes=(attitude,), lines=(seen,))
            self.estimator.take(tick, AttitudeSetpoint(self.now_ns))
        return self.estimator.step(self.now_ns).conditions


@pytest.mark.parametrize(
    ("yaw_rad", "axis", "way"), [(0.0, 1, -1.0), (math.pi / 2, 0, 1.0)], ids=["along x", "along y"]
)
def test_a_leap_is_leant_against_in_sight_by_all_of_it_and_blind_by_half_or_more(
    yaw_rad: float, axis: int, way: float
) -> None:
    """Who is told to roll by too much, and levels by that, goes to the left."""
    drone = Hovering(yaw_rad)
    before = drone.told(12.0)
    assert not before.leapt
    assert before.blind_mps2 == (0.0, 0.0)
    leapt = drone.told(0.04, leapt_rad=LEAP_RAD)
    whole = way * GRAVITY_MPS2 * math.tan(LEAP_RAD)
    assert leapt.leapt
    assert leapt.unleant_mps2[axis] - before.unleant_mps2[axis] == pytest.approx(whole, abs=0.12)
    assert 0.45 < leapt.blind_mps2[axis] / whole < 0.8, "it was never seen to stand: each may be right"
    assert abs(leapt.blind_mps2[1 - axis]) < 0.02
    back = drone.told(0.04)
    assert not back.leapt
    assert max(map(abs, back.blind_mps2)) < 0.02


def test_near_the_floor_nothing_leaps() -> None:
    drone = Hovering(0.0)
    drone.told(5.0)
    assert not drone.told(1.0, height_m=0.4).leapt
    assert not drone.told(0.04, leapt_rad=LEAP_RAD, height_m=0.4).leapt
