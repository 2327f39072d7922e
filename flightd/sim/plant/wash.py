"""What the rotors blow, thrown back by floor and racks: an airframe close to them flies in its own wake."""

from __future__ import annotations

import math
import random
from collections.abc import Sequence

from flightd.site.site import Shelf

_FADES_M = 0.5
"""A drone's span: so far from a surface the wake that comes back is a third of what it is right beside it."""
_LASTS_S = 0.4
"""Correlation time of eddies as large as that."""


class Wash:
    """Air velocity that comes back, to be added to the wind's: `x_mps`, `y_mps` in the map frame, `up_mps`.

    Three first-order Gauss-Markov processes of `rms_mps` right beside a surface, fading with the distance
    from floor and rack fronts; in a corner both add up.  Its shape is assumed, not measured.  Same seed, same
    air."""

    def __init__(self, rms_mps: float, shelves: Sequence[Shelf], seed: int) -> None:
        self._rms_mps, self._shelves = rms_mps, tuple(shelves)
        self._rng = random.Random(f"wash {seed}")
        self._eddies = [0.0, 0.0, 0.0]
        self.x_mps = self.y_mps = self.up_mps = 0.0

    def step(self, dt_s: float, x_m: float, y_m: float, height_m: float) -> None:
        """Let `dt_s` pass for an airframe that flies there."""
        keep = math.exp(-dt_s / _LASTS_S)
        kick, gauss = math.sqrt(1.0 - keep * keep), self._rng.gauss
        self._eddies = [keep * eddy + gauss(0.0, kick) for eddy in self._eddies]
        strength = self._rms_mps * self.nearness(x_m, y_m, height_m)
        self.x_mps, self.y_mps, self.up_mps = (strength * eddy for eddy in self._eddies)

    def nearness(self, x_m: float, y_m: float, height_m: float) -> float:
        """0 far from everything, 1 on the floor or at a front."""
        near = math.exp(-max(height_m, 0.0) / _FADES_M)
        for shelf in self._shelves:
            if height_m < shelf.height_m:
                beyond_m = max(shelf.x0_m - x_m, 0.0, x_m - shelf.x1_m)
                near += math.exp(-math.hypot(beyond_m, shelf.y_m - y_m) / _FADES_M)
        return near
