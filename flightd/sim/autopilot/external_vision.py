"""What becomes of an autopilot's attitude while its companion tells it of its motion.

The accelerometers of a drone in flight feel hardly more than its thrust: alone, an estimator takes that for
the vertical, and its tilt leaks to it.  Told of its speed, it sees what a wrong tilt does to the speed it
expects, g times the error, and takes the error back; of its place, the same more slowly.  So what it is told
wrong, or of another moment, turns its attitude.  This is the steady-state filter of that: errors of speed and
tilt, an innovation of each axis, gains by the variance that is told (PX4) or configured (ArduPilot)."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from flightd.core.geometry import GRAVITY_MPS2, heading_rotation, level_from_body
from flightd.sim.autopilot.guided import euler
from flightd.sim.autopilot.link import Message
from flightd.sim.plant.airframe import Airframe
from flightd.sim.plant.kinematics import Kinematics
from flightd.sim.sensors.instruments import Sensors

_TILT_NOISE = 0.0015
"""What the tilt is thought to drift by, rad in a square root of a second."""
_LEAST_SIGMA_MPS = 0.1
_PLACE_RADPS = 0.7
"""How soon a place is followed."""
_SPEED_GATE, _PLACE_GATE_M = 5.0, 1.0
_STALE_S, _PLACE_REJECTED_S = 1.0, 5.0
"""Poses older, or rejected for longer, are given up: begun anew with the next."""
_RECKONED_S = 15.0
"""After the last pose the speed is dead-reckoned for so long."""
_LONGEST_S = 0.2


@dataclass(frozen=True, slots=True)
class Taken:
    """What the parameters say is taken of a pose.  `own_attitude`: speeds are turned by the estimator's own
    attitude, not by the pose's; `speed_sigma_mps` None: as the message says."""

    speed: bool = False
    place: bool = False
    own_attitude: bool = False
    speed_sigma_mps: float | None = None


NOT_TAKEN = Taken()


class ExternalVision:
    """`take` each pose, `step` after each step of the sensors."""

    def __init__(self, sensors: Sensors, truth_at: Callable[[int], Kinematics]) -> None:
        self._sensors, self._truth_at = sensors, truth_at
        self._speed_error = [0.0, 0.0]
        self._place = [0.0, 0.0]
        self._reset_count: int | None = None
        self._heard_s = self._fused_s = self._placed_s = math.inf
        self.rejected = 0
        """Poses that were too far from what was expected."""

    @property
    def is_heard(self) -> bool:
        """Poses have come within the last 0.3 s, whatever became of them."""
        return self._heard_s < 0.3

    @property
    def aided(self) -> bool:
        """Its attitude rests on what it is told."""
        return self._fused_s < _STALE_S

    def speed_mps(self, truth: Airframe) -> tuple[float, float] | None:
        """As it is estimated, along true axes; None: it is not."""
        if self._fused_s > _RECKONED_S:
            return None
        return truth.vx_mps + self._speed_error[0], truth.vy_mps + self._speed_error[1]

    def step(self, dt_s: float, truth: Airframe) -> None:
        """What the errors grow to by themselves."""
        self._heard_s += dt_s
        self._fused_s += dt_s
        self._placed_s += dt_s
        self._sensors.aided = self.aided
        if self._fused_s > _RECKONED_S or truth.on_floor:
            self._speed_error = [0.0, 0.0]
            return
        roll, pitch = self._sensors.drift_rad
        cos, sin = math.cos(truth.yaw_rad), math.sin(truth.yaw_rad)
        ahead, aside = -GRAVITY_MPS2 * pitch * dt_s, GRAVITY_MPS2 * roll * dt_s
        self._speed_error[0] += cos * ahead - sin * aside
        self._speed_error[1] += sin * ahead + cos * aside
        speed = self._local_speed(truth)
        self._place = [self._place[axis] + speed[axis] * dt_s for axis in range(2)]

    def take(self, message: Message, taken: Taken, stamp_ns: int, now_ns: int) -> None:
        """A pose of what the estimator holds for that moment."""
        elapsed_s, self._heard_s = min(max(self._heard_s, 0.005), _LONGEST_S), 0.0
        reset, self._reset_count = message.reset_counter != self._reset_count, message.reset_counter
        truth = self._truth_at(stamp_ns)
        if taken.speed and message.get_type() == "ODOMETRY":
            self._take_speed(message, taken, truth, elapsed_s, reset=reset)
        if taken.place:
            late_s = (now_ns - stamp_ns) * 1e-9
            self._take_place((message.x, message.y), truth, late_s, elapsed_s, reset=reset)

    def _take_speed(
        self, message: Message, taken: Taken, truth: Kinematics, elapsed_s: float, *, reset: bool
    ) -> None:
        sensors = self._sensors
        roll, pitch, yaw = euler(*message.q)
        if taken.own_attitude:
            roll, pitch = truth.roll_rad + sensors.roll_error_rad, truth.pitch_rad + sensors.pitch_error_rad
            yaw = truth.yaw_rad + sensors.yaw_error_rad
        body = (message.vx, message.vy, message.vz)
        turn = yaw - sensors.yaw_error_rad
        told = heading_rotation(turn) @ level_from_body(roll, pitch) @ body
        apart = [
            float(told[0]) - truth.vx_mps - self._speed_error[0],
            float(told[1]) - truth.vy_mps - self._speed_error[1],
        ]
        variances = _variances(message.velocity_covariance, taken.speed_sigma_mps)
        gate_mps = _SPEED_GATE * math.sqrt(max(variances) + 0.1**2)
        if reset or not self.aided:
            self._speed_error = [self._speed_error[axis] + apart[axis] for axis in range(2)]
            self._fused_s = 0.0
        elif math.hypot(*apart) > gate_mps:
            self.rejected += 1
        else:
            self._fused_s = 0.0
            cos, sin = math.cos(truth.yaw_rad), math.sin(truth.yaw_rad)
            axes = cos * apart[0] + sin * apart[1], -sin * apart[0] + cos * apart[1]
            rates = [_radps(variance, elapsed_s) for variance in variances]
            ahead, aside = (
                axis * min(math.sqrt(2.0) * radps * elapsed_s, 1.0)
                for axis, radps in zip(axes, rates, strict=True)
            )
            tilts = [
                axis * radps**2 / GRAVITY_MPS2 * elapsed_s for axis, radps in zip(axes, rates, strict=True)
            ]
            self._correct((ahead, aside), tilts, cos, sin)

    def _take_place(
        self,
        told_m: tuple[float, float],
        truth: Kinematics,
        late_s: float,
        elapsed_s: float,
        *,
        reset: bool,
    ) -> None:
        speed = self._local_speed(truth)
        expected = [self._place[axis] - speed[axis] * late_s for axis in range(2)]
        apart = told_m[0] - expected[0], told_m[1] - expected[1]
        rejected = math.hypot(*apart) > _PLACE_GATE_M and self._placed_s < _PLACE_REJECTED_S
        if reset or not self.aided or (math.hypot(*apart) > _PLACE_GATE_M and not rejected):
            self._place = [self._place[axis] + apart[axis] for axis in range(2)]
            self._fused_s = self._placed_s = 0.0
        elif rejected:
            self.rejected += 1
        else:
            self._fused_s = self._placed_s = 0.0
            share = 2.0 * _PLACE_RADPS * elapsed_s
            self._place = [self._place[axis] + share * apart[axis] for axis in range(2)]
            told_yaw = truth.yaw_rad + self._sensors.yaw_error_rad
            cos, sin = math.cos(told_yaw), math.sin(told_yaw)
            axes = cos * apart[0] + sin * apart[1], -sin * apart[0] + cos * apart[1]
            by_speed = _PLACE_RADPS**2 * elapsed_s
            by_tilt = 0.3 * _PLACE_RADPS**3 / GRAVITY_MPS2 * elapsed_s
            cos, sin = math.cos(truth.yaw_rad), math.sin(truth.yaw_rad)
            self._correct(
                (axes[0] * by_speed, axes[1] * by_speed), [axis * by_tilt for axis in axes], cos, sin
            )

    def _correct(self, speeds: tuple[float, float], tilts: Sequence[float], cos: float, sin: float) -> None:
        """By these much ahead and aside: faster than believed is less nose up and more right side down."""
        ahead, aside = speeds
        self._speed_error[0] += cos * ahead - sin * aside
        self._speed_error[1] += sin * ahead + cos * aside
        self._sensors.correct_tilt(tilts[1], -tilts[0])

    def _local_speed(self, truth: Airframe | Kinematics) -> tuple[float, float]:
        """As it is estimated, in the frame of the estimator's own heading."""
        vx, vy = truth.vx_mps + self._speed_error[0], truth.vy_mps + self._speed_error[1]
        cos, sin = math.cos(self._sensors.yaw_error_rad), math.sin(self._sensors.yaw_error_rad)
        return cos * vx - sin * vy, sin * vx + cos * vy


def _variances(covariance: Sequence[float], sigma_mps: float | None) -> tuple[float, float]:
    """Of the speeds ahead and aside."""
    least = _LEAST_SIGMA_MPS**2
    if sigma_mps is not None:
        return max(sigma_mps**2, least), max(sigma_mps**2, least)
    told = covariance[0], covariance[6]
    ahead, aside = (value if value > 0.0 else least for value in told)  # NaN: not told
    return max(ahead, least), max(aside, least)


def _radps(variance: float, elapsed_s: float) -> float:
    """How soon speeds of that variance, so far apart, are followed."""
    return math.sqrt(GRAVITY_MPS2 * math.sqrt(_TILT_NOISE**2 / (variance * elapsed_s)))
