"""A bare MAVLink client on a UDP socket, independent of flightd's own codec, to talk to the peers."""

from __future__ import annotations

import asyncio
import math
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect


class RawClient(asyncio.DatagramProtocol):
    """Sends as component 191 of system 1, with a heartbeat each second; keeps every message heard."""

    def __init__(self) -> None:
        self._mav = dialect.MAVLink(None, srcSystem=1, srcComponent=191)
        self._mav.robust_parsing = True
        self.heard: list[tuple[float, Any]] = []
        self.transport: Any = None
        self._next_beat: asyncio.TimerHandle | None = None

    @classmethod
    async def connect(cls, address: tuple[str, int]) -> RawClient:
        loop = asyncio.get_running_loop()
        _, client = await loop.create_datagram_endpoint(cls, remote_addr=address)
        client.beat()
        return client

    def beat(self) -> None:
        """A heartbeat now and each second from now on."""
        self.send(dialect.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3))
        self._next_beat = asyncio.get_running_loop().call_later(1.0, self.beat)

    def connection_made(self, transport: Any) -> None:
        self.transport = transport

    def datagram_received(self, data: bytes, addr: Any) -> None:
        now_s = asyncio.get_running_loop().time()
        self.heard += [(now_s, message) for message in self._mav.parse_buffer(data) or ()]

    def error_received(self, exc: Exception) -> None: ...

    def close(self) -> None:
        if self._next_beat is not None:
            self._next_beat.cancel()
        self.transport.close()

    def send(self, message: Any) -> None:
        self.transport.sendto(message.pack(self._mav))
        self._mav.seq = (self._mav.seq + 1) % 256

    def all(self, kind: str) -> list[Any]:
        return [message for _, message in self.heard if message.get_type() == kind]

    def last(self, kind: str) -> Any:
        return self.all(kind)[-1]

    def times(self, kind: str) -> list[float]:
        return [now_s for now_s, message in self.heard if message.get_type() == kind]

    async def command(self, command: int, *params: float, system: int = 1) -> int | None:
        """The result of a COMMAND_LONG; None when no acknowledgement came within half a second."""
        known = len(self.all("COMMAND_ACK"))
        filled = [*params, *[0.0] * (7 - len(params))]
        self.send(dialect.MAVLink_command_long_message(system, 1, command, 0, *filled))
        for _ in range(50):
            await asyncio.sleep(0.01)
            acks = [ack for ack in self.all("COMMAND_ACK")[known:] if ack.command == command]
            if acks:
                return int(acks[0].result)
        return None

    async def stream(self, message_id: int, hz: float) -> None:
        assert await self.command(511, message_id, 1e6 / hz) == 0

    async def arm_guided(self) -> None:
        assert await self.command(176, 1, 20) == 0
        assert await self.command(400, 1) == 0

    def attitude(
        self,
        roll_deg: float = 0.0,
        pitch_deg: float = 0.0,
        yaw_rad: float = 0.0,
        thrust: float = 0.5,
        mask: int = 7,
        rates: tuple[float, float, float] = (0.0, 0.0, 0.0),
        norm: float = 1.0,
        system: int = 1,
        component: int = 1,
    ) -> None:
        """One SET_ATTITUDE_TARGET."""
        r, p, y = math.radians(roll_deg) / 2, math.radians(pitch_deg) / 2, yaw_rad / 2
        cr, sr, cp, sp, cy, sy = math.cos(r), math.sin(r), math.cos(p), math.sin(p), math.cos(y), math.sin(y)
        q = [
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
        ]
        scaled = [part * norm for part in q]
        self.send(
            dialect.MAVLink_set_attitude_target_message(0, system, component, mask, scaled, *rates, thrust)
        )

    async def fly(self, duration_s: float, hz: float = 20.0, **setpoint: Any) -> None:
        """Stream one setpoint for a while."""
        for _ in range(round(duration_s * hz)):
            self.attitude(**setpoint)
            await asyncio.sleep(1.0 / hz)
