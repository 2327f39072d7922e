"""Whether the height that is told follows the climb of the vehicle.

A range finder with a leg, a cable or a label in its beam goes on telling one height, or swings between a few,
or follows the climb by a part of it only; and a climb that waits for a greater one never ends.
"""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

_MOVED_M, _WINDOW_NS = 0.4, 1_500_000_000
"""What the autopilot says to have climbed within so long, without a change of the height, is too much: a
climb of 0.6 m/s is found after 0.7 s.  Barometers err by less within that time."""
_AHEAD_M, _AHEAD_NS = 0.5, 3_000_000_000
"""So much more climbed than the height followed, within so long, is too much, however the height moves."""
_WANTED_M, _WANTED_NS = 3.0, 8_000_000_000
"""The same of what was commanded, for an autopilot that tells no climb: thrust is raised for up to 2 s
before a vehicle leaves the floor."""
_SHARE = 0.25
"""A height that changes by less than this share of the way stands still."""
_UNMEASURED_M, _STANDING_M = (0.12, 0.3), 0.02
"""A range finder that tells more than the first of these of a drone that stands may tell its own minimum: up
to that height, or the second of these, it climbs unseen while the reading stays within the last of these."""
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
        self._least_climbed_m = self._most_climbed_m = self._least_wanted_m = 0.0
        self._first_m: float | None = None
        self._last_ns: int | None = None
        self._climbed_m = 0.0
        self._wanted_m = 0.0

    def step(self, now_ns: int, height_m: float, climb_mps: float, wanted_mps: float) -> bool:
        """Take a height (m; NaN: none since the last call), climb rate and commanded climb rate (m/s, + up;
        NaN: not known)."""
        dt_s = 0.0 if self._last_ns is None else (now_ns - self._last_ns) * 1e-9
        self._last_ns = now_ns
        self._climbed_m += 0.0 if math.isnan(climb_mps) else climb_mps * dt_s
        self._wanted_m += wanted_mps * dt_s
        if math.isnan(height_m):
            return self.found
        if self._first_m is None:
            self._first_m = height_m
        new = _Sample(now_ns, height_m, self._climbed_m, self._wanted_m)
        if not self._samples or now_ns - self._samples[-1].stamp_ns >= _KEPT_EVERY_NS:
            self._keep(new)
        self.found = self.found or self._contradicts(new)
        return self.found

    def _keep(self, new: _Sample) -> None:
        samples = self._samples
        samples.append(new)
        while new.stamp_ns - samples[0].stamp_ns > _WANTED_NS:
            samples.popleft()
        climbed_m = [old.climbed_m for old in samples]
        self._least_climbed_m, self._most_climbed_m = min(climbed_m), max(climbed_m)
        self._least_wanted_m = min([old.wanted_m for old in samples])

    def _rose(self, new: _Sample) -> bool:
        """Whether there is anything that a height could contradict: cheap, and nearly always not."""
        moved_m = max(new.climbed_m - self._least_climbed_m, self._most_climbed_m - new.climbed_m)
        return moved_m > _MOVED_M or new.wanted_m - self._least_wanted_m > _WANTED_M

    def _unseen_m(self) -> float:
        """What may have been climbed from where it stood before the range finder measured anything."""
        first_m, (least_m, most_m) = self._first_m, _UNMEASURED_M
        return min(first_m, most_m) if first_m is not None and first_m > least_m else 0.0

    def _contradicts(self, new: _Sample) -> bool:
        if not self._rose(new):
            return False
        unseen_m, first_m = self._unseen_m(), self._first_m
        new_ns, new_m, new_climbed_m, new_wanted_m = new
        stands_still, drop_m, later_m = True, 0.0, new_m
        wanted = new_wanted_m - self._least_wanted_m > _WANTED_M
        for old_ns, old_m, old_climbed_m, old_wanted_m in reversed(self._samples):
            age_ns = new_ns - old_ns
            if age_ns > _AHEAD_NS and not wanted:  # older ones could only tell that
                return False
            rose_m = new_m - old_m
            climbed_m = new_climbed_m - old_climbed_m
            if unseen_m and first_m is not None and abs(old_m - first_m) < _STANDING_M:
                climbed_m -= unseen_m
            drop_m, later_m = min(drop_m, later_m - old_m), old_m
            followed_m = rose_m - drop_m if rose_m > drop_m else 0.0  # one drop may be goods that came below
            if stands_still:
                stands_still = abs(rose_m) < _SHARE * _MOVED_M
                if stands_still and age_ns <= _WINDOW_NS and abs(climbed_m) > _MOVED_M:
                    return True
            if age_ns <= _AHEAD_NS and climbed_m - followed_m > _AHEAD_M:
                return True
            if new_wanted_m - old_wanted_m - followed_m > _WANTED_M:
                return True
        return False
