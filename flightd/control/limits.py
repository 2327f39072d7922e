"""The last word before the wire: whatever computed a set point, these limits hold."""

from __future__ import annotations

from dataclasses import dataclass

from flightd.core.types import AttitudeSetpoint


@dataclass(frozen=True, slots=True)
class Limits:
    """Largest magnitudes.  Tilt is limited in roll and pitch each; `tilt_rate` bounds how fast a tilt set
    point may change (which bounds the jerk: g times the rate)."""

    tilt_rad: float
    tilt_rate_radps: float
    yaw_rate_radps: float
    climb_mps: float
    descend_mps: float


class Limiter:
    """Applies `Limits` to one stream of set points, each relative to the one before it."""

    def __init__(self, limits: Limits) -> None:
        self._limits = limits
        self._last = AttitudeSetpoint(0)

    def apply(self, wanted: AttitudeSetpoint) -> AttitudeSetpoint:
        """The nearest set point within the limits.  A gap of more than 0.1 s counts as 0.1 s."""
        limits = self._limits
        dt_s = min(max((wanted.stamp_ns - self._last.stamp_ns) * 1e-9, 0.0), 0.1)
        swing = limits.tilt_rate_radps * dt_s
        limited = AttitudeSetpoint(
            wanted.stamp_ns,
            _slew(self._last.roll_rad, _clamp(wanted.roll_rad, limits.tilt_rad), swing),
            _slew(self._last.pitch_rad, _clamp(wanted.pitch_rad, limits.tilt_rad), swing),
            _clamp(wanted.yaw_rate_radps, limits.yaw_rate_radps),
            min(max(wanted.climb_mps, -limits.descend_mps), limits.climb_mps),
        )
        self._last = limited
        return limited


def _clamp(value: float, limit: float) -> float:
    return min(max(value, -limit), limit)


def _slew(last: float, wanted: float, swing: float) -> float:
    return last + _clamp(wanted - last, swing)
