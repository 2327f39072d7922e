"""An autopilot that says only what a test tells it to, and keeps all that it hears."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.adapters.vehicle.mavlink.ardupilot import ArduPilotVehicle
from flightd.adapters.vehicle.mavlink.vehicle import MavlinkOptions, MavlinkVehicle
from flightd.core.types import VehicleState
from flightd.runtime.clock import LoopClock
from flightd.sim.autopilot.link import MavlinkChannel, UdpLink
from flightd.sim.autopilot.parameters import COPTER_PARAMETERS

SET_MODE, ARM, INTERVAL = 176, 400, 511
GUIDED_NOGPS, ALT_HOLD, LAND = 20, 2, 9
ARDUPILOT, PX4 = dialect.MAV_AUTOPILOT_ARDUPILOTMEGA, dialect.MAV_AUTOPILOT_PX4


def known(vehicle: Any) -> VehicleState:
    """A copy of what the vehicle knows now: asked for twice, it may say something else."""
    state = vehicle.state()
    assert state is not None
    return VehicleState(**{name: getattr(state, name) for name in VehicleState.__slots__})


WAY_DOWN: dict[str, float] = {
    "GUID_TIMEOUT": 0.5,
    "FS_GCS_ENABLE": 5,
    "FS_GCS_TIMEOUT": 0.5,
    "SYSID_MYGCS": 191,
}
"""Without these nothing is armed."""


class ScriptedAutopilot:
    """Acknowledges what `results` says (by command id), everything else as accepted; None is silence."""

    def __init__(self, system_id: int = 1, component_id: int = 1) -> None:
        self.link = UdpLink(system_id, component_id, self._received)
        self.heard: list[tuple[float, Any]] = []
        self.results: dict[int, list[int | None] | int | None] = {}
        self.parameters: dict[str, float] = {
            **COPTER_PARAMETERS,
            "GUID_OPTIONS": 0,
            "WPNAV_SPEED_UP": 250,
            "WPNAV_SPEED_DN": 150,
            **WAY_DOWN,
        }
        self.mode, self.armed, self.autopilot, self.kind = 0, False, ARDUPILOT, 2
        self.obeys = True
        self.after: Callable[[Any], None] = lambda message: None
        """Called with each command after its acknowledgement went out."""

    def say(self, message: Any) -> None:
        self.link.broadcast(message)

    def beat(self, mode: int | None = None) -> None:
        base = 1 | (128 if self.armed else 0)
        shown = self.mode if mode is None else mode
        self.say(dialect.MAVLink_heartbeat_message(self.kind, self.autopilot, base, shown, 4, 3))

    async def run(self, hz: float = 20.0) -> None:
        boot_ms = 0
        while True:
            self.beat()
            boot_ms += round(1000 / hz)
            self.say(dialect.MAVLink_attitude_message(boot_ms, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0))
            await asyncio.sleep(1.0 / hz)

    def all(self, kind: str) -> list[Any]:
        return [message for _, message in self.heard if message.get_type() == kind]

    def times(self, kind: str) -> list[float]:
        return [at_s for at_s, message in self.heard if message.get_type() == kind]

    def commands(self, command: int) -> list[Any]:
        return [m for m in self.all("COMMAND_LONG") if m.command == command]

    def _received(self, channel: MavlinkChannel, message: Any) -> None:
        self.heard.append((asyncio.get_running_loop().time(), message))
        if message.get_type() == "COMMAND_LONG":
            self._command(channel, message)
        if message.get_type() == "PARAM_REQUEST_READ" and message.param_id in self.parameters:
            value = self.parameters[message.param_id]
            self.say(dialect.MAVLink_param_value_message(message.param_id.encode(), value, 9, 3, 0))

    def _command(self, channel: MavlinkChannel, message: Any) -> None:
        planned = self.results.get(message.command, 0)
        if isinstance(planned, list):
            planned = planned.pop(0) if len(planned) > 1 else planned[0]
        if planned == 0 and self.obeys:
            if message.command == dialect.MAV_CMD_DO_SET_MODE:
                self.mode = int(message.param2)
            if message.command == dialect.MAV_CMD_COMPONENT_ARM_DISARM:
                self.armed = message.param1 == 1
        if planned is not None:
            self.link.send(
                channel, dialect.MAVLink_command_ack_message(message.command, planned, 0, 0, 1, 191)
            )
        self.after(message)


@asynccontextmanager
async def scripted(
    autopilot: ScriptedAutopilot | None = None, *, beats: bool = True, **options: Any
) -> AsyncIterator[tuple[ScriptedAutopilot, MavlinkVehicle]]:
    """A scripted autopilot and an ArduPilot adapter that talk to each other."""
    autopilot = autopilot or ScriptedAutopilot()
    host, port = await autopilot.link.open("127.0.0.1", 0)
    vehicle = ArduPilotVehicle(f"udpout://{host}:{port}", LoopClock(), MavlinkOptions(**options))
    tasks = [asyncio.create_task(vehicle.run(), name="vehicle")]
    if beats:
        tasks.append(asyncio.create_task(autopilot.run(), name="autopilot"))
    await asyncio.sleep(1.0)
    try:
        yield autopilot, vehicle
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        autopilot.link.close()
        await asyncio.sleep(0)
