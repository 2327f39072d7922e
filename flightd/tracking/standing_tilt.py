"""The attitude that is told of a drone that stands: its legs' on the floor, and the error of the attitude."""

from __future__ import annotations

import math

from flightd.core.types import Attitude

_MEAN_S = 0.5
"""Over so long it is averaged."""
_STILL_RAD = math.radians(1.0)
"""What differs from the mean by more is not of a drone that stands still."""
_STANDS_S = 1.0
"""It stands once it has been still for so long."""
_GAP_S = 1.0
"""In so long without a sample somebody may have moved it."""
_USUAL_SIGMAS, _MOST_SIGMAS = 2.5, 4.0
"""Legs lean a drone by no more, one that stands on a cable does: what is further off says the less the
further it is (Hampel's estimator), and at last nothing."""


class StandingTilt:
    """Call `take` with each sample of an attitude while nothing flies; time and data in, data out."""

    def __init__(self) -> None:
        self._roll_rad = self._pitch_rad = 0.0
        self._since_ns = self._last_ns = 0

    def at(self, now_ns: int) -> tuple[float, float] | None:
        """Mean of roll and pitch (rad) lately; None where it has not stood still, or not until now."""
        stood_s, age_s = (self._last_ns - self._since_ns) * 1e-9, (now_ns - self._last_ns) * 1e-9
        stands = stood_s >= _STANDS_S and age_s <= _GAP_S
        return (self._roll_rad, self._pitch_rad) if stands else None

    def take(self, sample: Attitude) -> None:
        """One that is not newer than the last is ignored."""
        dt_s = (sample.stamp_ns - self._last_ns) * 1e-9
        if self._last_ns and dt_s <= 0.0:
            return
        self._last_ns = sample.stamp_ns
        off_roll_rad, off_pitch_rad = sample.roll_rad - self._roll_rad, sample.pitch_rad - self._pitch_rad
        still = abs(off_roll_rad) < _STILL_RAD and abs(off_pitch_rad) < _STILL_RAD
        if not still or dt_s > _GAP_S:
            self._roll_rad, self._pitch_rad, self._since_ns = (
                sample.roll_rad,
                sample.pitch_rad,
                sample.stamp_ns,
            )
            return
        part = min(dt_s / _MEAN_S, 1.0)
        self._roll_rad += part * off_roll_rad
        self._pitch_rad += part * off_pitch_rad


def tilt_error(told_rad: float, variance: float, stand_variance: float) -> tuple[float, float]:
    """By what a roll or pitch is told too small (rad) of a drone that stands, and the variance of that; it is
    told so, and was unknown by `variance`, the legs' tilt is by `stand_variance` (rad^2)."""
    spread = variance + stand_variance
    sigmas = abs(told_rad) / math.sqrt(spread)
    if not sigmas < _MOST_SIGMAS:
        return 0.0, variance
    share = variance / spread
    fades = min((_MOST_SIGMAS - sigmas) / (_MOST_SIGMAS - _USUAL_SIGMAS), 1.0)
    error_rad = -math.copysign(fades * min(sigmas, _USUAL_SIGMAS) * math.sqrt(spread) * share, told_rad)
    return error_rad, variance * (1.0 - share) if sigmas <= _USUAL_SIGMAS else variance
