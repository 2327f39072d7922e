"""What the floor's filter does not know at first, and how fast its sensors' errors drift.  Pure."""

from __future__ import annotations

import math

import numpy as np

from flightd.config.tracking import MotionNoise, SensorPriors
from flightd.core.geometry import Matrix
from flightd.tracking.motion_model import (
    DELAY,
    FIRST_LINE,
    HEIGHT,
    HEIGHT_SCALE,
    LEAK,
    MOUNT_PITCH,
    MOUNT_ROLL,
    MOUNT_YAW,
    PITCH,
    PSI,
    PSI_RATE,
    PUSH_X,
    PUSH_Y,
    ROLL,
    SCALE,
    VX,
    VY,
)

_YAW_SIGMA_RAD, _YAW_RATE_SIGMA_RADPS = math.radians(5.0), 0.005
"""Of the heading before it is told at all, and of its drift whenever it is."""
LEAST_HEIGHT_SHARE = 0.001


def first_sigmas(noise: MotionNoise, priors: SensorPriors) -> Matrix:
    """(FIRST_LINE,) standard deviations of the states before anything was seen."""
    sigmas = np.zeros(FIRST_LINE)
    sigmas[[PSI, PSI_RATE]] = _YAW_SIGMA_RAD, _YAW_RATE_SIGMA_RADPS
    sigmas[[VX, VY]] = noise.start_velocity_mps
    sigmas[[PUSH_X, PUSH_Y]] = noise.start_disturbance_mps2
    sigmas[HEIGHT] = LEAST_HEIGHT_SHARE
    sigmas[[ROLL, PITCH]] = priors.attitude_rad
    sigmas[LEAK] = priors.leak_per_s
    sigmas[[MOUNT_ROLL, MOUNT_PITCH]], sigmas[MOUNT_YAW] = priors.mount_rad, priors.mount_yaw_rad
    sigmas[DELAY], sigmas[SCALE] = priors.delay_s, priors.scale_share
    sigmas[HEIGHT_SCALE] = priors.height_share
    return sigmas


def drift_of(priors: SensorPriors) -> Matrix:
    """(FIRST_LINE,) densities (per square root of a second) by which the sensors' errors drift."""
    drift = np.zeros(FIRST_LINE)
    drift[[PSI, PSI_RATE]] = priors.heading_radps, 0.1 * priors.heading_radps
    drift[[ROLL, PITCH]] = priors.attitude_rad * math.sqrt(2.0 / priors.attitude_s)
    drift[LEAK] = priors.leak_per_s * 0.02
    drift[[MOUNT_ROLL, MOUNT_PITCH]] = priors.mount_rad * 0.002
    drift[MOUNT_YAW] = priors.mount_yaw_rad * 0.002
    drift[DELAY], drift[SCALE] = priors.delay_s * 0.01, priors.scale_share * 0.01
    drift[HEIGHT_SCALE] = priors.height_share * 0.005
    return drift
