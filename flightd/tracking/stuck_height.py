"""Whether the height that is told stands still while the vehicle climbs or sinks.

A range finder with a leg, a cable or a label in its beam goes on telling one height, and a climb that waits
for a greater one never ends.
"""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

_MOVED_M, _WINDOW_NS = 0.4, 1_500_000_000
"""What the autopilot says to have climbed within so long, without a change of the height, is too much: a
climb of 0.6 m/s is found after 0.7 s.  Barometers err by less within that time."""
_WANTED_M, _WANTED_NS = 3.0, 8_000_000_000
"""The same of what was commanded, for an autopilot that tells no climb: thrust is raised for up to 2 s
before a vehicle leaves the floor."""
_SHARE = 0.25
"""A height that changes by less than this share of the way stands still."""
_KEPT_EVERY_NS = 100_000_000
"""The past is looked through at each tick: a sample in so long is enough of it."""


class _Sample(NamedTuple):
    stamp_ns: int
    height_m: float
    climbed_m: float
    wanted_m: float


class StuckHeight:
    """Call `step` at each tick of a flight; a new flight begins with a new one."""

    def __init__(self) -> None:
        self.found = False
        """Stays so until the end of the flight: what stuck once is not believed again."""
        self._samples: deque[_Sample] = deque()
        self._last = _Sample(0, math.nan, 0.0, 0.0)

    def step(self, now_ns: int, height_m: float, climb_mps: float, wanted_mps: float) -> bool:
        """Take the newest height (m), climb rate and commanded climb rate (m/s, + up; NaN: not known)."""
        if math.isnan(height_m):
            self._samples.clear()
            return self.found
        last = self._last if self._samples else _Sample(now_ns, height_m, 0.0, 0.0)
        dt_s = (now_ns - last.stamp_ns) * 1e-9
        climbed_m = last.climbed_m + (0.0 if math.isnan(climb_mps) else climb_mps * dt_s)
        new = _Sample(now_ns, height_m, climbed_m, last.wanted_m + wanted_mps * dt_s)
        self._last = new
        if not self._samples or now_ns - self._samples[-1].stamp_ns >= _KEPT_EVERY_NS:
            self._samples.append(new)
        while now_ns - self._samples[0].stamp_ns > _WANTED_NS:
            self._samples.popleft()
        self.found = self.found or self._stands_still(new)
        return self.found

    def _stands_still(self, new: _Sample) -> bool:
        for old in reversed(self._samples):
            moved_m, wanted_m = new.climbed_m - old.climbed_m, new.wanted_m - old.wanted_m
            if abs(new.height_m - old.height_m) >= _SHARE * _MOVED_M:
                return False
            recent = new.stamp_ns - old.stamp_ns <= _WINDOW_NS
            if (recent and abs(moved_m) > _MOVED_M) or wanted_m > _WANTED_M:
                return True
        return False
