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

    def step(self, target: float, dt_s: float, speed: float = math.inf) -> None:
        """Advance by `dt_s` towards `target`, no faster than `speed`."""
        a, distance = self._max_accel, target - self.position
        if abs(distance) <= 0.5 * a * dt_s * dt_s and abs(self.velocity) <= a * dt_s:
            self.position, velocity = target, 0.0
        else:
            # the speed from which, after this step, the stop at `a` just ends at the target
            towards = math.copysign(1.0, distance)
            left = max(abs(distance) - 0.5 * towards * self.velocity * dt_s, 0.0)
            stop = a * (math.sqrt(0.25 * dt_s * dt_s + 2.0 * left / a) - 0.5 * dt_s)
            wanted = towards * min(self._max_speed, speed, stop)
            velocity = self.velocity + min(max(wanted - self.velocity, -a * dt_s), a * dt_s)
            self.position += 0.5 * (self.velocity + velocity) * dt_s
        self.acceleration = (velocity - self.velocity) / dt_s
        self.velocity = velocity

    def brake(self, dt_s: float) -> None:
        """Advance by `dt_s`, coming to rest as soon as the acceleration allows."""
        change = self._max_accel * dt_s
        velocity = self.velocity - min(max(self.velocity, -change), change)
        self.position += 0.5 * (self.velocity + velocity) * dt_s
        self.acceleration = (velocity - self.velocity) / dt_s
        self.velocity = velocity
