"""The true motion of the simulated airframe, which only the simulator and its score may see."""

from __future__ import annotations

from dataclasses import dataclass

OFF_FLOOR_M = 0.3
"""A body origin higher than this flies; standing it is 0.1 m above the floor."""
ON_FLOOR_M = 0.2
"""One that is no higher at the end of a flight has come down."""


@dataclass(frozen=True, slots=True)
class Kinematics:
    """Pose and motion at one instant, in the warehouse map frame (x along the aisles, y right of x seen
    from above, yaw clockwise from x); `height_m` of the body origin above the floor; velocities of the
    map frame (`climb_mps` + up); attitude and body rates as in `core.types.Attitude`."""

    stamp_ns: int
    x_m: float
    y_m: float
    height_m: float
    vx_mps: float
    vy_mps: float
    climb_mps: float
    roll_rad: float
    pitch_rad: float
    yaw_rad: float
    roll_rate_radps: float
    pitch_rate_radps: float
    yaw_rate_radps: float


@dataclass(frozen=True, slots=True)
class ArmedChange:
    """The vehicle was armed or disarmed at `stamp_ns`."""

    stamp_ns: int
    armed: bool
