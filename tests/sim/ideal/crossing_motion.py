"""How a drone moves that is held to a moving point while gusts push it: a point mass that leans.

As much of an airframe as its lines tell from a true one, and fast enough for thousands of crossings.
"""

from __future__ import annotations

import math
import random

from flightd.core.geometry import GRAVITY_MPS2, wrap_pi
from flightd.core.types import Attitude, LandedState, VehicleState
from flightd.sim.plant.airframe import AirframeParams
from flightd.sim.plant.kinematics import Kinematics
from flightd.sim.plant.wind import Wind, WindParams

STEP_S = 0.02
_STIFF, _DAMPING = 4.0, 3.0
_MOST_MPS2, _LAG_S, _DRAG_PER_S = 2.0, 0.15, AirframeParams().drag_per_s
_TURN_S = 0.3
"""Time within which it turns to the heading that it is to have."""
_LOWEST_M, _HIGHEST_M = 1.0, 3.0
_HEADING_OFFSET_RAD = 0.7
"""What the compass tells along the map's x axis."""
_GYRO_RADPS, _CLIMB_MPS, _RANGE_M = math.radians(0.3), 0.02, 0.005
"""Noise of what is told."""


class Fading:
    """Noise of that rms which fades within `fade_s` (Ornstein, Uhlenbeck)."""

    def __init__(self, rng: random.Random, rms: float, fade_s: float) -> None:
        self._rng, self._keep = rng, math.exp(-STEP_S / fade_s)
        self._stir = rms * math.sqrt(1.0 - self._keep**2)
        self.now = rng.gauss(0.0, rms)

    def step(self) -> float:
        """The noise one step later."""
        self.now = self._keep * self.now + self._rng.gauss(0.0, self._stir)
        return self.now


class Motion:
    """The truth of one drone, and what its autopilot tells of it; call `step` every `STEP_S`."""

    def __init__(
        self, rng: random.Random, at_m: tuple[float, float], gust_mps: float, sway_rad: float
    ) -> None:
        self._rng = rng
        self.at_m, self._speed_mps, self._lean_mps2 = at_m, (0.0, 0.0), (0.0, 0.0)
        self.height_m = rng.uniform(1.2, 2.4)
        self._climb = Fading(rng, 0.1, 2.0)
        self._air = Wind(WindParams(gust_rms_mps=gust_mps), rng.randrange(2**32))
        self._sway = Fading(rng, sway_rad, 1.0)
        self._yaw_rad = self._yaw_radps = 0.0
        self._bias_rad = rng.gauss(0.0, math.radians(0.2)), rng.gauss(0.0, math.radians(0.2))
        self._wander = tuple(Fading(rng, math.radians(degrees), 20.0) for degrees in (0.1, 0.1, 0.4))
        self.now_ns = 10**9

    @property
    def kinematics(self) -> Kinematics:
        """The truth."""
        c, s = math.cos(self._yaw_rad), math.sin(self._yaw_rad)
        ax, ay = self._lean_mps2
        return Kinematics(
            stamp_ns=self.now_ns,
            x_m=self.at_m[0],
            y_m=self.at_m[1],
            height_m=self.height_m,
            vx_mps=self._speed_mps[0],
            vy_mps=self._speed_mps[1],
            climb_mps=self._climb.now,
            roll_rad=math.atan((c * ay - s * ax) / GRAVITY_MPS2),
            pitch_rad=-math.atan((c * ax + s * ay) / GRAVITY_MPS2),
            yaw_rad=self._yaw_rad,
            roll_rate_radps=0.0,
            pitch_rate_radps=0.0,
            yaw_rate_radps=self._yaw_radps,
        )

    @property
    def attitude(self) -> Attitude:
        """What is told of it."""
        k, (roll, pitch, yaw) = self.kinematics, (wander.now for wander in self._wander)
        return Attitude(
            self.now_ns,
            k.roll_rad + self._bias_rad[0] + roll,
            k.pitch_rad + self._bias_rad[1] + pitch,
            wrap_pi(k.yaw_rad + _HEADING_OFFSET_RAD + yaw),
            self._yaw_radps + self._rng.gauss(0.0, _GYRO_RADPS),
        )

    def told(self, attitude: Attitude) -> VehicleState:
        """What is told beside its newest attitude."""
        return VehicleState(
            attitude=attitude,
            height_m=round(self.height_m + self._rng.gauss(0.0, _RANGE_M), 2),
            height_stamp_ns=self.now_ns,
            climb_mps=self._climb.now + self._rng.gauss(0.0, _CLIMB_MPS),
            mode="GUIDED_NOGPS",
            in_control=True,
            armed=True,
            landed=LandedState.IN_AIR,
            battery_frac=1.0,
            battery_v=12.0,
            heartbeat_ns=self.now_ns,
        )

    def step(self, to_m: tuple[float, float], speed_mps: tuple[float, float], yaw_rad: float) -> None:
        """Follow a point and its speed, in that heading."""
        self.now_ns += round(STEP_S * 1e9)
        want = [
            _STIFF * (to - at) + _DAMPING * (wanted - speed) + _DRAG_PER_S * speed
            for to, at, wanted, speed in zip(to_m, self.at_m, speed_mps, self._speed_mps, strict=True)
        ]
        within, part = min(_MOST_MPS2 / max(math.hypot(*want), 1e-9), 1.0), STEP_S / _LAG_S
        ax, ay = (a + part * (within * to - a) for a, to in zip(self._lean_mps2, want, strict=True))
        self._lean_mps2 = ax, ay
        (x, y), (vx, vy) = self.at_m, self._speed_mps
        self._air.step(STEP_S)
        ax += _DRAG_PER_S * (self._air.x_mps - vx)
        ay += _DRAG_PER_S * (self._air.y_mps - vy)
        self.at_m = x + (vx + 0.5 * ax * STEP_S) * STEP_S, y + (vy + 0.5 * ay * STEP_S) * STEP_S
        self._speed_mps = vx + ax * STEP_S, vy + ay * STEP_S
        if not _LOWEST_M < self.height_m + self._climb.step() * STEP_S < _HIGHEST_M:
            self._climb.now *= -1.0
        self.height_m += self._climb.now * STEP_S
        self._yaw_radps = wrap_pi(yaw_rad + self._sway.step() - self._yaw_rad) / _TURN_S
        self._yaw_rad = wrap_pi(self._yaw_rad + self._yaw_radps * STEP_S)
        for wander in self._wander:
            wander.step()
