"""The height by which the floor is seen once the range finder tells none: carried on by the told climb.

A picture cannot be placed on the floor without a height.  Where a range finder fails over a floor without
lines, nothing but that climb knows it, and the features of the floor, by which the drone would still know
its motion, say nothing without it; worse, the width of whatever looks like a line would be taken for the
height.
"""

from __future__ import annotations

import math

_CARRIED_NS = 4_000_000_000
"""So long a climb rate is believed: barometers wander by a fifth of a metre meanwhile."""
_ERROR_MPS = 0.05
_GAIN = 0.15
"""How soon widths of lines that agree put the height right."""
_FRESH_NS = 200_000_000
"""A range finder that told so lately tells still."""


class CarriedHeight:
    """Call `measured` and `by_width` as heights come; `at` is NaN once nothing has told it for too long."""

    def __init__(self) -> None:
        self._base_m = math.nan
        """The height less what was told to have been climbed."""
        self._told_ns = 0
        self._measured_ns = 0

    def forget(self) -> None:
        """What told the height, or the climb, is not believed any more."""
        self._base_m = math.nan

    def measured(self, stamp_ns: int, height_m: float, climbed_m: float) -> None:
        """The range finder told a height; `climbed_m` is the way that the vehicle has told to have climbed
        until then."""
        if math.isfinite(height_m + climbed_m):
            self._base_m = height_m - climbed_m
            self._told_ns = self._measured_ns = stamp_ns

    def by_width(self, stamp_ns: int, height_m: float, climbed_m: float) -> None:
        """Lines whose width agreed with the height tell this."""
        if stamp_ns - self._measured_ns > _FRESH_NS and math.isfinite(self._base_m + climbed_m):
            self._base_m += _GAIN * (height_m - climbed_m - self._base_m)
            self._told_ns = stamp_ns

    def error_m(self, stamp_ns: int) -> float:
        """Standard deviation of what the way since it was told last adds to the height."""
        untold_ns = max(stamp_ns - self._told_ns - _FRESH_NS, 0)
        return _ERROR_MPS * untold_ns * 1e-9 if math.isfinite(self._base_m) else 0.0

    def at(self, stamp_ns: int, measured_m: float, climbed_m: float) -> float:
        """The height (m) at that time, which the range finder's samples alone tell to be `measured_m`."""
        if stamp_ns - self._measured_ns <= _FRESH_NS or math.isnan(self._base_m + climbed_m):
            return measured_m
        return self._base_m + climbed_m if stamp_ns - self._told_ns <= _CARRIED_NS else measured_m
