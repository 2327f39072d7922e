"""Height above the floor at any recent time, from range finder samples that come at their own rate."""

from __future__ import annotations

import math
from collections import deque


class HeightHistory:
    """Samples of the last second; `at` interpolates and, past the newest, follows the last climb rate."""

    def __init__(self, keep_ns: int = 1_000_000_000) -> None:
        self._keep_ns = keep_ns
        self._samples: deque[tuple[int, float]] = deque()
        self._climb_mps = 0.0

    def add(self, stamp_ns: int, height_m: float, climb_mps: float) -> None:
        """Append a sample; NaN heights and samples that are not newer are ignored."""
        if math.isnan(height_m) or (self._samples and stamp_ns <= self._samples[-1][0]):
            return
        self._samples.append((stamp_ns, height_m))
        self._climb_mps = 0.0 if math.isnan(climb_mps) else climb_mps
        while self._samples[0][0] < stamp_ns - self._keep_ns:
            self._samples.popleft()

    def at(self, stamp_ns: int) -> float:
        """Height in metres, NaN when the newest sample is older than a second."""
        if not self._samples or stamp_ns - self._samples[-1][0] > self._keep_ns:
            return math.nan
        newest_ns, newest_m = self._samples[-1]
        if stamp_ns >= newest_ns:
            ahead_s = min((stamp_ns - newest_ns) * 1e-9, 0.2)
            return newest_m + self._climb_mps * ahead_s
        after = self._samples[-1]
        for before in reversed(self._samples):
            if before[0] <= stamp_ns:
                share = (stamp_ns - before[0]) / (after[0] - before[0]) if after[0] > before[0] else 0.0
                return before[1] + share * (after[1] - before[1])
            after = before
        return self._samples[0][1]
