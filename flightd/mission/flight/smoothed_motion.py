"""Whether the drone has come to rest where it should: by its motion averaged over a moment.  Pure."""

from __future__ import annotations

import math

from flightd.core.types import GridPose

_OVER_S = 0.5
"""A speed that swings about nothing within this is none: it is what the estimate is uncertain by."""


class SmoothedMotion:
    """Call `step` at each tick; the averages begin with the first pose after one without."""

    def __init__(self) -> None:
        self._motion: tuple[float, float, float, float] | None = None

    def step(self, pose: GridPose | None, dt_s: float) -> None:
        """Take one tick's pose; None: there is none."""
        if pose is None:
            self._motion = None
            return
        now = pose.x_m, pose.y_m, pose.vx_mps, pose.vy_mps
        if self._motion is None:
            self._motion = now
            return
        x, y, vx, vy = self._motion
        # carried on by its own speed, so that what moves evenly is followed without a lag
        so_far = x + vx * dt_s, y + vy * dt_s, vx, vy
        part = min(dt_s / _OVER_S, 1.0)
        x, y, vx, vy = (old + part * (new - old) for old, new in zip(so_far, now, strict=True))
        self._motion = x, y, vx, vy

    @property
    def speed_mps(self) -> float:
        """Infinite where there is no pose."""
        return math.inf if self._motion is None else math.hypot(*self._motion[2:])

    def distance_m(self, to: tuple[float, float]) -> float:
        """How far away a place on the map is; infinite where there is no pose."""
        return math.inf if self._motion is None else math.dist(self._motion[:2], to)
