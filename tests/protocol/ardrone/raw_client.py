"""An emulated drone and a bare client that speaks bytes to it, in virtual time."""

from __future__ import annotations

import asyncio
import contextlib
import struct
from collections.abc import AsyncIterator
from typing import Any

from flightd.runtime.clock import LoopClock
from flightd.runtime.within import Within
from flightd.sim.ardrone.drone import Drone
from flightd.sim.ardrone.server import ArDroneServer
from tests.rigs.ardrone import ANY_PORTS, ended, make_drone


class RawClient(asyncio.DatagramProtocol):
    """Sends what it is told, unnumbered or numbered, and keeps every navdata packet with its time."""

    def __init__(self, server: ArDroneServer, clock: LoopClock) -> None:
        self.server = server
        self.clock = clock
        self.packets: list[tuple[int, bytes]] = []
        self._number = 0
        self._heard = asyncio.Event()
        self._at: Any = None
        self._navdata: Any = None

    async def open(self) -> None:
        loop = asyncio.get_running_loop()
        ports = self.server.ports
        self._at, _ = await loop.create_datagram_endpoint(
            asyncio.DatagramProtocol, remote_addr=(ports.host, ports.at)
        )
        self._navdata, _ = await loop.create_datagram_endpoint(
            lambda: self, remote_addr=(ports.host, ports.navdata)
        )

    def close(self) -> None:
        self._at.close()
        self._navdata.close()

    def datagram_received(self, data: bytes, addr: Any) -> None:
        self.packets.append((self.clock.now_ns(), data))
        self._heard.set()

    def raw(self, datagram: bytes) -> None:
        self._at.sendto(datagram)

    def say(self, *commands: str) -> None:
        """Number and send, in one datagram: `REF,0` becomes `AT*REF=n,0`."""
        datagram = b""
        for command in commands:
            self._number += 1
            name, comma, arguments = command.partition(",")
            datagram += f"AT*{name}={self._number}{comma}{arguments}\r".encode()
        self.raw(datagram)

    def wake(self, data: bytes = b"\x01\x00\x00\x00") -> None:
        self._navdata.sendto(data)

    async def keep_saying(self, duration_s: float, *commands: str) -> None:
        """Repeat every 30 ms."""
        end_ns = self.clock.now_ns() + round(duration_s * 1e9)
        while self.clock.now_ns() < end_ns:
            self.say(*commands)
            await asyncio.sleep(0.03)

    async def configure(self, key: str, value: str) -> None:
        """One CONFIG with its handshake."""
        self.say("CTRL,5,0", f'CONFIG,"{key}","{value}"')
        await asyncio.sleep(0.01)
        self.say("CTRL,5,0")

    @property
    def newest(self) -> bytes:
        return self.packets[-1][1]

    @property
    def state(self) -> int:
        """State bits of the newest packet."""
        bits: int = struct.unpack_from("<I", self.newest, 4)[0]
        return bits

    @property
    def sequence(self) -> int:
        number: int = struct.unpack_from("<I", self.newest, 8)[0]
        return number

    async def next_state(self) -> int:
        """State bits of the next packet to come once all is said."""
        await asyncio.sleep(0.02)
        self._heard.clear()
        async with Within(1.0):
            await self._heard.wait()
        return self.state


@contextlib.asynccontextmanager
async def raw_drone(drone: Drone | None = None, **options: Any) -> AsyncIterator[RawClient]:
    clock = LoopClock()
    async with ArDroneServer(drone or make_drone(), clock, ANY_PORTS, **options) as server:
        task = asyncio.create_task(server.run())
        client = RawClient(server, clock)
        await client.open()
        try:
            yield client
        finally:
            client.close()
            await ended(task)
