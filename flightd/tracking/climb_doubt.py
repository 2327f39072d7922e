"""Whether the climb rate that is told is that of the vehicle: range finder and lines' width against it.

An autopilot flies by its own climb rate.  Where a door opens or a duct blows, the barometer's air moves, and
a drone that is to hover climbs while it tells that it does not.  Goods below move the range finder alone, a
range finder that sticks leaves the width of the lines to change alone: only both together contradict it.
Where the range finder tells nothing the lines contradict it alone, but only those that are seen for a while:
over bare floor a seam that shows in a few frames is as wide as a line from another height.  Nor does a width
count beside it that goes on from none before, for a few frames: of all stripes an echo may agree with one.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from typing import NamedTuple

from flightd.tracking.width_heights import LEAP, LEAP_PER_S

_WINDOW_NS = 2_000_000_000
_OFF_M, _NOTICED_M = 0.35, 0.15
"""What both heights changed by more, or less, than what was told within the window: barometers err by less.
From `_NOTICED_M` on the climb is put right: a door's gust moves a drone by a metre in a second."""
_AGREEING_M, _AGREEING_SHARE = 0.12, 0.25
"""So far the changes of the two heights may differ: one of them is scaled, the other one noisy."""
_ALONE_NS, _GAP_NS = 400_000_000, 150_000_000
"""So long lines have to be seen to tell anything alone, in frames no further apart; beside the range finder,
lines as wide as none that was followed."""
_ALONE_M = 1.75
"""From so high on what they contradict alone counts for less: a width is noisy by a share of the height."""
_RATE_NS, _HELD_NS = 300_000_000, 500_000_000
"""The error of the rate is that of the newest samples that span so long, and holds for so long without."""


class _Sample(NamedTuple):
    stamp_ns: int
    range_m: float
    width_m: float
    climbed_m: float


class ClimbDoubt:
    """Call `step` with each frame that shows lines; a new flight begins with a new one."""

    def __init__(self) -> None:
        self.found = False
        """Stays so until the end of the flight."""
        self._noticed = False
        self._last: _Sample | None = None
        self._since_ns = 0
        """Since when each frame's width went on from that of the one before."""
        self._followed: _Sample | None = None
        self._strange_ns: int | None = None
        """Since when no frame's width went on from that of the one followed."""
        self._samples: deque[_Sample] = deque()

    def step(
        self, stamp_ns: int, range_m: float, width_m: float, climbed_m: float, *, alone: bool = False
    ) -> None:
        """Take what range finder and lines' width tell of the height at a frame's exposure, and what the
        vehicle had told to have climbed until then, m.  Lines that are `alone` stand for the range finder,
        too."""
        new = _Sample(stamp_ns, range_m, width_m, climbed_m)
        samples = self._samples
        while samples and stamp_ns - samples[0].stamp_ns > _WINDOW_NS:
            samples.popleft()
        last, self._last = self._last, new
        if last is None or stamp_ns - last.stamp_ns > _GAP_NS:
            self._since_ns, self._followed = stamp_ns, None
        elif not _goes_on(new, last):
            self._since_ns = stamp_ns
        if alone:
            self._followed, unsure = None, stamp_ns - self._since_ns < _ALONE_NS
        else:
            unsure = self._is_strange(new)
        if unsure:
            self._noticed = self.found or (self._noticed and not alone)
            return
        off_m = _most_off_m(new, samples)
        if alone:
            off_m *= min(_ALONE_M / width_m, 1.0)
        self.found = self.found or off_m > _OFF_M
        self._noticed = self.found or off_m > _NOTICED_M
        samples.append(new)

    def forget(self) -> None:
        """What was told of the climb was interrupted: nothing older is compared."""
        self._samples.clear()
        self._last = None

    def _is_strange(self, new: _Sample) -> bool:
        """Its width is another line's than the one followed, and has not been seen for long.  None is once
        the climb was found to be wrong: it is put right down to the floor, where no line is followed."""
        followed = self._followed
        if not (self.found or followed is None or _goes_on(new, followed)):
            self._strange_ns = self._strange_ns or new.stamp_ns
            if new.stamp_ns - self._strange_ns < _ALONE_NS:
                return True
        self._followed, self._strange_ns = new, None
        return False

    def error_mps(self, now_ns: int) -> float:
        """How much too great the told rate is; 0 where nothing is noticed, and while the heights do not agree
        on it."""
        samples = self._samples
        if not self._noticed or not samples or now_ns - samples[-1].stamp_ns > _HELD_NS:
            return 0.0
        new = samples[-1]
        old = next((sample for sample in samples if new.stamp_ns - sample.stamp_ns <= _RATE_NS), new)
        span_s = (new.stamp_ns - old.stamp_ns) * 1e-9
        if span_s < 0.4e-9 * _RATE_NS or not _agree(new, old):
            return 0.0
        return ((new.climbed_m - old.climbed_m) - (new.range_m - old.range_m)) / span_s


def _goes_on(new: _Sample, last: _Sample) -> bool:
    """Its width is that of the other one, which may be older than a gap: what changed since is not known."""
    since_ns = min(new.stamp_ns - last.stamp_ns, _GAP_NS)
    return abs(new.width_m / last.width_m - 1.0) < LEAP + LEAP_PER_S * since_ns * 1e-9


def _most_off_m(new: _Sample, samples: Iterable[_Sample]) -> float:
    """How far both heights say that the told climb is off, at most since any of these; 0 where they do not
    agree on that."""
    most_m = 0.0
    _, new_range_m, new_width_m, new_climbed_m = new
    for old in samples:
        _, range_m, width_m, climbed_m = old
        told_m = new_climbed_m - climbed_m
        by_range_m = (new_range_m - range_m) - told_m
        if abs(by_range_m) <= most_m:  # of dozens at each frame hardly one is more
            continue
        by_width_m = (new_width_m - width_m) - told_m
        if abs(by_width_m) > most_m and by_range_m * by_width_m > 0.0 and _agree(new, old):
            most_m = min(abs(by_range_m), abs(by_width_m))
    return most_m


def _agree(new: _Sample, old: _Sample) -> bool:
    by_range_m, by_width_m = new.range_m - old.range_m, new.width_m - old.width_m
    return abs(by_range_m - by_width_m) < _AGREEING_M + _AGREEING_SHARE * abs(by_width_m)
