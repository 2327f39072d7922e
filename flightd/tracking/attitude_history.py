"""The attitude at any recent time, from telemetry that comes at its own rate."""

from __future__ import annotations

from bisect import bisect_right
from collections import deque
from collections.abc import Iterable

from flightd.core.geometry import wrap_pi
from flightd.core.types import Attitude
from flightd.tracking.line_sight import Rates

_RATE_NS = 20_000_000
"""Rates are taken over so long before and after."""
_HOLD_NS = 150_000_000


class AttitudeHistory:
    """Samples of the last seconds; `at` interpolates, and holds the newest for 0.15 s at most.

    What is only assumed stands behind the measured samples, and gives way to the next of them however late
    that comes.
    """

    def __init__(self, keep_ns: int = 3_000_000_000) -> None:
        self._keep_ns = keep_ns
        self._samples: deque[Attitude] = deque()
        self._stamps: deque[int] = deque()
        self._assumed = 0
        """So many of the last samples are assumed."""

    def add(self, sample: Attitude) -> None:
        """Append a measured sample; one that is not newer than the last is ignored (reordered datagrams)."""
        self._forget_assumed()
        self._append(sample)

    def assume(self, samples: Iterable[Attitude]) -> None:
        """What is assumed from the newest measured sample on, in the place of what was."""
        self._forget_assumed()
        for sample in samples:
            self._assumed += 1  # counted first: the newest measured one is never forgotten
            if not self._append(sample):
                self._assumed -= 1

    def is_assumed(self, stamp_ns: int) -> bool:
        """Whether the attitude at that time rests on what is only assumed."""
        measured = len(self._stamps) - self._assumed
        return self._assumed > 0 and (measured == 0 or stamp_ns > self._stamps[measured - 1])

    @property
    def measured_ns(self) -> int:
        """The time of the newest measured sample; 0 before the first."""
        measured = len(self._stamps) - self._assumed
        return self._stamps[measured - 1] if measured else 0

    def rates(self, stamp_ns: int) -> Rates:
        """How fast roll, pitch and yaw turn at that time; 0 where it is not told."""
        here = self.at(stamp_ns) or self.newest
        first, last = self.at(stamp_ns - _RATE_NS) or here, self.at(stamp_ns + _RATE_NS) or here
        if first is None or last is None or not (dt_s := (last.stamp_ns - first.stamp_ns) * 1e-9) > 0:
            return Rates(0.0, 0.0, 0.0)
        return Rates(
            (last.roll_rad - first.roll_rad) / dt_s,
            (last.pitch_rad - first.pitch_rad) / dt_s,
            wrap_pi(last.yaw_rad - first.yaw_rad) / dt_s,
        )

    def _forget_assumed(self) -> None:
        for _ in range(self._assumed):
            self._samples.pop()
            self._stamps.pop()
        self._assumed = 0

    def _append(self, sample: Attitude) -> bool:
        if self._stamps and sample.stamp_ns <= self._stamps[-1]:
            return False
        self._samples.append(sample)
        self._stamps.append(sample.stamp_ns)
        while self._stamps[0] < sample.stamp_ns - self._keep_ns and len(self._stamps) > self._assumed + 1:
            self._samples.popleft()
            self._stamps.popleft()
        return True

    @property
    def newest(self) -> Attitude | None:
        return self._samples[-1] if self._samples else None

    def at(self, stamp_ns: int) -> Attitude | None:
        """Attitude at `stamp_ns`, or None where no sample is near enough to tell."""
        samples, stamps = self._samples, self._stamps
        if not stamps or stamp_ns < stamps[0]:
            return None
        if stamp_ns >= (last_ns := stamps[-1]):
            return samples[-1] if stamp_ns - last_ns <= _HOLD_NS else None
        index = bisect_right(stamps, stamp_ns)
        a, b, a_ns = samples[index - 1], samples[index], stamps[index - 1]
        w = (stamp_ns - a_ns) / (stamps[index] - a_ns)
        return Attitude(
            stamp_ns,
            a.roll_rad + w * (b.roll_rad - a.roll_rad),
            a.pitch_rad + w * (b.pitch_rad - a.pitch_rad),
            wrap_pi(a.yaw_rad + w * wrap_pi(b.yaw_rad - a.yaw_rad)),
        )
