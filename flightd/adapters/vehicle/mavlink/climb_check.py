"""Whether the climb rate that the vehicle tells can be flown by, where thrust is ours.

A rate that stands still, whatever the vehicle does, is answered with ever more thrust.  It is found by three
things together: it stays off the rate that is wanted, it does not move although thrust pushes it there, and
the height does.  A range finder that sticks shows nothing of that: its height does not move, though a right
rate stands still, too, where the hover thrust is learnt too high and the loop has not yet made up for it.
Of a rate that is told no more nothing but the height's is left.  Pure.
"""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

from flightd.adapters.vehicle.mavlink.height_loop import VELOCITY_PER_S

_KEPT_NS, _SPAN_NS, _SAMPLES = 600_000_000, 250_000_000, 6
"""A slope is of the newest samples that span so long, but of no fewer; older ones are not kept."""
_FRESH_NS = 250_000_000
_UNTOLD_NS = 400_000_000
"""A rate that was not told for so long will not come again soon."""
_LEAP_M, _LEAP_MPS = 0.1, 3.0
"""A height that changes by more from one sample to the next is that of another floor: goods, a pallet."""
_PUSHED_MPS, _PUSHED_NS, _PUSH_KEPT_NS = 0.3, 200_000_000, 600_000_000
"""What thrust was raised by for the rate that is wanted should have changed the rate by so much, and has had
the time for that."""
_OFF_MPS, _STILL_MPS = 0.15, 0.1
"""So far off what is wanted all the while, and no more moved."""
_AHEAD_MPS, _AHEAD_NS = 0.4, 100_000_000
"""So much further the height's rate is where the told one is pushed to, for so long."""
_MOVES_M, _MOVES_NS = 0.03, 120_000_000
"""And the height itself has changed by more within the last moments: one that has just stuck still has a
slope, and from then on one of nothing, which is ahead of any climb that shall end."""


class _Told(NamedTuple):
    stamp_ns: int
    told_mps: float
    off_mps: float


class ClimbCheck:
    """Call `height` with each sample of the range finder, then `believed_mps` at each setpoint."""

    def __init__(self) -> None:
        self._heights: deque[tuple[int, float]] = deque()
        self._rates: deque[_Told] = deque()
        self._ahead_ns: int | None = None
        self._untold_ns: int | None = None
        self.contradicted = False
        """The told rate is wrong, for good: one that stands still agrees with every hover."""
        self.by_height = False
        """The rate that was believed last is the height's."""

    def height(self, stamp_ns: int, height_m: float) -> None:
        """Take a sample, in order of time; the same one again is passed over."""
        heights = self._heights
        if heights and stamp_ns <= heights[-1][0]:
            return
        if heights:
            since_s = (stamp_ns - heights[-1][0]) * 1e-9
            if abs(height_m - heights[-1][1]) > _LEAP_M + _LEAP_MPS * since_s:
                heights.clear()
        heights.append((stamp_ns, height_m))
        while stamp_ns - heights[0][0] > _KEPT_NS:
            heights.popleft()
        while len(heights) > _SAMPLES and stamp_ns - heights[1][0] >= _SPAN_NS:
            heights.popleft()

    def believed_mps(self, now_ns: int, told_mps: float, wanted_mps: float) -> float:
        """The climb rate to close the loop by: as told, or the height's where that contradicts it or none has
        been told for a while (NaN where there is none of either), m/s, + up; `wanted_mps` is what the loop
        pushes towards, NaN where it does not carry the vehicle."""
        slope_mps = self._slope_mps(now_ns)
        ahead = (
            self._stands_still(now_ns, told_mps, wanted_mps)
            and self._height_moves()
            and math.copysign(1.0, wanted_mps - told_mps) * (slope_mps - told_mps) > _AHEAD_MPS  # NaN: no
        )
        self._ahead_ns = (self._ahead_ns or now_ns) if ahead else None
        self.contradicted |= self._ahead_ns is not None and now_ns - self._ahead_ns >= _AHEAD_NS
        self._untold_ns = (self._untold_ns or now_ns) if math.isnan(told_mps) else None
        untold = self._untold_ns is not None and now_ns - self._untold_ns >= _UNTOLD_NS
        self.by_height = self.contradicted or untold
        return slope_mps if self.by_height else told_mps

    def _stands_still(self, now_ns: int, told_mps: float, wanted_mps: float) -> bool:
        """The told rate has not moved for a while although it is pushed one way."""
        off_mps = wanted_mps - told_mps
        rates = self._rates
        if not abs(off_mps) > _OFF_MPS or (rates and rates[-1].off_mps * off_mps < 0.0):
            rates.clear()
            return False
        rates.append(_Told(now_ns, told_mps, off_mps))
        while now_ns - rates[0].stamp_ns > _PUSH_KEPT_NS:
            rates.popleft()
        told = [rate.told_mps for rate in rates]
        if now_ns - rates[0].stamp_ns < _PUSHED_NS or max(told) - min(told) > _STILL_MPS:
            return False
        mean_mps = sum(abs(rate.off_mps) for rate in rates) / len(rates)
        return VELOCITY_PER_S * mean_mps * (now_ns - rates[0].stamp_ns) * 1e-9 > _PUSHED_MPS

    def _height_moves(self) -> bool:
        newest_ns, newest_m = self._heights[-1] if self._heights else (0, math.nan)
        before = (
            height_m for stamp_ns, height_m in reversed(self._heights) if newest_ns - stamp_ns >= _MOVES_NS
        )
        return abs(newest_m - next(before, math.nan)) > _MOVES_M  # NaN: no

    def _slope_mps(self, now_ns: int) -> float:
        """Of the height over the last moments, by least squares; NaN where it is not known."""
        heights = self._heights
        if len(heights) < _SAMPLES or now_ns - heights[-1][0] > _FRESH_NS:
            return math.nan
        first_ns = heights[0][0]
        if heights[-1][0] - first_ns < 0.8 * _SPAN_NS:
            return math.nan
        times_s = [(stamp_ns - first_ns) * 1e-9 for stamp_ns, _ in heights]
        mean_s = sum(times_s) / len(times_s)
        mean_m = sum(height_m for _, height_m in heights) / len(heights)
        spread = sum((time_s - mean_s) ** 2 for time_s in times_s)
        moved = sum(
            (time_s - mean_s) * (height_m - mean_m)
            for time_s, (_, height_m) in zip(times_s, heights, strict=True)
        )
        return moved / spread
