"""Height above the floor at any recent time, from range finder samples that come at their own rate.

Between samples the climb rate tells the height, so a range finder that is noisy is averaged over as many of
them as its own scatter asks for: a Kalman filter of the one state, whose noise follows its innovations.
Innovations that stay on one side are no scatter: there it is the climb rate that errs, and the samples count.
"""

from __future__ import annotations

import math
from collections import deque

_CLIMB_M, _UNTOLD_M = 0.03, 0.5
"""What a climb rate that is told, and none, misses of the height: densities, m per square root of a
second."""
_LEAST_M, _FIRST_M = 0.004, 0.01
"""Sigma of a sample: the least that is believed, and at first."""
_GAIN = 0.05
_ONE_SIDED = 0.2
"""How soon the mean of the innovations is believed."""
_LEAP_M, _LEAP_SIGMAS = 0.12, 4.0
"""A sample further off than both is that of another floor: it is taken as it is."""


class HeightHistory:
    """Samples of the last second; `at` interpolates and, past the newest, follows the last climb rate."""

    def __init__(self, keep_ns: int = 1_000_000_000) -> None:
        self._keep_ns = keep_ns
        self._samples: deque[tuple[int, float]] = deque()
        self._climb_mps = 0.0
        self._variance = 0.0
        self._scatter = _FIRST_M**2
        self._mean_off_m = 0.0

    @property
    def sigma_m(self) -> float:
        """Standard deviation of a single sample."""
        return math.sqrt(self._scatter)

    @property
    def error_m(self) -> float:
        """Standard deviation of the height that all samples tell."""
        return math.sqrt(self._variance)

    def add(self, stamp_ns: int, height_m: float, climb_mps: float) -> None:
        """Append a sample; NaN heights and samples that are not newer are ignored."""
        if math.isnan(height_m) or (self._samples and stamp_ns <= self._samples[-1][0]):
            return
        self._samples.append((stamp_ns, self._believed_m(stamp_ns, height_m, climb_mps)))
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

    def _believed_m(self, stamp_ns: int, height_m: float, climb_mps: float) -> float:
        """What the sample and those before it say of the height."""
        if not self._samples or stamp_ns - self._samples[-1][0] > self._keep_ns:
            self._variance, self._mean_off_m = self._scatter, 0.0
            return height_m
        last_ns, last_m = self._samples[-1]
        dt_s = (stamp_ns - last_ns) * 1e-9
        untold = math.isnan(climb_mps)
        expected_m = last_m + (0.0 if untold else 0.5 * (self._climb_mps + climb_mps) * dt_s)
        self._variance += (_UNTOLD_M if untold else _CLIMB_M) ** 2 * dt_s
        off_m = height_m - expected_m
        if abs(off_m) > max(_LEAP_M, _LEAP_SIGMAS * math.sqrt(self._variance + self._scatter)):
            self._variance, self._mean_off_m = self._scatter, 0.0
            return height_m
        self._mean_off_m += _ONE_SIDED * (off_m - self._mean_off_m)
        self._scatter += _GAIN * ((off_m - self._mean_off_m) ** 2 - self._variance - self._scatter)
        self._scatter = max(self._scatter, _LEAST_M**2)
        self._variance = max(self._variance, self._mean_off_m**2)
        gain = self._variance / (self._variance + self._scatter)
        self._variance *= 1.0 - gain
        return expected_m + gain * off_m
