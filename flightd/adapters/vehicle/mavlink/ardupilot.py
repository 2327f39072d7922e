"""ArduCopter: attitude flight in GUIDED_NOGPS or GUIDED, LAND as the way down of last resort."""

from __future__ import annotations

import asyncio
from dataclasses import replace

from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.adapters.vehicle.mavlink.link.codec import Message
from flightd.adapters.vehicle.mavlink.link.connection import Firmware
from flightd.adapters.vehicle.mavlink.refusal import FarFromOrigin, ParameterUnread, ThrustMismatch
from flightd.adapters.vehicle.mavlink.services.estimator_origin import Origin
from flightd.adapters.vehicle.mavlink.setpoint import climb_thrust
from flightd.adapters.vehicle.mavlink.vehicle import DEFAULTS, MavlinkOptions, MavlinkVehicle
from flightd.config.vehicle import DEFAULT_ORIGIN_DEG
from flightd.core.refusal import Refusal
from flightd.core.types import AttitudeSetpoint, VehicleState
from flightd.ports import Clock

GUIDED = dialect.COPTER_MODE_GUIDED
GUIDED_NOGPS = dialect.COPTER_MODE_GUIDED_NOGPS
LAND = dialect.COPTER_MODE_LAND

_MODE_NAMES: dict[int, str] = {
    number: entry.name.removeprefix("COPTER_MODE_")
    for number, entry in dialect.enums["COPTER_MODE"].items()
    if not entry.name.endswith("ENUM_END")
}

_GUID_OPTIONS = ("GUID_OPTIONS",)
_SPEED_UP = ("WPNAV_SPEED_UP", "WP_SPD_UP")
_SPEED_DOWN = ("WPNAV_SPEED_DN", "WP_SPD_DN")
_DEFAULT_UP_MPS, _DEFAULT_DOWN_MPS = 2.5, 1.5
_THRUST_IS_COLLECTIVE = 8
_FIELD_CHECK = "Check mag field"
"""What it says before it is armed, of a compass that the earth's field contradicts."""


class ArduPilotVehicle(MavlinkVehicle):
    """An ArduCopter.  With bit 3 of GUID_OPTIONS thrust is collective and our own height loop flies;
    until that parameter is known the vehicle is neither armed nor taken over, for the thrust that holds
    the height would then be half of full power."""

    firmware = Firmware.ARDUPILOT
    watches_beats = True
    flying_mode: int = GUIDED_NOGPS
    landing_mode = LAND
    parameter_names = (_GUID_OPTIONS, _SPEED_UP, _SPEED_DOWN)
    required_names = (_GUID_OPTIONS,)

    def __init__(
        self,
        url: str,
        clock: Clock,
        options: MavlinkOptions = DEFAULTS,
    ) -> None:
        super().__init__(url, clock, options)
        self.flying_mode = GUIDED if options.job.guided else GUIDED_NOGPS
        self._raw_thrust = options.job.raw_thrust
        self._flies_raw = False
        self._has_default_origin = options.origin_deg == DEFAULT_ORIGIN_DEG
        self._origin: Origin | None = None
        if options.job.guided and options.pose_form is not None:
            self._origin = Origin(
                self.link,
                self._commander,
                options.system_id,
                options.origin_deg,
                lambda: self.gives_pose,
            )

    def state(self) -> VehicleState | None:
        state = super().state()
        by_default = self._has_default_origin and self._origin is not None and self._origin.is_ours
        if state is None or state.refusal is None or not by_default:
            return state
        if _FIELD_CHECK not in str(state.refusal):
            return state
        return replace(state, refusal=FarFromOrigin(state.refusal))

    def mode_name(self, custom_mode: int) -> str:
        return _MODE_NAMES.get(custom_mode, f"mode {custom_mode}")

    def mode_params(self, custom_mode: int) -> tuple[float, ...]:
        return float(dialect.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED), float(custom_mode)

    def not_fit(self) -> Refusal | None:
        problem = super().not_fit()
        if problem is not None:
            return problem
        raw = self._thrust_is_raw()
        if raw is None:
            return ParameterUnread(_GUID_OPTIONS[0])
        if self._raw_thrust is not None and raw is not self._raw_thrust:
            return ThrustMismatch(raw)
        return None

    def _serve(self, tasks: asyncio.TaskGroup) -> None:
        super()._serve(tasks)
        if self._origin is not None:
            tasks.create_task(self._once_heard(self._origin.run), name="ardupilot origin")

    def _received(self, message: Message, now_ns: int) -> None:
        super()._received(message, now_ns)
        if self._origin is not None:
            self._origin.take(message)

    def _rebooted(self) -> None:
        super()._rebooted()
        if self._origin is not None:
            self._origin.forget()

    def _thrust_is_raw(self) -> bool | None:
        """Whether thrust is collective; None while the parameter is not known."""
        found = self.parameters.get(_GUID_OPTIONS)
        if found is None:
            return None
        self._flies_raw = bool(int(found[1]) & _THRUST_IS_COLLECTIVE)
        return self._flies_raw

    def keeps_climb(self) -> bool:
        return self._thrust_is_raw() is False

    def _holds_failsafe(self) -> bool:
        """Not in GUIDED_NOGPS once nobody flies it, for nothing steers it there but our setpoints; in GUIDED
        a ground station may."""
        return self.flying_mode != GUIDED_NOGPS or not self._modes.is_forsaken

    def _thrust(self, setpoint: AttitudeSetpoint, now_ns: int) -> float:
        raw = self._thrust_is_raw()
        if self._flies_raw if raw is None else raw:  # it is read anew in the air: it is what it was
            return self._steering.collective(setpoint, now_ns)
        return climb_thrust(
            setpoint.climb_mps,
            self._speed_mps(_SPEED_UP, _DEFAULT_UP_MPS),
            self._speed_mps(_SPEED_DOWN, _DEFAULT_DOWN_MPS),
        )

    def _speed_mps(self, names: tuple[str, ...], default_mps: float) -> float:
        """A climb or sink speed: in cm/s under its old name, in m/s under that of ArduCopter 4.7."""
        found = self.parameters.get(names)
        if found is None:
            return default_mps
        name, value = found
        speed_mps = value / 100.0 if name.startswith("WPNAV_") else value
        return speed_mps if speed_mps > 0.0 else default_mps
