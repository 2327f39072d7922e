"""Heights that leap: an echo that came by a longer way, or goods that the drone flies over."""

from __future__ import annotations

import math
from typing import NamedTuple

_LEAP_M, _LEAP_MPS, _TOLD_LEAP_MPS = 0.25, 3.0, 1.0
"""A height that is off the last one by more, and by more than a fast climb makes since then, has leapt; where
the climb is told, than that one and what it may err by, as in moved air."""
_SAME_M, _SAME_SHARE = 0.15, 0.1
"""Two readings that leapt agree when they differ by less than the greater of both."""
_REPEATED_NS = 100_000_000
"""ArduPilot tells a reading again until there is a new one, with the time of telling: one that is the very
same for so short a time tells nothing."""
_FORGOTTEN_NS = 500_000_000


class _Reading(NamedTuple):
    height_m: float
    distance_m: float
    stamp_ns: int

    def repeats(self, other: _Reading) -> bool:
        return self.distance_m == other.distance_m and self.stamp_ns - other.stamp_ns < _REPEATED_NS

    def agrees_with(self, other: _Reading) -> bool:
        same_m = max(_SAME_M, _SAME_SHARE * max(self.height_m, other.height_m))
        return abs(self.height_m - other.height_m) <= same_m

    def follows(self, last: _Reading, climb_mps: float) -> bool:
        """Whether it is no leap from the last one, or that is forgotten."""
        since_ns = self.stamp_ns - last.stamp_ns
        most_mps = _LEAP_MPS if math.isnan(climb_mps) else abs(climb_mps) + _TOLD_LEAP_MPS
        bound_m = _LEAP_M + most_mps * max(since_ns, 0) * 1e-9
        return since_ns > _FORGOTTEN_NS or abs(self.height_m - last.height_m) <= bound_m


class HeightLeapGate:
    """Call `accepts` with each height that a range finder tells.

    One that leaps is believed once a new reading agrees with it: a single echo by racks or goods, of more
    than the bound above, is nobody's height, and what climbs, lands or finds a hazard by it should not wait
    to see.  After half a second without any that is believed the next one is."""

    def __init__(self) -> None:
        self._accepted: _Reading | None = None
        self._leapt: _Reading | None = None

    def accepts(self, height_m: float, distance_m: float, stamp_ns: int, climb_mps: float = math.nan) -> bool:
        """Take the height that was measured then as that distance along the body; whether it is believed.
        `climb_mps` is the climb rate that is told, NaN where none is."""
        new, leapt = _Reading(height_m, distance_m, stamp_ns), self._leapt
        if self._accepted is not None and not new.follows(self._accepted, climb_mps):
            if leapt is not None and new.repeats(leapt):
                return False
            if leapt is None or not new.agrees_with(leapt):
                self._leapt = new
                return False
        self._accepted, self._leapt = new, None
        return True
