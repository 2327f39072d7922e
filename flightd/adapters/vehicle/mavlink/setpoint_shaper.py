"""From a setpoint to heading and thrust, and what streams while the mission makes none: the same for our own
MAVLink adapters and for MAVSDK's."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Protocol

from flightd.adapters.vehicle.mavlink.climb_check import ClimbCheck
from flightd.adapters.vehicle.mavlink.height_loop import HeightLoop
from flightd.adapters.vehicle.mavlink.mode_manager import ModeArmingManager
from flightd.adapters.vehicle.mavlink.setpoint import HeadingIntegrator
from flightd.core.types import AttitudeSetpoint, VehicleState

_FLOWN_NS = 250_000_000
"""The climb rate of an older setpoint is no longer the vehicle's."""


class Measured(Protocol):
    """What has to be known of the vehicle's motion; NaN or None while it is unknown."""

    armed: bool

    @property
    def yaw_rad(self) -> float | None: ...

    def height_m(self, now_ns: int) -> float: ...

    def fresh_climb_mps(self, now_ns: int) -> float: ...

    @property
    def height_stamp_ns(self) -> int: ...


class SetpointShaper:
    """Heading and own height loop of one vehicle, let go of whenever the vehicle is not ours."""

    def __init__(self, modes: ModeArmingManager, measured: Measured) -> None:
        self._modes = modes
        self._measured = measured
        self._heading = HeadingIntegrator()
        self.height = HeightLoop()
        self._climb = ClimbCheck()
        self._climb_mps = math.nan
        self._climb_ns = 0

    def climb_of(self, state: VehicleState, now_ns: int) -> VehicleState:
        """The state with the climb rate that is flown by, where the told one is not the vehicle's: none while
        no setpoint of ours is flown, since then nothing looks at the height."""
        untold = self._climb.by_height and math.isnan(state.climb_mps)
        if not (state.armed and (self._climb.contradicted or untold)):
            return state
        flown_mps = self._climb_mps if now_ns - self._climb_ns <= _FLOWN_NS else math.nan
        return replace(state, climb_mps=flown_mps, climb_contradicted=True)

    def heading_rad(self, setpoint: AttitudeSetpoint, now_ns: int) -> float | None:
        """The heading for a setpoint that goes out now; None when none may."""
        yaw_rad = self._measured.yaw_rad
        may_steer = self._modes.may_steer or self._modes.steers_unheard
        if not may_steer or yaw_rad is None:
            self._heading.release()
            self.height.release()
            return None
        if self._modes.stands:
            self._heading.release()  # the vehicle may be turned by hand, its compass may still settle
        return self._heading.step(now_ns, setpoint.yaw_rate_radps, yaw_rad)

    def collective(self, setpoint: AttitudeSetpoint, now_ns: int) -> float:
        """Raw thrust for a setpoint's climb rate, by the height loop."""
        height_m, told_mps = self._measured.height_m(now_ns), self._measured.fresh_climb_mps(now_ns)
        if not self._measured.armed and self._climb.contradicted:
            self._climb = ClimbCheck()
        if not math.isnan(height_m):
            self._climb.height(self._measured.height_stamp_ns, height_m)
        pushed_mps = self.height.wanted_mps if self.height.in_air else math.nan
        self._climb_mps = self._climb.believed_mps(now_ns, told_mps, pushed_mps)
        self._climb_ns = now_ns
        return self.height.step(
            now_ns,
            setpoint.climb_mps,
            climb_mps=self._climb_mps,
            lags=self._climb.by_height,
            height_m=height_m,
            tilt_cos=math.cos(setpoint.roll_rad) * math.cos(setpoint.pitch_rad),
            armed=self._measured.armed,
            on_floor=self._modes.stands,
        )

    def idle_thrust(self) -> float | None:
        """Thrust of a level setpoint while the mission makes none: PX4 enters OFFBOARD only while they
        stream.  On the floor nothing; in the air only until OFFBOARD is entered, never to keep it flying."""
        if not self._modes.wants_flight:
            return None
        if self._modes.stands and not (self._measured.armed and self.height.in_air):
            return 0.0
        return None if self._modes.may_steer else self.height.hover
