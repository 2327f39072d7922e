"""The drone's own control loops: tilt, yaw rate, height by sonar, and standing still by the bottom camera."""

from __future__ import annotations

import math
from dataclasses import dataclass

from flightd.core.geometry import wrap_pi
from flightd.sim.autopilot.climb_loop import ClimbGains, ClimbLoop
from flightd.sim.plant.airframe import Airframe, AirframeCommand
from flightd.sim.sensors.instruments import Sensors

SONAR_PERIOD_S = 0.04
_SONAR_GAIN = 0.3
_SONAR_JUMP_M = 0.5
_FLOW_LAG_S = 0.1
_HOLD_MAX_TILT_RAD = math.radians(8.0)
_HOLD_PULL_PER_S = 0.8
_HOLD_BRAKE_RAD_PER_MPS = 0.25
_HOLD_INTEGRAL_RAD_PER_M_S = 0.04
_STILL_MPS = 0.15
_YAW_LEAD_MAX_RAD = math.radians(20.0)
_IDLE_COLLECTIVE = 0.1
_CLIMB = ClimbGains(accel_mps2=5.0, jerk_mps3=50.0)
"""It is not known how it shapes a climb: nearly at once."""


@dataclass(frozen=True, slots=True)
class LoopTargets:
    """What the flight state wants of the loops.  `idle` only spins the rotors; `hold` brakes and keeps
    the place, `roll_rad` and `pitch_rad` are ignored then."""

    motors: bool = False
    idle: bool = False
    hold: bool = True
    roll_rad: float = 0.0
    pitch_rad: float = 0.0
    yaw_rate_radps: float = 0.0
    climb_mps: float = 0.0


class FlightLoops:
    """Closes the loops over one airframe by its sensors; what is measured is the drone's own belief."""

    def __init__(self, airframe: Airframe, sensors: Sensors) -> None:
        self._airframe = airframe
        self._sensors = sensors
        self._climb_loop = ClimbLoop(_CLIMB)
        self._roll_trim_rad = self._pitch_trim_rad = 0.0
        self._yaw_zero_rad = airframe.yaw_rad + sensors.params.heading_offset_rad
        self._yaw_target_rad = 0.0
        self._sonar_wait_s = 0.0
        self._forward_pull = self._right_pull = 0.0
        self._forward_off_m = self._right_off_m = 0.0
        self._anchored = False
        self.height_m = airframe.height_m
        self.sonar_m = 0.0
        self.vx_mps = self.vy_mps = 0.0

    @property
    def roll_rad(self) -> float:
        return self._sensors.roll_rad - self._roll_trim_rad

    @property
    def pitch_rad(self) -> float:
        return self._sensors.pitch_rad - self._pitch_trim_rad

    @property
    def yaw_rad(self) -> float:
        """Relative to the heading at power-up."""
        return wrap_pi(self._sensors.yaw_rad - self._yaw_zero_rad)

    @property
    def climb_mps(self) -> float:
        return self._sensors.climb_mps

    @property
    def still(self) -> bool:
        return math.hypot(self.vx_mps, self.vy_mps) < _STILL_MPS

    def trim(self) -> None:
        """Take the present attitude as level."""
        self._roll_trim_rad = self._sensors.roll_rad
        self._pitch_trim_rad = self._sensors.pitch_rad

    def zero_yaw(self) -> None:
        """Count the heading from here, as at power-up."""
        self._yaw_zero_rad = self._sensors.yaw_rad

    def step(self, dt_s: float, targets: LoopTargets) -> None:
        """Advance loops, airframe and sensors by `dt_s`."""
        self._estimate(dt_s)
        if targets.motors and not targets.idle:
            command = self._command(dt_s, targets)
        else:
            self._yaw_target_rad = self.yaw_rad
            self._climb_loop.reset(self.height_m)
            self._anchored = False
            command = AirframeCommand(motors=targets.motors, collective=_IDLE_COLLECTIVE)
        self._airframe.step(dt_s, command)
        self._sensors.update(dt_s, self._airframe)

    def _command(self, dt_s: float, targets: LoopTargets) -> AirframeCommand:
        if targets.hold:
            roll_rad, pitch_rad = self._hold(dt_s)
        else:
            roll_rad, pitch_rad = targets.roll_rad, targets.pitch_rad
            self._anchored = False
        behind_rad = wrap_pi(self._yaw_target_rad + targets.yaw_rate_radps * dt_s - self.yaw_rad)
        behind_rad = min(max(behind_rad, -_YAW_LEAD_MAX_RAD), _YAW_LEAD_MAX_RAD)
        self._yaw_target_rad = wrap_pi(self.yaw_rad + behind_rad)
        collective = self._climb_loop.step(
            dt_s,
            targets.climb_mps,
            height_m=self.height_m,
            speed_mps=self.climb_mps,
            accel_mps2=self._sensors.accel_mps2,
            tilt_cos=math.cos(self.roll_rad) * math.cos(self.pitch_rad),
        )
        # The loops steer what they believe; the airframe is told the truth that makes the belief come true.
        return AirframeCommand(
            motors=True,
            roll_rad=roll_rad - (self.roll_rad - self._airframe.roll_rad),
            pitch_rad=pitch_rad - (self.pitch_rad - self._airframe.pitch_rad),
            yaw_rad=self._airframe.yaw_rad + behind_rad,
            yaw_rate_radps=targets.yaw_rate_radps,
            collective=collective,
        )

    def _hold(self, dt_s: float) -> tuple[float, float]:
        """Roll and pitch that brake, then pull back to where the brake came to rest."""
        if not self._anchored:
            self._anchored = self.still
            self._forward_off_m = self._right_off_m = 0.0
        else:
            self._forward_off_m += self.vx_mps * dt_s
            self._right_off_m += self.vy_mps * dt_s
        step = _HOLD_INTEGRAL_RAD_PER_M_S * dt_s
        limit = _HOLD_MAX_TILT_RAD / 2
        self._forward_pull = min(max(self._forward_pull + self._forward_off_m * step, -limit), limit)
        self._right_pull = min(max(self._right_pull + self._right_off_m * step, -limit), limit)

        def tilt(speed_mps: float, off_m: float, pull: float) -> float:
            back = _HOLD_BRAKE_RAD_PER_MPS * (speed_mps + _HOLD_PULL_PER_S * off_m) + pull
            return min(max(back, -_HOLD_MAX_TILT_RAD), _HOLD_MAX_TILT_RAD)

        # Nose up (+ pitch) drives backward, left side down (- roll) drives left.
        return (
            -tilt(self.vy_mps, self._right_off_m, self._right_pull),
            tilt(self.vx_mps, self._forward_off_m, self._forward_pull),
        )

    def _estimate(self, dt_s: float) -> None:
        air = self._airframe
        sin_yaw, cos_yaw = math.sin(air.yaw_rad), math.cos(air.yaw_rad)
        forward = air.vx_mps * cos_yaw + air.vy_mps * sin_yaw
        right = -air.vx_mps * sin_yaw + air.vy_mps * cos_yaw
        blend = min(1.0, dt_s / _FLOW_LAG_S)
        self.vx_mps += (forward - self.vx_mps) * blend
        self.vy_mps += (right - self.vy_mps) * blend
        self.height_m += self.climb_mps * dt_s
        self._sonar_wait_s -= dt_s
        if self._sonar_wait_s > 0.0:
            return
        self._sonar_wait_s += SONAR_PERIOD_S
        self.sonar_m = self._sensors.range_m(air)
        measured_m = self.sonar_m * air.tilt_cos
        if measured_m > 0.0 and abs(measured_m - self.height_m) < _SONAR_JUMP_M:
            self.height_m += _SONAR_GAIN * (measured_m - self.height_m)
