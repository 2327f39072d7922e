"""The few autopilot parameters that the setpoint's meaning hangs on."""

from __future__ import annotations

import asyncio
import math
import struct

from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.adapters.vehicle.mavlink.codec import Message
from flightd.adapters.vehicle.mavlink.link import MavlinkLink

_ANSWER_S = 0.4
_ATTEMPTS = 3
_AGAIN_S = 5.0


class ParameterReader:
    """Reads named parameters, again and again until each has answered under one of its names.

    `values` is by the first of the names.  An unknown name is answered by silence, hence the attempts.
    """

    def __init__(self, link: MavlinkLink, system_id: int, names: tuple[tuple[str, ...], ...]) -> None:
        self._link = link
        self._system_id = system_id
        self._names = names
        self._heard: dict[str, float] = {}
        self._arrived = asyncio.Event()

    def get(self, names: tuple[str, ...]) -> tuple[str, float] | None:
        """The name that answered and its value, or None."""
        for name in names:
            if name in self._heard:
                return name, self._heard[name]
        return None

    def forget(self) -> None:
        """The autopilot rebooted: its parameters may have changed."""
        self._heard.clear()

    def value(self, message: Message, *, bytewise: bool) -> None:
        """Take a PARAM_VALUE, asked for by whomever.

        `bytewise`: PX4 puts the four bytes of an INT32 in the float's place, ArduPilot its value.
        """
        value = float(message.param_value)
        if bytewise and message.param_type == dialect.MAV_PARAM_TYPE_INT32:
            value = float(struct.unpack("<i", struct.pack("<f", value))[0])
        if math.isfinite(value):
            self._heard[str(message.param_id)] = value
            self._arrived.set()

    async def run(self) -> None:
        """Fill in what is missing until cancelled."""
        while True:
            for names in self._names:
                if self.get(names) is None:
                    await self._read(names)
            await asyncio.sleep(_AGAIN_S if any(self.get(names) is None for names in self._names) else 1.0)

    async def _read(self, names: tuple[str, ...]) -> None:
        for _ in range(_ATTEMPTS):
            self._arrived.clear()
            for name in names:
                target = dialect.MAV_COMP_ID_AUTOPILOT1
                self._link.send(
                    dialect.MAVLink_param_request_read_message(self._system_id, target, name.encode(), -1)
                )
            try:
                async with asyncio.timeout(_ANSWER_S):
                    while self.get(names) is None:
                        await self._arrived.wait()
                        self._arrived.clear()
            except TimeoutError:
                continue
            return
