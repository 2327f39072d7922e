"""Where the drone was at any moment of the last seconds: a picture belongs to the pose of its exposure."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections import deque

from flightd.core.geometry import wrap_pi
from flightd.core.scanning import BodyPose
from flightd.core.types import Attitude, GridPose
from flightd.tracking.attitude_history import AttitudeHistory


class PoseHistory:
    """Poses on the grid and attitudes, each at its own times; `at` interpolates both.

    Poses of less than `least_integrity` are not `certain`."""

    def __init__(self, least_integrity: float, keep_ns: int = 3_000_000_000) -> None:
        self._least = least_integrity
        self._keep_ns = keep_ns
        self._attitudes = AttitudeHistory(keep_ns)
        self._poses: deque[GridPose] = deque()
        self._stamps: deque[int] = deque()

    def add_attitude(self, sample: Attitude) -> None:
        self._attitudes.add(sample)

    def add(self, pose: GridPose) -> None:
        """Append a pose; one that is not newer than the last is ignored."""
        if self._stamps and pose.stamp_ns <= self._stamps[-1]:
            return
        self._poses.append(pose)
        self._stamps.append(pose.stamp_ns)
        while self._stamps[0] < pose.stamp_ns - self._keep_ns:
            self._poses.popleft()
            self._stamps.popleft()

    def at(self, stamp_ns: int) -> BodyPose | None:
        """The pose at `stamp_ns`, None outside what is remembered and where height or attitude are
        not known."""
        attitude = self._attitudes.at(stamp_ns)
        index = bisect_right(self._stamps, stamp_ns)
        if attitude is None or index == 0:
            return None
        a = self._poses[index - 1]
        b = self._poses[min(index, len(self._poses) - 1)]
        gap_ns = b.stamp_ns - a.stamp_ns
        w = (stamp_ns - a.stamp_ns) / gap_ns if gap_ns else 0.0
        height_m = a.height_m + w * (b.height_m - a.height_m)
        if math.isnan(height_m):
            return None
        worse = max(a, b, key=lambda pose: max(pose.covariance[0], pose.covariance[4]))
        variance = worse.covariance
        return BodyPose(
            stamp_ns,
            a.x_m + w * (b.x_m - a.x_m),
            a.y_m + w * (b.y_m - a.y_m),
            height_m,
            attitude.roll_rad,
            attitude.pitch_rad,
            wrap_pi(a.yaw_rad + w * wrap_pi(b.yaw_rad - a.yaw_rad)),
            math.sqrt(variance[0]),
            math.sqrt(variance[4]),
            math.sqrt(variance[8]),
            min(a.integrity, b.integrity) >= self._least,
        )
