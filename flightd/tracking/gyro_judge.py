"""Lines decide who is wrong where gyros and told heading part: found by what both were before.  Pure."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from statistics import median

from flightd.core.geometry import wrap_pi

_BEFORE_NS, _KEPT_NS = 700_000_000, 1_500_000_000
"""So long before they were seen to part they agreed; so much is remembered."""
_AGREES_RAD, _APART_RAD = math.radians(4.0), math.radians(6.0)
_FOUND_NS = 150_000_000
"""Lines that agree with the told heading for so long have found the gyros out."""


class GyroJudge:
    """Call `step` with each frame.  While gyros and told heading do as they should, the grid's heading less
    the told one hardly changes; once they part, the one of before shows whether lines still agree with it."""

    def __init__(self) -> None:
        self._offsets: deque[tuple[int, float]] = deque()
        self._before_rad: float | None = None
        self._agrees_ns: int | None = None

    def step(self, stamp_ns: int, offset_rad: float, turns: Sequence[float], *, parted: bool) -> float | None:
        """Take the heading on the grid less the told one, by how much each line says that heading to be too
        large (modulo a right angle), and whether gyros and told heading have parted lately.  The offset that
        is right for the told heading, once the gyros are found to be wrong."""
        if not parted:
            self._before_rad = self._agrees_ns = None
            self._offsets.append((stamp_ns, offset_rad))
            while self._offsets[0][0] < stamp_ns - _KEPT_NS:
                self._offsets.popleft()
            return None
        if self._before_rad is None:
            if not self._offsets:
                return None
            early = [offset for at_ns, offset in self._offsets if at_ns <= stamp_ns - _BEFORE_NS]
            self._before_rad = early[-1] if early else self._offsets[0][1]
        strayed_rad = wrap_pi(offset_rad - self._before_rad)
        off_rad = [math.remainder(turn - strayed_rad, math.pi / 2) for turn in turns]
        if not off_rad or abs(median(off_rad)) > _AGREES_RAD or abs(strayed_rad) < _APART_RAD:
            self._agrees_ns = None
            return None
        if self._agrees_ns is None:
            self._agrees_ns = stamp_ns
        return self._before_rad if stamp_ns - self._agrees_ns >= _FOUND_NS else None
