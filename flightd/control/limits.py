"""The last word before the wire: whatever computed a setpoint, these limits hold."""

from __future__ import annotations

import math
from dataclasses import dataclass

from flightd.config.control import ControlConfig
from flightd.core.geometry import GRAVITY_MPS2
from flightd.core.types import AttitudeSetpoint

_LESS_CLIMB_MPS, _MORE_CLIMB_MPS = 1.5, 0.5
"""The most by which a climb is commanded otherwise for the vehicle's own error of it: rather too low."""
_GAP_S = 0.1
"""A longer gap between two setpoints counts as this long."""


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What the limits have to know. `headroom_m` is the way up to the ceiling (NaN: unknown, inf: none
    above), `back` the unit vector (forward, right) into the corridor that was left, None inside it;
    `data_age_s` the age of what the lean was computed from: the older of attitude and sight, of the grid's
    two axes the one seen last (the other is dead-reckoned, and doubted by its sigma), for a brake the newer
    of the two: pictures or attitude, either tells enough to come to rest by. `at_once`: an emergency stop is
    not kept waiting by the rates. `climb_error_mps`: the vehicle takes its climb for so much more than it is.
    `most_lean_rad`: the lean as a whole is no greater, whatever each axis is allowed. `haste`: the share of
    the configured tilt rate and jerk that it may change by, unless it comes to level by stale data or back
    into the corridor."""

    headroom_m: float = math.inf
    back: tuple[float, float] | None = None
    data_age_s: float = 0.0
    at_once: bool = False
    climb_error_mps: float = 0.0
    most_lean_rad: float = math.inf
    haste: float = 1.0


OPEN = Surroundings()
"""No ceiling, no walls, fresh data."""


class Limiter:
    """Applies the limits to one stream of setpoints, each relative to the one before it: tilt and its rate
    in roll and pitch each, the jerk of the horizontal acceleration g tan(tilt) as a vector.  By data older
    than `expert.stale_s` nothing leans or turns."""

    def __init__(self, limits: ControlConfig) -> None:
        self._limits = limits
        self._last = AttitudeSetpoint(0)

    def apply(self, wanted: AttitudeSetpoint, around: Surroundings = OPEN) -> AttitudeSetpoint:
        """The nearest setpoint within the limits.

        Rates bend to nothing but `at_once`, and then only towards level: a lean that became forbidden is
        taken back as fast as they allow, and never grows meanwhile.
        """
        limits, last = self._limits, self._last
        dt_s = min(max((wanted.stamp_ns - last.stamp_ns) * 1e-9, 0.0), _GAP_S)
        roll, pitch, yaw_rate = wanted.roll_rad, wanted.pitch_rad, wanted.yaw_rate_radps
        stale = not around.data_age_s <= limits.expert.stale_s  # NaN is stale, too
        if around.at_once or stale:
            roll = pitch = yaw_rate = 0.0
        share = min(1.0, around.most_lean_rad / (math.hypot(roll, pitch) or 1.0))
        roll, pitch = _clamp(share * roll, limits.max_tilt_rad), _clamp(share * pitch, limits.max_tilt_rad)
        if around.back is not None:
            roll, pitch = _inwards(roll, pitch, around.back)
            most = max(abs(roll), abs(pitch), limits.max_tilt_rad) / limits.max_tilt_rad
            roll, pitch = roll / most, pitch / most
        if not around.at_once:
            roll, pitch = self._swing(roll, pitch, dt_s if stale or around.back else around.haste * dt_s)
            yaw_rate = last.yaw_rate_radps + _clamp(
                yaw_rate - last.yaw_rate_radps, limits.expert.max_yaw_accel_radps2 * dt_s
            )
        climb = min(max(wanted.climb_mps, -limits.max_descend_mps), limits.max_climb_mps)
        error = min(max(around.climb_error_mps, -_LESS_CLIMB_MPS), _MORE_CLIMB_MPS)
        if not around.headroom_m > 0.0:  # NaN is no headroom
            climb, error = min(climb, 0.0), min(error, 0.0)
        climb += error  # the limits are those of the climb that it makes
        limited = AttitudeSetpoint(
            wanted.stamp_ns, roll, pitch, _clamp(yaw_rate, limits.max_yaw_rate_radps), climb
        )
        self._last = limited
        return limited

    def _swing(self, roll: float, pitch: float, dt_s: float) -> tuple[float, float]:
        """As far from the last lean towards this one as tilt rate and jerk allow in `dt_s`."""
        last, limits = self._last, self._limits
        # both axes by the same share, so that a lean which leads back never leads out on its way
        d_roll, d_pitch = roll - last.roll_rad, pitch - last.pitch_rad
        widest = max(abs(d_roll), abs(d_pitch))
        share = min(1.0, limits.expert.max_tilt_rate_radps * dt_s / widest) if widest else 1.0
        roll, pitch = last.roll_rad + share * d_roll, last.pitch_rad + share * d_pitch
        change = GRAVITY_MPS2 * math.hypot(
            math.tan(roll) - math.tan(last.roll_rad), math.tan(pitch) - math.tan(last.pitch_rad)
        )
        most = limits.expert.max_jerk_mps3 * dt_s
        if change <= most:
            return roll, pitch
        part = most / change
        return (
            math.atan(math.tan(last.roll_rad) + part * (math.tan(roll) - math.tan(last.roll_rad))),
            math.atan(math.tan(last.pitch_rad) + part * (math.tan(pitch) - math.tan(last.pitch_rad))),
        )


def _inwards(roll: float, pitch: float, back: tuple[float, float]) -> tuple[float, float]:
    """The lean without its part that points out of the corridor."""
    forward, right = -math.tan(pitch), math.tan(roll)
    along = forward * back[0] + right * back[1]
    if along >= 0.0:
        return roll, pitch
    return math.atan(right - along * back[1]), -math.atan(forward - along * back[0])


def _clamp(value: float, limit: float) -> float:
    return min(max(value, -limit), limit)
