"""The autopilot's height loop: climb rate in, collective out."""

from __future__ import annotations

from dataclasses import dataclass

from flightd.core.geometry import GRAVITY_MPS2

_MOST_TRIM_MPS2 = 4.0
"""As much as a battery that is nearly empty takes, for which real autopilots scale their thrust."""


@dataclass(frozen=True, slots=True)
class ClimbGains:
    """ArduCopter's cascade: position P over a velocity PI, the wanted climb rate slewed at `accel_mps2`."""

    position_per_s: float = 1.0
    velocity_per_s: float = 6.0
    integral_per_s2: float = 3.0
    accel_mps2: float = 2.5
    hover_guess: float = 0.34


class ClimbLoop:
    """Holds the height it has integrated from the wanted climb rate, so that zero holds still."""

    def __init__(self, gains: ClimbGains | None = None) -> None:
        self._gains = gains or ClimbGains()
        self._wanted_mps = 0.0
        self._target_m = 0.0
        self._trim_mps2 = 0.0

    def reset(self, height_m: float) -> None:
        """Forget the past and hold `height_m`; for the motors' first spin-up and on the floor."""
        self._wanted_mps = 0.0
        self._target_m = height_m
        self._trim_mps2 = 0.0

    def step(
        self, dt_s: float, climb_mps: float, *, height_m: float, speed_mps: float, tilt_cos: float
    ) -> float:
        """Collective, 0..1, for a wanted `climb_mps` given the *estimated* height and climb speed."""
        g = self._gains
        slew = g.accel_mps2 * dt_s
        self._wanted_mps += min(max(climb_mps - self._wanted_mps, -slew), slew)
        self._target_m += self._wanted_mps * dt_s
        lag_m = self._target_m - height_m
        if abs(lag_m) > 0.5:  # the vehicle cannot follow: do not wind up
            self._target_m = height_m + (0.5 if lag_m > 0 else -0.5)
            lag_m = self._target_m - height_m
        error_mps = self._wanted_mps + g.position_per_s * lag_m - speed_mps
        self._trim_mps2 += g.integral_per_s2 * error_mps * dt_s
        self._trim_mps2 = min(max(self._trim_mps2, -_MOST_TRIM_MPS2), _MOST_TRIM_MPS2)
        accel = g.velocity_per_s * error_mps + self._trim_mps2
        collective = g.hover_guess * (1.0 + accel / GRAVITY_MPS2) / max(tilt_cos, 0.5)
        return min(max(collective, 0.0), 1.0)
