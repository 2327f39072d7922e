"""What a flight has learnt of the drone's own sensors, for the next one to begin with."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass

from flightd.core.tracks import SensorEstimate

_DELAY_UNSEEN_S = 0.002
"""What the shake of frames makes of their delay, and no row tells: usual flights err to one side by it."""


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


def whole_delay_sigma_s(sigma_s: float) -> float:
    """How well the delay of the frames is known: by the filter's own doubt and by what it cannot see."""
    return math.hypot(sigma_s, _DELAY_UNSEEN_S)


def estimate_of(learnt: LearntSensors, shake_rad: float = math.nan) -> SensorEstimate:
    """The same for people."""
    mean, sigma = learnt.mean, learnt.sigma
    return SensorEstimate(
        delay_s=mean(Learnt.DELAY),
        delay_sigma_s=whole_delay_sigma_s(sigma(Learnt.DELAY)),
        mount_roll_rad=mean(Learnt.MOUNT_ROLL),
        mount_pitch_rad=mean(Learnt.MOUNT_PITCH),
        mount_sigma_rad=max(sigma(Learnt.MOUNT_ROLL), sigma(Learnt.MOUNT_PITCH)),
        mount_yaw_rad=mean(Learnt.MOUNT_YAW),
        mount_yaw_sigma_rad=sigma(Learnt.MOUNT_YAW),
        tilt_roll_rad=mean(Learnt.ROLL),
        tilt_pitch_rad=mean(Learnt.PITCH),
        tilt_sigma_rad=max(sigma(Learnt.ROLL), sigma(Learnt.PITCH)),
        scale_share=mean(Learnt.SCALE),
        scale_sigma=sigma(Learnt.SCALE),
        height_share=mean(Learnt.HEIGHT_SCALE),
        height_sigma=sigma(Learnt.HEIGHT_SCALE),
        shake_rad=shake_rad,
    )
