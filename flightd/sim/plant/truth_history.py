"""The recent true motion, at any recent moment."""

from __future__ import annotations

from bisect import bisect_left
from collections import deque
from dataclasses import replace

from flightd.core.geometry import wrap_pi
from flightd.sim.plant.kinematics import Kinematics


class TruthHistory:
    """A bounded record of `Kinematics`, oldest first, read between its samples."""

    def __init__(self, samples: int) -> None:
        self._samples: deque[Kinematics] = deque(maxlen=samples)

    def add(self, truth: Kinematics) -> None:
        """Append the next sample; stamps must rise."""
        if self._samples and truth.stamp_ns <= self._samples[-1].stamp_ns:
            raise ValueError(f"truth at {truth.stamp_ns} is not after {self._samples[-1].stamp_ns}")
        self._samples.append(truth)

    def latest(self) -> Kinematics:
        """The newest sample; LookupError before the first."""
        if not self._samples:
            raise LookupError("no truth recorded yet")
        return self._samples[-1]

    def at(self, stamp_ns: int) -> Kinematics:
        """The motion at `stamp_ns`, linear between samples, and on beyond the newest for no longer than
        samples are apart; farther outside the record the nearest sample's, with the time asked for."""
        samples = self._samples
        newest = self.latest()
        if stamp_ns >= newest.stamp_ns:
            before = samples[-2] if len(samples) > 1 else newest
            apart_ns, ahead_ns = newest.stamp_ns - before.stamp_ns, stamp_ns - newest.stamp_ns
            if 0 < ahead_ns <= apart_ns:  # an exposure between two steps: held, it would be of the past
                return _between(before, newest, 1.0 + ahead_ns / apart_ns, stamp_ns)
            return replace(newest, stamp_ns=stamp_ns)
        after = bisect_left(samples, stamp_ns, key=_stamp)
        if after == 0:
            return replace(samples[0], stamp_ns=stamp_ns)
        a, b = samples[after - 1], samples[after]
        return _between(a, b, (stamp_ns - a.stamp_ns) / (b.stamp_ns - a.stamp_ns), stamp_ns)


def _stamp(truth: Kinematics) -> int:
    return truth.stamp_ns


def _between(a: Kinematics, b: Kinematics, part: float, stamp_ns: int) -> Kinematics:
    def mix(first: float, second: float) -> float:
        return first + (second - first) * part

    return Kinematics(
        stamp_ns,
        mix(a.x_m, b.x_m),
        mix(a.y_m, b.y_m),
        mix(a.height_m, b.height_m),
        mix(a.vx_mps, b.vx_mps),
        mix(a.vy_mps, b.vy_mps),
        mix(a.climb_mps, b.climb_mps),
        mix(a.roll_rad, b.roll_rad),
        mix(a.pitch_rad, b.pitch_rad),
        wrap_pi(a.yaw_rad + wrap_pi(b.yaw_rad - a.yaw_rad) * part),
        mix(a.roll_rate_radps, b.roll_rate_radps),
        mix(a.pitch_rate_radps, b.pitch_rate_radps),
        mix(a.yaw_rate_radps, b.yaw_rate_radps),
    )
