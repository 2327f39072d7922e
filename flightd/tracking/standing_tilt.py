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
