"""An output of the autopilot that is switched: a relay of an ArduPilot, an actuator of a PX4."""

from __future__ import annotations

import math

from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.adapters.vehicle.mavlink.link.connection import Firmware
from flightd.adapters.vehicle.mavlink.services.commands import Commander
from flightd.core.errors import TransientError

_ACTUATORS = 6
_OUT, _LIT = -1.0, 1.0
"""Values of an actuator; those that are not to change are NaN."""


class SwitchedOutput:
    """ArduPilot: MAV_CMD_DO_SET_RELAY, counted from 0.  PX4, which has no relays: the peripheral actuator of
    that number from 1, by MAV_CMD_DO_SET_ACTUATOR."""

    def __init__(self, commander: Commander, firmware: Firmware, number: int) -> None:
        self._commander = commander
        self._firmware = firmware
        self._number = number

    async def switch(self, on: bool) -> None:
        """Raises TransientError when the autopilot does not do it."""
        command, params = self._order(on)
        answer = await self._commander.send(command, *params)
        if not answer.accepted:
            raise TransientError(f"the autopilot does not switch output {self._number}: {answer}")

    def release(self) -> None:
        """Switch it off as the last thing, whether anybody answers or not."""
        command, params = self._order(on=False)
        self._commander.post(command, *params)

    def _order(self, on: bool) -> tuple[int, tuple[float, ...]]:
        if self._firmware is Firmware.ARDUPILOT:
            return int(dialect.MAV_CMD_DO_SET_RELAY), (float(self._number), float(on))
        values = [math.nan] * _ACTUATORS
        values[self._number - 1] = _LIT if on else _OUT
        return int(dialect.MAV_CMD_DO_SET_ACTUATOR), (*values, 0.0)
