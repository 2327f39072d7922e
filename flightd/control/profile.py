"""A reference that moves to a target with bounded speed and acceleration, along one axis."""

from __future__ import annotations

import math


class Profile:
    """Trapezoidal velocity profile made on the fly: position, velocity and acceleration of a point that
    goes to `target` and stops there without overshoot.  Units are the caller's (metres or radians)."""

    def __init__(self, position: float, max_speed: float, max_accel: float) -> None:
        if not (max_speed > 0 and max_accel > 0):
            raise ValueError(f"speed {max_speed} and acceleration {max_accel} must be positive")
        self.position = position
        self.velocity = 0.0
        self.acceleration = 0.0
        self._max_speed = max_speed
        self._max_accel = max_accel

    def reset(self, position: float, velocity: float = 0.0) -> None:
        self.position, self.velocity, self.acceleration = position, velocity, 0.0

    def step(self, target: float, dt_s: float) -> None:
        """Advance by `dt_s` towards `target`."""
        distance = target - self.position
        # half of a step ahead, so that the stop in discrete time does not overshoot
        reach = max(abs(distance) - 0.5 * abs(self.velocity) * dt_s, 0.0)
        wanted = math.copysign(min(self._max_speed, math.sqrt(2.0 * self._max_accel * reach)), distance)
        change = min(max(wanted - self.velocity, -self._max_accel * dt_s), self._max_accel * dt_s)
        velocity = self.velocity + change
        if abs(distance) <= abs(velocity) * dt_s and abs(velocity) <= 2.0 * self._max_accel * dt_s:
            self.position, velocity = target, 0.0
        else:
            self.position += 0.5 * (self.velocity + velocity) * dt_s
        self.acceleration = (velocity - self.velocity) / dt_s
        self.velocity = velocity
