"""What a simulated autopilot's attitude becomes by what it is told of its motion."""

from __future__ import annotations

import math

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.adapters.vehicle.mavlink.link.connection import Firmware
from flightd.adapters.vehicle.mavlink.pose_output import PoseForm, PoseOutput
from flightd.core.shared_pose import SharedPose
from flightd.core.types import Attitude
from flightd.sim.autopilot.external_vision import ExternalVision, Taken
from flightd.sim.plant.airframe import Airframe, AirframeCommand
from flightd.sim.plant.truth_history import TruthHistory
from flightd.sim.sensors.instruments import SensorParams, Sensors

STEP_S, EVERY = 0.005, 6
SPEED = Taken(speed=True, own_attitude=True)
PARAMS = SensorParams(tilt_bias=(0.0, 0.0), tilt_wander_rad=math.radians(0.3), leak_s=2.0)


class Flight:
    """A drone that sways, its sensors, and what tells them of the motion, `late_s` after it was so."""

    def __init__(self, taken: Taken, late_s: float = 0.08) -> None:
        self.airframe = Airframe(yaw_rad=0.6)
        self.airframe.height_m, self.airframe.on_floor = 1.5, False
        self.sensors, self.truth = Sensors(PARAMS, 3), TruthHistory(1000)
        self.vision = ExternalVision(self.sensors, self.truth.at)
        self._output = PoseOutput(PoseForm.ODOMETRY, Firmware.PX4)
        self._taken, self._late_s = taken, late_s
        self._steps = self.now_ns = 0
        self.off_m = 0.0
        self.off_mps = 0.0
        self.corrections = 0

    def fly(self, seconds: float, *, told: bool = True) -> float:
        """The greatest error of roll or pitch in the second half, degrees."""
        worst = 0.0
        for step in range(round(seconds / STEP_S)):
            self._steps += 1
            time_s = self._steps * STEP_S
            self.now_ns = round(time_s * 1e9)
            lean = math.radians(6.0) * math.sin(time_s)
            hover = self.airframe.params.hover_collective
            command = AirframeCommand(
                motors=True, roll_rad=lean, pitch_rad=-lean, yaw_rad=0.6, collective=hover
            )
            self.airframe.step(STEP_S, command)
            self.airframe.height_m, self.airframe.on_floor = 1.5, False
            self.sensors.update(STEP_S, self.airframe)
            self.vision.step(STEP_S, self.airframe)
            self.truth.add(self.airframe.kinematics(self.now_ns))
            if told and self._steps % EVERY == 0:
                self._tell(self.now_ns - round(self._late_s * 1e9), self.now_ns)
            if step * STEP_S > seconds / 2:
                error = max(abs(self.sensors.roll_error_rad), abs(self.sensors.pitch_error_rad))
                worst = max(worst, math.degrees(error))
        return worst

    def _tell(self, stamp_ns: int, now_ns: int) -> None:
        truth, sensors = self.truth.at(stamp_ns), self.sensors
        attitude = Attitude(
            stamp_ns,
            truth.roll_rad + sensors.roll_error_rad,
            truth.pitch_rad + sensors.pitch_error_rad,
            truth.yaw_rad + sensors.yaw_error_rad,
        )
        pose = SharedPose(
            stamp_ns=stamp_ns,
            attitude=attitude,
            yaw_rad=truth.yaw_rad,
            x_m=truth.x_m + self.off_m,
            y_m=truth.y_m,
            vx_mps=truth.vx_mps + self.off_mps,
            vy_mps=truth.vy_mps,
            height_m=1.5,
            position_variances=(0.01, 0.01),
            speed_variances=(0.001, 0.001),
            height_variance=0.001,
            integrity=1.0,
            corrections=self.corrections,
        )
        message = self._output.make(now_ns, pose, 0.0)
        if message is not None:
            self.vision.take(message, self._taken, stamp_ns, now_ns)


def test_an_attitude_that_drifts_is_healed_by_what_is_told_and_drifts_again_without() -> None:
    flight = Flight(SPEED)
    alone = flight.fly(20.0, told=False)
    assert alone > 3.0
    told = flight.fly(20.0)
    assert flight.vision.aided
    assert told < 0.5 * alone
    assert flight.fly(20.0, told=False) > 2.0 * told


def test_nothing_is_healed_where_the_parameters_take_nothing() -> None:
    flight = Flight(Taken())
    alone = Flight(Taken()).fly(20.0, told=False)
    assert flight.fly(20.0) == pytest.approx(alone)
    assert flight.vision.is_heard
    assert not flight.vision.aided


def test_speeds_of_another_moment_turn_the_attitude() -> None:
    sound, stale = Flight(SPEED), Flight(SPEED, late_s=0.08)
    honest = sound.fly(20.0)
    truth_at = stale.truth.at
    stale.vision = ExternalVision(stale.sensors, lambda stamp_ns: truth_at(stamp_ns + 250_000_000))
    assert stale.fly(20.0) > 1.2 * honest


def test_a_wrong_speed_shakes_the_attitude_and_a_wild_one_is_rejected() -> None:
    flight = Flight(SPEED)
    sound = flight.fly(20.0)
    flight.off_mps = 0.4
    assert flight.fly(2.0) > sound + 0.5
    assert flight.vision.rejected == 0
    flight.fly(20.0)
    flight.off_mps = 5.0
    flight.fly(0.5)
    assert flight.vision.rejected > 5


def leapt(*, counted: bool) -> float:
    """By how much the attitude turns once the place that is told has leapt, degrees."""
    flight = Flight(Taken(place=True))
    flight.fly(5.0)
    before = flight.sensors.drift_rad
    for x_m, count in ((0.0, 200), *[(0.6, 201 if counted else 200)] * 150):
        message = dialect.MAVLink_odometry_message(
            0, 20, 12, x_m, 0.0, -1.5, [1.0, 0.0, 0.0, 0.0], *[0.0] * 6, [0.01] * 21, [0.01] * 21, count
        )
        flight.vision.take(message, Taken(place=True), flight.now_ns, flight.now_ns)
    return math.degrees(math.dist(before, flight.sensors.drift_rad))


def test_a_leap_of_the_place_turns_the_attitude_unless_it_is_counted() -> None:
    assert leapt(counted=True) < 0.05
    assert leapt(counted=False) > 0.1
