"""By how much a compass is wrong, place by place: steel in racks and floor bends the field of the earth."""

from __future__ import annotations

import math
import random

_WAVES = 3
_LENGTHS_M = (4.0, 12.0)
"""From one rack's upright to the other side of an aisle, and across a bay of steel in the floor."""


class SteelField:
    """A smooth field of heading errors over the map, nowhere more than `most_rad`."""

    def __init__(self, most_rad: float, seed: int) -> None:
        rng = random.Random(f"steel {seed}")
        self._waves = []
        for _ in range(_WAVES):
            number, course = math.tau / rng.uniform(*_LENGTHS_M), rng.uniform(0.0, math.tau)
            wave = (number * math.cos(course), number * math.sin(course), rng.uniform(0.0, math.tau))
            self._waves.append(wave)
        self._each_rad = most_rad / _WAVES

    def error_rad(self, x_m: float, y_m: float) -> float:
        """Compass minus truth at a place of the map."""
        return self._each_rad * sum(math.sin(kx * x_m + ky * y_m + phase) for kx, ky, phase in self._waves)
