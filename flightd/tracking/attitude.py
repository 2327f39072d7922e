"""The attitude at any recent time, from telemetry that comes at its own rate."""

from __future__ import annotations

from bisect import bisect_right
from collections import deque

from flightd.core.geometry import wrap_pi
from flightd.core.types import Attitude


class AttitudeHistory:
    """Samples of the last seconds; `at` interpolates, and holds the newest for at most `hold_ns`."""

    def __init__(self, keep_ns: int = 3_000_000_000, hold_ns: int = 150_000_000) -> None:
        self._keep_ns = keep_ns
        self._hold_ns = hold_ns
        self._samples: deque[Attitude] = deque()
        self._stamps: deque[int] = deque()

    def add(self, sample: Attitude) -> None:
        """Append a sample; one that is not newer than the last is ignored (reordered datagrams)."""
        if self._stamps and sample.stamp_ns <= self._stamps[-1]:
            return
        self._samples.append(sample)
        self._stamps.append(sample.stamp_ns)
        while self._stamps[0] < sample.stamp_ns - self._keep_ns:
            self._samples.popleft()
            self._stamps.popleft()

    @property
    def newest(self) -> Attitude | None:
        return self._samples[-1] if self._samples else None

    def at(self, stamp_ns: int) -> Attitude | None:
        """Attitude at `stamp_ns`, or None where no sample is near enough to tell."""
        if not self._samples or stamp_ns < self._stamps[0]:
            return None
        last = self._samples[-1]
        if stamp_ns >= last.stamp_ns:
            return last if stamp_ns - last.stamp_ns <= self._hold_ns else None
        index = bisect_right(self._stamps, stamp_ns)
        a, b = self._samples[index - 1], self._samples[index]
        w = (stamp_ns - a.stamp_ns) / (b.stamp_ns - a.stamp_ns)
        return Attitude(
            stamp_ns,
            a.roll_rad + w * (b.roll_rad - a.roll_rad),
            a.pitch_rad + w * (b.pitch_rad - a.pitch_rad),
            wrap_pi(a.yaw_rad + w * wrap_pi(b.yaw_rad - a.yaw_rad)),
        )
