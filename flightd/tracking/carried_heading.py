"""The heading carried by the vehicle's gyros, for steel bends the compass that it tells it by.  Pure."""

from __future__ import annotations

import math
from dataclasses import replace

from flightd.core.geometry import wrap_pi
from flightd.core.types import Attitude

LEAP_RAD, FASTEST_RADPS = math.radians(3.0), 2.0
"""A told heading that turns by more than this between two samples leaps."""
GAP_S = 0.1
"""Between samples further apart neither a leap nor what the gyros felt shows."""
_MOST_RADPS = 10.0
_QUIET = 5
"""A rate told so often without any change is not measured: some fill the field with a constant."""
_SHOWN_NS = 1_500_000_000


class CarriedHeading:
    """Between two samples the heading turns by the rate of the gyros while the floor is watched, whose lines
    find out what they drift by; where nothing bounds their drift, or they tell nothing, as the vehicle tells
    its heading.  Call `take` with each sample."""

    def __init__(self) -> None:
        self._last: Attitude | None = None
        self._heading_rad = 0.0
        self._same = 0
        self._leap_rad, self._leap_ns = 0.0, 0

    @property
    def leap_rad(self) -> float:
        """By how much the told heading lately leapt while the gyros felt nothing; 0 if it did not."""
        recent = self._last is not None and self._last.stamp_ns - self._leap_ns < _SHOWN_NS
        return self._leap_rad if recent else 0.0

    @property
    def lead_rad(self) -> float:
        """Carried heading less told one, of the newest sample."""
        return 0.0 if self._last is None else wrap_pi(self._heading_rad - self._last.yaw_rad)

    def take(self, sample: Attitude, *, watched: bool) -> Attitude:
        """The sample with the heading as it is carried on."""
        last = self._last
        if last is None:
            self._last, self._heading_rad = sample, sample.yaw_rad
            return sample
        dt_s = (sample.stamp_ns - last.stamp_ns) * 1e-9
        if not dt_s > 0.0:
            return replace(sample, yaw_rad=self._heading_rad)
        told_rad, felt_rad = wrap_pi(sample.yaw_rad - last.yaw_rad), self._felt_rad(last, sample, dt_s)
        if not math.isnan(felt_rad) and abs(wrap_pi(told_rad - felt_rad)) > LEAP_RAD:
            self._leap_rad, self._leap_ns = self.leap_rad + wrap_pi(told_rad - felt_rad), sample.stamp_ns
        by_gyros = watched and not math.isnan(felt_rad)
        self._last, self._heading_rad = (
            sample,
            wrap_pi(self._heading_rad + (felt_rad if by_gyros else told_rad)),
        )
        return replace(sample, yaw_rad=self._heading_rad)

    def _felt_rad(self, last: Attitude, sample: Attitude, dt_s: float) -> float:
        """What the gyros felt between two samples; NaN where they tell nothing of it."""
        before, after = last.yaw_rate_radps, sample.yaw_rate_radps
        self._same = self._same + 1 if before == after else 0
        known = abs(before) <= _MOST_RADPS and abs(after) <= _MOST_RADPS  # NaN fails too
        if not known or self._same >= _QUIET or dt_s > GAP_S:
            return math.nan
        return 0.5 * (before + after) * dt_s
