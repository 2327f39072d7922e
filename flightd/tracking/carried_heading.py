"""The heading carried by the vehicle's gyros, for steel bends the compass that it tells it by.  Pure."""

from __future__ import annotations

import math
from collections import deque
from operator import itemgetter

from flightd.core.geometry import wrap_pi
from flightd.core.types import Attitude

LEAP_RAD, FASTEST_RADPS = math.radians(3.0), 2.0
"""A told heading that turns by more than this between two samples leaps."""
GAP_S = 0.1
"""Between samples further apart neither a leap nor what the gyros felt shows."""
_MOST_RADPS = 10.0
_LIVELY = 5
"""A rate that did not change so often in a row is not measured: some fill the field with a constant."""
_ASTRAY_RAD, _ASTRAY_NS = math.radians(6.0), 500_000_000
"""No steel turns a told heading by so much against the gyros within this time."""
_SHOWN_NS = 1_500_000_000
_APART_RAD = itemgetter(1)


class CarriedHeading:
    """Between two samples the heading turns by the rate of the gyros while lines are seen, which find out
    what they drift by; where nothing bounds their drift, where they tell nothing or were found to be wrong,
    as the vehicle tells its heading.  Call `take` with each sample."""

    def __init__(self) -> None:
        self._last: Attitude | None = None
        self._heading_rad = 0.0
        self._lively = 0
        self._apart: deque[tuple[int, float]] = deque()
        self.leap_rad = 0.0
        """By how much the told heading has turned faster against the gyros than any steel turns it; 0 if it
        has not, or has turned back."""
        self._leapt_ns: int | None = None
        self.gyros_wrong = False

    @property
    def leapt_lately(self) -> bool:
        """The told heading turned so, or the gyros are wrong, within the last second or two."""
        last, leapt_ns = self._last, self._leapt_ns
        return last is not None and leapt_ns is not None and last.stamp_ns - leapt_ns < _SHOWN_NS

    @property
    def lead_rad(self) -> float:
        """Carried heading less told one, of the newest sample."""
        return 0.0 if self._last is None else wrap_pi(self._heading_rad - self._last.yaw_rad)

    def take(self, sample: Attitude, *, watched: bool) -> Attitude:
        """The sample with the heading as it is carried on; `watched`: lines were seen lately."""
        last = self._last
        if last is None:
            self._last, self._heading_rad = sample, sample.yaw_rad
            return sample
        dt_s = (sample.stamp_ns - last.stamp_ns) * 1e-9
        if not dt_s > 0.0:
            return sample.turned_to(self._heading_rad)
        self._last = sample
        told_rad, felt_rad = wrap_pi(sample.yaw_rad - last.yaw_rad), self._felt_rad(last, sample, dt_s)
        apart_rad = wrap_pi(told_rad - felt_rad)
        self._mind(sample.stamp_ns, apart_rad)
        # what leaps in one sample is not followed anyhow: no bias matters in that time
        by_gyros = not math.isnan(felt_rad) and (watched or abs(apart_rad) > LEAP_RAD)
        self._heading_rad = wrap_pi(self._heading_rad + (felt_rad if by_gyros else told_rad))
        return sample.turned_to(self._heading_rad)

    def distrust(self) -> None:
        """The gyros are wrong: from now on the heading is the told one."""
        self.gyros_wrong = True
        if self._last is not None:
            self._heading_rad = self._last.yaw_rad

    def _mind(self, stamp_ns: int, apart_rad: float) -> None:
        """Add up what the told heading turned more than the gyros felt."""
        if math.isnan(apart_rad):
            self._apart.clear()
            return
        self._apart.append((stamp_ns, apart_rad))
        while self._apart[0][0] < stamp_ns - _ASTRAY_NS:
            self._apart.popleft()
        turned_rad = sum(map(_APART_RAD, self._apart))
        if abs(turned_rad) > _ASTRAY_RAD:
            self._apart.clear()
            whole_rad = self.leap_rad + turned_rad
            self.leap_rad, self._leapt_ns = whole_rad if abs(whole_rad) > _ASTRAY_RAD else 0.0, stamp_ns

    def _felt_rad(self, last: Attitude, sample: Attitude, dt_s: float) -> float:
        """What the gyros felt between two samples; NaN where they tell nothing of it."""
        before, after = last.yaw_rate_radps, sample.yaw_rate_radps
        known = abs(before) <= _MOST_RADPS and abs(after) <= _MOST_RADPS  # NaN fails too
        self._lively = min(self._lively + 1, _LIVELY) if known and before != after else 0
        if self._lively < _LIVELY or dt_s > GAP_S or self.gyros_wrong:
            return math.nan
        return 0.5 * (before + after) * dt_s
