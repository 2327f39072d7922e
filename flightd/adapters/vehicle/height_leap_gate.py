"""Heights that leap: an echo that came by a longer way, or goods that the drone flies over."""

from __future__ import annotations

from typing import NamedTuple

_LEAP_M, _LEAP_MPS = 0.25, 3.0
"""A height that is off the last one by more, and by more than a fast climb makes, has leapt."""
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


class HeightLeapGate:
    """Call `accepts` with each height that a range finder tells.

    One that leaps is believed once a new reading agrees with it: a single echo by racks or goods, of more
    than the bound above, is nobody's height, and what climbs, lands or finds a hazard by it should not wait
    to see.  After half a second without any that is believed the next one is."""

    def __init__(self) -> None:
        self._accepted: _Reading | None = None
        self._leapt: _Reading | None = None

    def accepts(self, height_m: float, distance_m: float, stamp_ns: int) -> bool:
        """Take the height that was measured then as that distance along the body; whether it is believed."""
        new, last, leapt = _Reading(height_m, distance_m, stamp_ns), self._accepted, self._leapt
        since_ns = stamp_ns - last.stamp_ns if last is not None else _FORGOTTEN_NS + 1
        if last is None or since_ns > _FORGOTTEN_NS:
            accepted = True
        else:
            accepted = abs(height_m - last.height_m) <= _LEAP_M + _LEAP_MPS * max(since_ns, 0) * 1e-9
        if not accepted and leapt is not None:
            repeated = distance_m == leapt.distance_m and stamp_ns - leapt.stamp_ns < _REPEATED_NS
            if repeated:
                return False
            same_m = max(_SAME_M, _SAME_SHARE * max(height_m, leapt.height_m))
            accepted = abs(height_m - leapt.height_m) <= same_m
        if accepted:
            self._accepted, self._leapt = new, None
        else:
            self._leapt = new
        return accepted
