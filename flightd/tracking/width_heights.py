"""The height that the width of the lines tells, against the one that the vehicle tells."""

from __future__ import annotations

import math
from collections.abc import Sequence
from statistics import median

_MEMORY_S = 0.2
_LONGEST_S = 0.2
"""A frame that comes later after the last one counts as if it came so late."""
_AGREEING, _DOUBTED = 0.15, 0.2
_STEADY, _STEADY_PER_S = 0.03, 0.9
"""Lines whose widths tell heights that change by more from frame to frame (share, and share a second between
them) are none of the map; a fast climb changes them by less."""
LEAP, LEAP_PER_S = 0.04, 1.8
"""A height by widths that leaps by more from one frame to the next is another line's, but for a climb near
the floor."""
_STEADY_S, _STEADY_SHARE = 0.95, 0.08
"""Widths that never agreed with the height are held against it, too, once they were so long the same share
of it, within so much on average: a range finder that reads too little from the floor on."""
_OTHER_S = 2.95
"""The same for a line of another width than those before it, of which no range finder can be the cause."""
_UNMEASURED_M = 0.35
"""Range finders need not measure less: one that reads its least above a drone that stands, or is hardly up,
is right, and tells no height."""
_LOW_M, _NOT_LOW_M = 0.5, 0.9
"""Up to here lines are so wide in the picture that they tell its height better than a range finder, which
lags behind a take-off or measures nothing yet; from there up to there both tell it."""
_LOW_SHARE = 0.35
"""A line that tells a height further off than by this share of it (its logarithm) may be none of the map: a
take-off of 0.9 m/s is told 0.1 m too low by a range finder that lags 0.1 s.  But for a height that the range
finder cannot measure: what its least reading is off from there is no error of the line."""
_RISES_MPS = 1.5
_STEADY_MPS = 1.0
"""No take-off climbs faster, so near the floor its heights change by no more; as a rule by two thirds."""
_GAP_S = 0.5
"""A gap without lines counts as one of so long at most."""
_RANGE_LAG_S, _DELAY_SIGMAS = 0.1, 2.0
"""A range finder tells the height of so long before its stamp, as a rule at most: what it averages over.  A
frame is of so many standard deviations of its delay earlier or later at most."""


def climbed_between_m(climb_mps: float, delay_sigma_s: float) -> tuple[float, float]:
    """The least and the most that a vehicle may climb, at that rate (NaN: not known), from when the height
    was true that its range finder tells of a frame's exposure until the frame was exposed."""
    if math.isnan(climb_mps):
        return 0.0, 0.0
    unsure_s = _DELAY_SIGMAS * delay_sigma_s
    one_m, other_m = -unsure_s * climb_mps, (_RANGE_LAG_S + unsure_s) * climb_mps
    return min(one_m, other_m), max(one_m, other_m)


class WidthHeights:
    """Call `believed_m` with each frame."""

    def __init__(self) -> None:
        self._share = 1.0
        self._changes = 0.0
        self._last_m: float | None = None
        self._stamp_ns = self._last_ns = 0
        self._judged = False
        self._followed = False  # by its widths, from frame to frame, since it last agreed with the one told
        self._watched = _Watched()
        self._told_m = 0.0
        self.by_width_m: float | None = None
        """What the newest frame's lines tell, where they could be held against a height; None where not."""

    @property
    def share(self) -> float:
        """The height told lately against that by the width: near 1 while they agree, 1 while the widths do
        not agree with each other."""
        return self._share if self._changes < 1.0 else 1.0

    @property
    def tell(self) -> bool:
        """The newest frame's widths could be held against a height, and lately they agree with each other."""
        return self.by_width_m is not None and self._changes < 1.0

    @property
    def off_m(self) -> float:
        """How much higher the height was told last than the widths have it, by that share, m."""
        return self._told_m - self._told_m / self.share

    def believed_m(
        self,
        by_width_m: Sequence[float],
        told_m: float,
        stamp_ns: int,
        climbed_m: tuple[float, float] = (0.0, 0.0),
    ) -> float:
        """The height `told_m` of a frame exposed at `stamp_ns`, unless there is none or the heights of its
        lines by their widths contradict it for long: then theirs.  Theirs at once where they go on as before
        and what is told leaps away from them.  `climbed_m` is the least and the most that may have been
        climbed from when that height was true until that exposure: what it explains contradicts nothing."""
        self.by_width_m = None
        if not by_width_m or not told_m > 0:
            return median(by_width_m) if by_width_m else told_m / self._believed_share
        nearest_m = min(by_width_m, key=lambda height_m: abs(height_m - told_m))  # one that agrees is enough
        dt_s = min((stamp_ns - self._stamp_ns) * 1e-9, _LONGEST_S)
        agrees = abs(told_m / nearest_m - 1.0) < _AGREEING
        leap = LEAP + self._rise(told_m, stamp_ns, dt_s, LEAP_PER_S, _RISES_MPS)
        agrees = agrees and not self._left_behind(by_width_m, told_m, leap)
        if not agrees and nearest_m < told_m < _UNMEASURED_M:
            return told_m / self._believed_share
        if self._last_m is not None and not agrees:  # it is no better for being nearer to what is wrong
            last_m = self._last_m
            nearest_m = min(by_width_m, key=lambda height_m: abs(height_m - last_m))
        share = told_m / nearest_m
        change = self._change(nearest_m, share)
        gain = _gain(dt_s)
        goes_on = change < leap
        steady = _STEADY + self._rise(told_m, stamp_ns, dt_s, _STEADY_PER_S, _STEADY_MPS)
        self._stamp_ns = stamp_ns
        if agrees or (self._judged and goes_on):
            if not self._judged:
                self._judged, self._share = True, 1.0
            self._watched = _Watched()
        else:
            steady_share = self._watched.steady_share(share, dt_s, _OTHER_S if self._judged else _STEADY_S)
            if steady_share is None:  # then it is the line that is another
                return told_m / self._believed_share
            self._judged, self._share, self._watched = True, steady_share, _Watched()
        least_m, most_m = (told_m + by_m for by_m in climbed_m)
        self._share += gain * (min(max(nearest_m, least_m), most_m) / nearest_m - self._share)
        if self._last_m is not None:
            self._changes += gain * (change / steady - self._changes)
            self._followed = agrees or (self._followed and goes_on)
        self._last_m = self.by_width_m = nearest_m
        self._last_ns, self._told_m = stamp_ns, told_m
        leapt = self._followed and abs(share - 1.0) > _DOUBTED
        return nearest_m if leapt or self._believed_share != 1.0 else told_m

    def _rise(self, told_m: float, stamp_ns: int, dt_s: float, per_s: float, mps: float) -> float:
        """By how much what the lines tell may change in `dt_s`, as a share: near the floor any climb changes
        it by much.  Not after a gap, in which it may have become another line, unless what is told stood
        still near the floor meanwhile: it may be stuck there."""
        if self._last_m is None:
            return per_s * dt_s
        since_s = (stamp_ns - self._last_ns) * 1e-9
        stuck = told_m < _LOW_M and abs(told_m / self._told_m - 1.0) < _AGREEING
        if since_s > _LONGEST_S and not stuck:
            return per_s * dt_s
        return max(per_s * dt_s, math.log1p(mps * min(since_s, _GAP_S) / self._last_m))

    def _left_behind(self, by_width_m: Sequence[float], told_m: float, leap: float) -> bool:
        """A told height that has left those of the lines that are followed is not right again because some
        other line happens to agree with it."""
        last_m = self._last_m
        if last_m is None or not self._followed or self._believed_share == 1.0:
            return False
        same_m = min(by_width_m, key=lambda height_m: abs(height_m - last_m))
        goes_on = abs(math.log(same_m / last_m)) < leap
        return goes_on and abs(told_m / same_m - 1.0) > _DOUBTED

    def _change(self, nearest_m: float, share: float) -> float:
        """By how much both what the widths tell and its share of what is told have changed, as a share: then
        it is a line of another width.  Of a range finder that leaps only the share does, of a climb that
        nobody saw only the height."""
        if self._last_m is None or not self._told_m > 0.0:
            return 0.0
        by_width, by_share = nearest_m / self._last_m, share * self._last_m / self._told_m
        return min(abs(math.log(by_width)), abs(math.log(by_share)), 1.0)

    @property
    def _believed_share(self) -> float:
        return self.share if abs(self.share - 1.0) > _DOUBTED else 1.0


def _gain(dt_s: float) -> float:
    """Of a frame that much after the last one, in a mean over the memory."""
    return 1.0 - math.exp(-dt_s / _MEMORY_S)


class NearFloor:
    """The height near the floor: that by the width of a line that is followed from frame to frame."""

    def __init__(self) -> None:
        self._last_m: float | None = None
        self._stamp_ns = 0

    def height_m(self, by_width_m: Sequence[float], told_m: float, stamp_ns: int) -> float:
        """The height `told_m` of the frame exposed at `stamp_ns`; a low one as the line has it whose width
        agrees best with it, if that tells about the same and the line before went on into it."""
        dt_s, last_m = min((stamp_ns - self._stamp_ns) * 1e-9, _LONGEST_S), self._last_m
        self._stamp_ns, self._last_m = stamp_ns, None
        if not by_width_m or not 0.0 < told_m < _NOT_LOW_M:
            return told_m
        self._last_m = now_m = min(by_width_m, key=lambda one_m: abs(math.log(one_m / told_m)))
        off = math.log(now_m / told_m)
        goes_on = last_m is not None and abs(now_m - last_m) < LEAP * now_m + _RISES_MPS * dt_s
        near = abs(off) < _LOW_SHARE or now_m < told_m < _UNMEASURED_M
        low = min((_NOT_LOW_M - told_m) / (_NOT_LOW_M - _LOW_M), 1.0)
        return told_m * math.exp(low * off) if goes_on and near else told_m


class _Watched:
    """The share of the height by widths as which one is told, of lines that are not believed yet."""

    def __init__(self) -> None:
        self._lasted_s = 0.0
        self._mean: float | None = None
        self._strays = 0.0

    def steady_share(self, share: float, dt_s: float, needed_s: float) -> float | None:
        """Take one frame's, `dt_s` after the last; None until it was the same for so long."""
        mean = share if self._mean is None else self._mean
        gain = _gain(dt_s)
        self._lasted_s += dt_s
        self._mean = mean + gain * (share - mean)
        self._strays += gain * (abs(share / mean - 1.0) - self._strays)
        return self._mean if self._lasted_s >= needed_s and self._strays < _STEADY_SHARE else None
