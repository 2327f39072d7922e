"""From where the drone is and should be to an attitude setpoint: four PID loops and the geometry."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from flightd.config.control import ControlConfig
from flightd.control.pid import Pid
from flightd.core.geometry import GRAVITY_MPS2, wrap_pi
from flightd.core.types import AttitudeSetpoint

_TRIM_MPS2 = 0.8
"""The most that is leaned against a push once not even the velocity is dead-reckoned: five degrees."""

_STRONG = 0.5
"""From this share of what may be leaned on a push decides how fast the drone may go with it."""
_STOPS_BY = 0.05
"""Share of what is left to lean that is counted on to stop it again: pushes grow."""
_SLOW_MPS = 0.05


@dataclass(frozen=True, slots=True)
class Motion:
    """Measured, in grid axes: position and velocity, yaw, and the height with its rate."""

    x_m: float
    y_m: float
    vx_mps: float
    vy_mps: float
    yaw_rad: float
    yaw_rate_radps: float
    height_m: float


@dataclass(frozen=True, slots=True)
class Reference:
    """Wanted, in grid axes; velocities and accelerations are fed forward."""

    x_m: float
    y_m: float
    yaw_rad: float
    height_m: float
    vx_mps: float = 0.0
    vy_mps: float = 0.0
    ax_mps2: float = 0.0
    ay_mps2: float = 0.0
    yaw_rate_radps: float = 0.0
    climb_mps: float = 0.0

    def after(self, ahead_s: float) -> Reference:
        """Where on the floor, and how fast there, it is wanted so much later."""
        vx_mps, vy_mps = self.vx_mps + self.ax_mps2 * ahead_s, self.vy_mps + self.ay_mps2 * ahead_s
        x_m = self.x_m + 0.5 * (self.vx_mps + vx_mps) * ahead_s
        y_m = self.y_m + 0.5 * (self.vy_mps + vy_mps) * ahead_s
        return replace(self, x_m=x_m, y_m=y_m, vx_mps=vx_mps, vy_mps=vy_mps)


@dataclass(frozen=True, slots=True)
class Conditions:
    """What else control goes by: the acceleration that no told lean explains (grid axes), against which it
    leans, by how much slower than configured it answers, 1 as configured, the roll and pitch that are told of
    a drone that is level; whether the told lean has leapt, and what of the push on a drone that sees nothing
    is put down to that."""

    unleant_mps2: tuple[float, float] = (0.0, 0.0)
    ease: float = 1.0
    level_rad: tuple[float, float] = (0.0, 0.0)
    leapt: bool = False
    blind_mps2: tuple[float, float] = (0.0, 0.0)


CALM = Conditions()


class FlightController:
    """Position, yaw and height loops.  Reset before flying after a time without control."""

    def __init__(self, config: ControlConfig) -> None:
        expert = config.expert
        integral_mps2 = expert.horizontal_integral_limit_mps2
        self._gains = config.horizontal
        self._most_mps2 = expert.horizontal_output_limit_mps2
        self._x = Pid(config.horizontal, integral_mps2, self._most_mps2)
        self._y = Pid(config.horizontal, integral_mps2, self._most_mps2)
        self._yaw = Pid(config.yaw, expert.yaw_integral_limit_radps, expert.yaw_output_limit_radps)
        self._height = Pid(config.height, expert.height_integral_limit_mps, expert.height_output_limit_mps)

    def reset(self) -> None:
        for loop in (self._x, self._y, self._yaw, self._height):
            loop.reset()

    def step(
        self, now_ns: int, motion: Motion, reference: Reference, dt_s: float, conditions: Conditions = CALM
    ) -> AttitudeSetpoint:
        """The full setpoint, all loops closed; level when any number it would be made of is not finite."""
        known = (motion.x_m, motion.y_m, motion.vx_mps, motion.vy_mps, motion.yaw_rad, motion.yaw_rate_radps)
        if not all(map(math.isfinite, (*known, reference.x_m, reference.y_m, reference.yaw_rad))):
            return self.level(now_ns, motion, reference, dt_s)
        ease, (push_x, push_y) = conditions.ease, conditions.unleant_mps2
        kd = ease * self._gains.kd
        wanted_x = reference.ax_mps2 + kd * reference.vx_mps - push_x
        wanted_y = reference.ay_mps2 + kd * reference.vy_mps - push_y
        off_x, off_y = reference.x_m - motion.x_m, reference.y_m - motion.y_m
        ax = self._x.step(off_x, motion.vx_mps, dt_s, wanted_x, ease)
        ay = self._y.step(off_y, motion.vy_mps, dt_s, wanted_y, ease)
        ax = self._stoppable(ax, off_x, motion.vx_mps, push_x, kd)
        ay = self._stoppable(ay, off_y, motion.vy_mps, push_y, kd)
        return self._tilted(now_ns, ax, ay, motion, reference, dt_s)

    def _stoppable(self, accel: float, off_m: float, rate_mps: float, push: float, kd: float) -> float:
        """The acceleration of one axis (m/s^2), against a strong push as much as it takes to go no faster
        with it than what is left to lean can stop within `off_m`: all that is leaned on at once, too late,
        does not."""
        if abs(push) < _STRONG * self._most_mps2:
            return accel
        way = math.copysign(1.0, push)
        left = _STOPS_BY * max(self._most_mps2 - abs(push), 0.0)
        most_mps = math.sqrt(2.0 * left * max(way * off_m, 0.0)) + _SLOW_MPS
        with_it = min(way * accel, kd * (most_mps - way * rate_mps) - abs(push))
        return way * max(with_it, -self._most_mps2)

    def level(
        self,
        now_ns: int,
        motion: Motion,
        reference: Reference,
        dt_s: float,
        level_rad: tuple[float, float] = (0.0, 0.0),
    ) -> AttitudeSetpoint:
        """Level, by the roll and pitch that are told then, and straight, height held: what is flown without a
        view of the floor.  The integrals stand still, ready for when the view comes back."""
        roll_rad, pitch_rad = level_rad
        return AttitudeSetpoint(now_ns, roll_rad, pitch_rad, 0.0, self._climb(motion, reference, dt_s))

    def rest(
        self,
        now_ns: int,
        motion: Motion,
        reference: Reference,
        dt_s: float,
        push_mps2: tuple[float, float],
        *,
        dead_reckoned: bool,
        ease: float = 1.0,
    ) -> AttitudeSetpoint:
        """Come to rest by the velocity alone (`dead_reckoned`: it is known), `ease` times as fast as
        configured, then lean only against the steady push as it was last known (grid axes), at most
        `_TRIM_MPS2`; straight, height held."""
        gains, most = self._gains, self._most_mps2
        trim = most if dead_reckoned else _TRIM_MPS2
        ax, ay = (-min(max(push, -trim), trim) for push in push_mps2)
        moving = (motion.vx_mps, motion.vy_mps, motion.yaw_rad)
        if not all(map(math.isfinite, moving)):
            return self.level(now_ns, motion, reference, dt_s)
        if dead_reckoned:
            ax = min(max(ax - ease * gains.kd * motion.vx_mps, -most), most)
            ay = min(max(ay - ease * gains.kd * motion.vy_mps, -most), most)
        cos, sin = math.cos(motion.yaw_rad), math.sin(motion.yaw_rad)
        return AttitudeSetpoint(
            now_ns,
            math.atan2(-sin * ax + cos * ay, GRAVITY_MPS2),
            -math.atan2(cos * ax + sin * ay, GRAVITY_MPS2),
            0.0,
            self._climb(motion, reference, dt_s),
        )

    def _tilted(
        self, now_ns: int, ax: float, ay: float, motion: Motion, reference: Reference, dt_s: float
    ) -> AttitudeSetpoint:
        cos, sin = math.cos(motion.yaw_rad), math.sin(motion.yaw_rad)
        forward, right = cos * ax + sin * ay, -sin * ax + cos * ay
        yaw_error = wrap_pi(reference.yaw_rad - motion.yaw_rad)
        return AttitudeSetpoint(
            now_ns,
            math.atan2(right, GRAVITY_MPS2),
            -math.atan2(forward, GRAVITY_MPS2),
            self._yaw.step(yaw_error, motion.yaw_rate_radps, dt_s, reference.yaw_rate_radps),
            self._climb(motion, reference, dt_s),
        )

    def _climb(self, motion: Motion, reference: Reference, dt_s: float) -> float:
        """Height loop; without a height only the climb rate that is fed forward."""
        if not math.isfinite(motion.height_m - reference.height_m):
            return reference.climb_mps if math.isfinite(reference.climb_mps) else 0.0
        return self._height.step(reference.height_m - motion.height_m, 0.0, dt_s, reference.climb_mps)
