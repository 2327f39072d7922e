"""What the line tracker tells of the motion beside its tracks: at a frame's exposure, and to come."""

from __future__ import annotations

from typing import NamedTuple

from flightd.core.types import Attitude


class Lead(NamedTuple):
    """What the motion changes by until a setpoint that goes out now has most of its effect: way and speed
    along the grid axes, and the heading; that is `after_s` from now."""

    x_m: float
    y_m: float
    vx_mps: float
    vy_mps: float
    yaw_rad: float
    after_s: float


NO_LEAD = Lead(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


class ExposureMotion(NamedTuple):
    """The motion at the exposure of the newest frame: the attitude told for then, heading, speed along the
    grid axes with its variances (NaN along an axis of which that frame tells nothing), and the way since."""

    attitude: Attitude
    yaw_rad: float
    speed_mps: tuple[float, float]
    variances: tuple[float, float]
    since_m: tuple[float, float]


class Carried(NamedTuple):
    """The motion after a while that was dead-reckoned: along both grid axes each, `way_m` what was flown."""

    velocity_mps: tuple[float, float]
    way_m: tuple[float, float]
    accel_mps2: tuple[float, float]


AT_REST = Carried((0.0, 0.0), (0.0, 0.0), (0.0, 0.0))
