"""A position loop that swings by itself: found by its velocity, and slowed down.  Pure.

A loop whose gains are too high for the delay in it swings about its reference ever wider, or as wide as its
limits let it.  A gust pushes once; what swings to and fro, and no less each time, is the loop.  A loop that
swings leans as far as it may to either side and keeps its time: that tells it from gusts where it is slow.

The slower, the later it is found: one that is too late by 60 to 180 ms swings every 1.4 to 2.5 s and is found
within two seconds of its full swing, up to which it grows; one that has it at once only after 1.2 periods.
Slower than `_STEEP_MPS` nothing is told: gusts do as much.

Slower it is stable again: gains lowered with the damping kept ask for less phase at the crossover (K. J.
Astrom, R. M. Murray, Feedback Systems, 2008, ch. 9: delay margin).
"""

from __future__ import annotations

import math
from collections import deque
from itertools import pairwise

_LEAST_MPS = 0.4
"""Half swings that stay slower are none: gusts make as much."""
_SHORTEST_S, _LONGEST_S = 0.15, 2.5
"""Of a half swing: shorter is noise, slower is guidance."""
_HALF_SWINGS = 3
_DECAY = 0.8
"""A half swing of less than this share of the one before it dies away."""
_GROWN, _GROWN_MPS = 1.4, 0.5
"""One of more than this share of that before it, and so fast, grows: two of them tell it."""
_STEEP_MPS, _STEEP_MPS2 = 0.3, 1.5
"""Half swings that lean so far are told though they are no faster than this: by its limits of the lean a loop
that is 60 ms too late, and swings every 1.4 s, has 1.8 m/s^2."""
_STEADY, _EVEN = 0.85, 1.2
"""They are those of a loop where none has less than this share of the one before it, nor as much more, and
none lasts so much longer than another one."""
_EASED = 0.6
LEAST_EASE = 0.35
"""The slowest at which a drone is still held against the air."""
_WILD_MPS = 0.8
"""Swings as fast leave no time for small steps."""
_LEVEL_EASE = 0.12
"""Hardly more than level, for what swings on so wildly: the airframe itself rings, and every counter-lean
feeds it."""
_SETTLES_NS = 1_000_000_000
"""So long a loop that was slowed down has to come to rest before it is slowed down again."""
_RESTS_NS = 800_000_000
"""What was slower than a half swing for so long swings no more."""
_CALM_NS = 8_000_000_000
"""After so long without a swing the loop is tried faster again, once: what made it swing may have been
learnt meanwhile."""
_SMOOTH_S = 0.06
"""A leap of the estimate is over sooner, and no swing."""
_TURN_MPS = 0.1
"""A swing has turned when it is as fast as this the other way: noise about nought is no turn."""


class _Axis:
    """The half swings of one axis."""

    def __init__(self) -> None:
        self._since_ns: int | None = None
        self._last_ns = 0
        self._slow_mps = 0.0
        self._peak_mps = 0.0
        self._swings = 0
        self._before_mps = 0.0
        self._halves = deque[tuple[float, float]](maxlen=_HALF_SWINGS - 1)
        """The half swings before the one in hand: how fast, m/s, and for how long, s."""

    def step(self, now_ns: int, off_mps: float) -> bool:
        """Take the velocity against that of the reference; True once it swings on."""
        if self._since_ns is None:
            self._since_ns = self._last_ns = now_ns
        dt_s, self._last_ns = (now_ns - self._last_ns) * 1e-9, now_ns
        self._slow_mps += min(max(dt_s / _SMOOTH_S, 0.0), 1.0) * (off_mps - self._slow_mps)
        off_mps = self._slow_mps
        if off_mps * self._peak_mps < 0.0 and abs(off_mps) > _TURN_MPS:
            self._turn(now_ns, self._since_ns)
        if off_mps * self._peak_mps >= 0.0 and abs(off_mps) > abs(self._peak_mps):
            self._peak_mps = off_mps
        lasted_s = (now_ns - self._since_ns) * 1e-9
        if lasted_s > _LONGEST_S:
            self._swings = 0
            self._halves.clear()
        counts = self._counts() and lasted_s > _SHORTEST_S
        peak_mps = abs(self._peak_mps)
        grows = counts and self._swings > 0 and peak_mps > max(_GROWN * self._before_mps, _GROWN_MPS)
        keeps_time = lasted_s > _SHORTEST_S and self._keeps_time(peak_mps)
        return grows or keeps_time or self._swings + counts >= _HALF_SWINGS

    @property
    def peak_mps(self) -> float:
        """The fastest of the half swing in hand and the one before it."""
        return max(abs(self._peak_mps), self._before_mps)

    def _turn(self, now_ns: int, since_ns: int) -> None:
        if (now_ns - since_ns) * 1e-9 >= _SHORTEST_S:
            self._swings = self._swings + 1 if self._counts() else 0
            self._halves.append((abs(self._peak_mps), (now_ns - since_ns) * 1e-9))
            self._before_mps = abs(self._peak_mps)
            self._since_ns = now_ns
        self._peak_mps = 0.0

    def _keeps_time(self, peak_mps: float) -> bool:
        """The half swing in hand, as far as it has come, and those before it are steep and all alike."""
        if len(self._halves) < _HALF_SWINGS - 1 or peak_mps <= _STEEP_MPS:
            return False
        lasted_s = [one_s for _, one_s in self._halves]
        steep = all(mps > _STEEP_MPS and math.pi * mps > _STEEP_MPS2 * one_s for mps, one_s in self._halves)
        speeds = [*(mps for mps, _ in self._halves), peak_mps]
        steady = all(_STEADY < later / mps < 1.0 / _STEADY for mps, later in pairwise(speeds))
        return steep and steady and max(lasted_s) < _EVEN * min(lasted_s)

    def _counts(self) -> bool:
        """The half swing in hand is one, by what it has come to so far."""
        peak_mps = abs(self._peak_mps)
        return peak_mps > _LEAST_MPS and (not self._swings or peak_mps > _DECAY * self._before_mps)


class OscillationMonitor:
    """Call `step` at each tick that is steered, `rest` at any other."""

    def __init__(self) -> None:
        self._axes = _Axis(), _Axis()
        self._found_ns: int | None = None
        self._fast_ns = 0
        self._calm_since_ns: int | None = None
        self._most = 1.0
        self._tried = False
        self.ease = 1.0
        """How fast the loop may answer, as a share of what is configured."""
        self.swings = False
        """It swings, or has hardly come to rest."""

    def rest(self) -> None:
        """Nothing is steered: what moves now is no loop's doing."""
        self._axes = _Axis(), _Axis()
        self._calm_since_ns = None
        self.swings = False

    def step(self, now_ns: int, off_x_mps: float, off_y_mps: float) -> None:
        """Take the velocity against that of the reference, m/s, grid axes."""
        if not math.isfinite(off_x_mps + off_y_mps):
            return
        along_x, along_y = self._axes
        swings_x, swings_y = along_x.step(now_ns, off_x_mps), along_y.step(now_ns, off_y_mps)
        if max(abs(off_x_mps), abs(off_y_mps)) > _LEAST_MPS:
            self._fast_ns = now_ns
        settles = self._found_ns is not None and now_ns - self._found_ns < _SETTLES_NS
        self.swings = settles or (self.swings and now_ns - self._fast_ns < _RESTS_NS)
        if (swings_x or swings_y) and not settles:
            peaks_mps = along_x.peak_mps * swings_x, along_y.peak_mps * swings_y
            self._slow_down(now_ns, max(peaks_mps))
        if self.swings or self._calm_since_ns is None:
            self._calm_since_ns = now_ns
        elif self.ease < self._most and now_ns - self._calm_since_ns > _CALM_NS:
            self.ease, self._calm_since_ns, self._tried = min(self.ease / _EASED, self._most), now_ns, True

    def _slow_down(self, now_ns: int, peak_mps: float) -> None:
        if peak_mps > _WILD_MPS:
            self.ease = _LEVEL_EASE if self.ease <= LEAST_EASE else LEAST_EASE
        else:
            self.ease = min(max(self.ease * _EASED, LEAST_EASE), self.ease)
        if self._tried:  # it was not the first seconds of a flight that knew little
            self._most = max(self.ease, LEAST_EASE)
        self._axes = _Axis(), _Axis()
        self._found_ns = now_ns
        self.swings = True
