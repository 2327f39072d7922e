"""The autopilot's height loop: climb rate in, collective out."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class ClimbGains:
    """ArduCopter's cascade with its defaults: position P (PSC_POSZ_P) over velocity P (PSC_VELZ_P) over a PI
    of the acceleration (PSC_ACCZ_P, _I and _FLTE).  The wanted climb rate is followed at no more than
    `accel_mps2` (WPNAV_ACCEL_Z), changed by no more than `jerk_mps3` (PSC_JERK_Z) and fed forward; both as
    they are shipped, for its own defaults (1 and 5) take twice as long to end a climb."""

    position_per_s: float = 1.0
    velocity_per_s: float = 5.0
    collective_per_mps2: float = 0.05
    collective_per_mps: float = 0.1
    error_lag_s: float = 0.008
    accel_mps2: float = 2.5
    jerk_mps3: float = 20.0


class ClimbLoop:
    """Holds the height it has integrated from the wanted climb rate, so that zero holds still.

    What hovers it finds by its integral, which begins at the collective that there is: as with the firmware
    no guess of it is needed, and none has an effect."""

    def __init__(self, gains: ClimbGains | None = None) -> None:
        self.gains = gains or ClimbGains()
        self._wanted_mps = self._wanted_mps2 = 0.0
        self._target_m = 0.0
        self._error_mps2 = 0.0
        self._held = 0.0

    @property
    def wanted_mps(self) -> float:
        """The climb rate that is followed at present."""
        return self._wanted_mps

    def reset(self, height_m: float, collective: float = 0.0, speed_mps: float = 0.0) -> None:
        """Forget the past and go on from this height, climb and `collective`: 0 on the floor."""
        self._wanted_mps, self._wanted_mps2 = speed_mps, 0.0
        self._target_m = height_m
        self._error_mps2 = 0.0
        self._held = collective

    def step(
        self,
        dt_s: float,
        climb_mps: float,
        *,
        height_m: float,
        speed_mps: float,
        accel_mps2: float,
        tilt_cos: float,
    ) -> float:
        """Collective, 0..1, for a wanted `climb_mps` by *estimated* height, climb speed and its change."""
        g = self.gains
        self._shape(dt_s, climb_mps)
        self._target_m += self._wanted_mps * dt_s
        lag_m = self._target_m - height_m
        if abs(lag_m) > 0.5:  # the vehicle cannot follow: do not wind up
            self._target_m = height_m + (0.5 if lag_m > 0 else -0.5)
            lag_m = self._target_m - height_m
        error_mps = self._wanted_mps + g.position_per_s * lag_m - speed_mps
        error_mps2 = self._wanted_mps2 + g.velocity_per_s * error_mps - accel_mps2
        self._error_mps2 += (error_mps2 - self._error_mps2) * dt_s / (dt_s + g.error_lag_s)
        held = self._held + g.collective_per_mps * self._error_mps2 * dt_s
        self._held = min(max(held, 0.0), 1.0)
        collective = (self._held + g.collective_per_mps2 * self._error_mps2) / max(tilt_cos, 0.5)
        return min(max(collective, 0.0), 1.0)

    def _shape(self, dt_s: float, climb_mps: float) -> None:
        """Move what is followed towards `climb_mps`, so that it arrives without acceleration."""
        g = self.gains
        behind_mps = climb_mps - self._wanted_mps
        linear_mps = g.accel_mps2**2 / g.jerk_mps3
        if abs(behind_mps) < linear_mps:
            mps2 = behind_mps * g.jerk_mps3 / g.accel_mps2
        else:
            mps2 = math.copysign(
                math.sqrt(2.0 * g.jerk_mps3 * (abs(behind_mps) - 0.5 * linear_mps)), behind_mps
            )
        mps2 = min(max(mps2, -g.accel_mps2), g.accel_mps2)
        most = g.jerk_mps3 * dt_s
        self._wanted_mps2 += min(max(mps2 - self._wanted_mps2, -most), most)
        self._wanted_mps += self._wanted_mps2 * dt_s
