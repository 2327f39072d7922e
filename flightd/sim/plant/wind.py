"""Moving air: a steady wind and gusts."""

from __future__ import annotations

import math
import random
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class WindParams:
    """Air in a hall.  The mean blows towards +x and +y of the map frame; the gusts are a first-order
    Gauss-Markov process per axis (the longitudinal Dryden form) of the given rms and correlation time."""

    mean_x_mps: float = 0.0
    mean_y_mps: float = 0.0
    gust_rms_mps: float = 0.3
    vertical_gust_rms_mps: float = 0.1
    correlation_s: float = 2.0

    def __post_init__(self) -> None:
        if self.gust_rms_mps < 0 or self.vertical_gust_rms_mps < 0 or not self.correlation_s > 0:
            raise ValueError(f"gusts need rms >= 0 and a correlation time > 0: {self}")


class Wind:
    """Air velocity over time: `x_mps`, `y_mps` in the map frame, `up_mps` upwards.  Same seed, same air."""

    __slots__ = ("_decay", "_dt_s", "_kick", "_params", "_rng", "_vertical", "up_mps", "x_mps", "y_mps")

    def __init__(self, params: WindParams, seed: int) -> None:
        self._params = params
        self._rng = random.Random(seed)
        vertical, horizontal = params.vertical_gust_rms_mps, params.gust_rms_mps
        self._vertical = vertical / horizontal if horizontal else 0.0
        self._dt_s = self._decay = self._kick = 0.0
        self.x_mps = params.mean_x_mps + self._rng.gauss(0.0, horizontal)
        self.y_mps = params.mean_y_mps + self._rng.gauss(0.0, horizontal)
        self.up_mps = self._rng.gauss(0.0, vertical)

    def step(self, dt_s: float) -> None:
        """Let `dt_s` pass; the process is exact for any step."""
        if dt_s != self._dt_s:
            self._dt_s = dt_s
            self._decay = math.exp(-dt_s / self._params.correlation_s)
            self._kick = self._params.gust_rms_mps * math.sqrt(1.0 - self._decay**2)
        decay, kick, gauss = self._decay, self._kick, self._rng.gauss
        mean_x, mean_y = self._params.mean_x_mps, self._params.mean_y_mps
        self.x_mps = mean_x + (self.x_mps - mean_x) * decay + gauss(0.0, kick)
        self.y_mps = mean_y + (self.y_mps - mean_y) * decay + gauss(0.0, kick)
        self.up_mps = self.up_mps * decay + gauss(0.0, kick * self._vertical)
