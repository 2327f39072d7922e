"""Lines against the vehicle's own heading: who is right when they contradict each other."""

from __future__ import annotations

import math
from statistics import median

_SAME_RAD = math.radians(3.0)
_DISPUTE_NS, _SHOWN_NS = 600_000_000, 1_500_000_000


class HeadingDispute:
    """Lines that all contradict the vehicle's heading, and by the same angle, frame after frame."""

    def __init__(self) -> None:
        self.error_rad = 0.0
        self._since_ns = 0
        self._settled_ns: int | None = None

    def step(self, told: list[float], agreed: bool, stamp_ns: int) -> bool:
        """Take what one frame's lines say; True when the lines have it.  The error is then shown for a
        while longer, so that nobody overlooks it."""
        if self._settled_ns is not None:
            if stamp_ns - self._settled_ns > _SHOWN_NS:
                self._settled_ns, self.error_rad = None, 0.0
            return False
        if agreed or not told:
            self.error_rad = 0.0
            return False
        error = median(told)
        if not self.error_rad or abs(error - self.error_rad) > _SAME_RAD:
            self._since_ns = stamp_ns
        self.error_rad = error
        if stamp_ns - self._since_ns < _DISPUTE_NS:
            return False
        self._settled_ns = stamp_ns
        return True
