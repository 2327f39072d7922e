"""What the autopilot's own estimator may be told of the drone's motion."""

from __future__ import annotations

import math
from dataclasses import dataclass

from flightd.core.types import Attitude


@dataclass(frozen=True, slots=True)
class SharedPose:
    """Where the drone was, and how it moved, at the exposure of one frame, by what that frame showed.

    `attitude` is the one told for that moment, `yaw_rad` the heading on the map, position and velocity are in
    map axes.  The variances are of what the floor tells: NaN for the speed along an axis of which the
    frame tells nothing, since what is carried on by the told attitude is no evidence of that attitude.
    `corrections` counts how often the place on the map was found to be another one than was believed.
    """

    stamp_ns: int
    attitude: Attitude
    yaw_rad: float
    x_m: float
    y_m: float
    vx_mps: float
    vy_mps: float
    height_m: float
    position_variances: tuple[float, float]
    speed_variances: tuple[float, float]
    height_variance: float
    integrity: float
    corrections: int = 0

    @property
    def tells_both(self) -> bool:
        """Whether the frame tells the speed along both axes."""
        return not any(math.isnan(variance) for variance in self.speed_variances)
