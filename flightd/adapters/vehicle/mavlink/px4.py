"""PX4: attitude flight in OFFBOARD, raw thrust by our own height loop, AUTO.LAND as the way down.

After PX4's documentation and sources; not tried on hardware.
"""

from __future__ import annotations

import asyncio

from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.adapters.vehicle.mavlink.link.connection import Firmware
from flightd.adapters.vehicle.mavlink.setpoint import attitude_target
from flightd.adapters.vehicle.mavlink.telemetry import ClimbSource
from flightd.adapters.vehicle.mavlink.vehicle import DEFAULTS, RATES_HZ, MavlinkOptions, MavlinkVehicle
from flightd.core.types import AttitudeSetpoint
from flightd.ports import Clock

_AUTO = 4
OFFBOARD = 6 << 16
LAND = _AUTO << 16 | 6 << 24

_MAIN_MODES = {
    1: "MANUAL",
    2: "ALTCTL",
    3: "POSCTL",
    5: "ACRO",
    6: "OFFBOARD",
    7: "STABILIZED",
    8: "RATTITUDE",
}
_AUTO_MODES = {1: "READY", 2: "TAKEOFF", 3: "LOITER", 4: "MISSION", 5: "RTL", 6: "LAND", 9: "PRECLAND"}

_IDLE_PERIOD_S = 0.05
_PUMP_SILENT_NS = 200_000_000


class Px4Vehicle(MavlinkVehicle):
    """A PX4 multicopter.

    PX4 enters and keeps OFFBOARD only while setpoints stream, so until the mission's own come this adapter
    streams idle ones: on the floor without thrust, in the air (a flight taken over again) only until
    OFFBOARD is entered.  They can therefore never keep a vehicle flying whose mission is dead.
    """

    firmware = Firmware.PX4
    flying_mode = OFFBOARD
    landing_mode = LAND
    prime_s = 1.3  # PX4 wants more than a second
    parameter_names = (("MPC_THR_HOVER",),)
    climb_from = ClimbSource.LOCAL_POSITION
    rates_hz = {
        message_id: hz
        for message_id, hz in RATES_HZ.items()
        if message_id != dialect.MAVLINK_MSG_ID_GLOBAL_POSITION_INT
    } | {dialect.MAVLINK_MSG_ID_LOCAL_POSITION_NED: 50.0}

    def __init__(self, url: str, clock: Clock, options: MavlinkOptions = DEFAULTS) -> None:
        super().__init__(url, clock, options)
        self._sent_ns = 0
        self._guessed = False

    def mode_name(self, custom_mode: int) -> str:
        main, sub = custom_mode >> 16 & 0xFF, custom_mode >> 24 & 0xFF
        if main == _AUTO:
            return f"AUTO.{_AUTO_MODES.get(sub, sub)}"
        return _MAIN_MODES.get(main, f"mode {main}.{sub}")

    def send(self, setpoint: AttitudeSetpoint) -> bool:
        sent = super().send(setpoint)
        if sent:
            self._sent_ns = self._clock.now_ns()
        return sent

    def _serve(self, tasks: asyncio.TaskGroup) -> None:
        super()._serve(tasks)
        tasks.create_task(self._once_heard(self._idle), name="px4 idle setpoints")

    def mode_params(self, custom_mode: int) -> tuple[float, ...]:
        main, sub = custom_mode >> 16 & 0xFF, custom_mode >> 24 & 0xFF
        return float(dialect.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED), float(main), float(sub)

    def _thrust(self, setpoint: AttitudeSetpoint, now_ns: int) -> float:
        self._guess_hover()
        return self._steering.collective(setpoint, now_ns)

    def _guess_hover(self) -> None:
        """Start from the autopilot's own idea of the hover thrust; in the air the loop knows better."""
        found = self.parameters.get(("MPC_THR_HOVER",))
        if found is not None and not self._guessed and not self._steering.height.in_air:
            self._guessed = True
            self._steering.height.guess(min(max(found[1], 0.1), 0.8))

    async def _idle(self) -> None:
        while True:
            await asyncio.sleep(_IDLE_PERIOD_S)
            now_ns = self._clock.now_ns()
            yaw_rad = self._telemetry.yaw_rad
            if yaw_rad is None or now_ns - self._sent_ns < _PUMP_SILENT_NS:
                continue
            self._guess_hover()
            thrust = self._steering.idle_thrust()
            if thrust is None:
                continue
            level = AttitudeSetpoint(now_ns)
            self.link.send(attitude_target(now_ns, self._system_id, level, yaw_rad, thrust))
