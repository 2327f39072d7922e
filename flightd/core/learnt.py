"""What a flight has learnt of the drone's own sensors, for the next one to begin with."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass


class Learnt(enum.IntEnum):
    """What can be wrong with the sensors, beyond the configuration, in the order of the numbers.

    ROLL, PITCH: the told attitude is too small by this, rad; LEAK: rate at which it leaks, 1/s; MOUNT_ROLL,
    MOUNT_PITCH, MOUNT_YAW: the camera in the airframe, rad; DELAY: frames are exposed so much later than
    their stamps say, s; SCALE: share by which the camera's focal length is shorter, so that lengths on a
    floor that is looked down on are longer; HEIGHT_SCALE: share by which the told height is too small for
    good, so that all distances from the place straight below are longer."""

    ROLL = 0
    PITCH = 1
    LEAK = 2
    MOUNT_ROLL = 3
    MOUNT_PITCH = 4
    MOUNT_YAW = 5
    DELAY = 6
    SCALE = 7
    HEIGHT_SCALE = 8


@dataclass(frozen=True, slots=True)
class LearntSensors:
    """Means, and the covariance row by row, of all of `Learnt`."""

    means: tuple[float, ...]
    covariance: tuple[float, ...]

    def mean(self, what: Learnt) -> float:
        return self.means[what]

    def sigma(self, what: Learnt) -> float:
        """Standard deviation."""
        return math.sqrt(max(self.covariance[what * (len(Learnt) + 1)], 0.0))
