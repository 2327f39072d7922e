"""Virtual and scaled time: jumps, holds, and datagrams that arrive before time moves on."""

from __future__ import annotations

import asyncio
import time
from typing import Any

from flightd.runtime.clock import LoopClock
from tests.rigs.event_loops import real, virtual
from tests.rigs.held_time import held


class Echo(asyncio.DatagramProtocol):
    def connection_made(self, transport: Any) -> None:
        self.transport = transport

    def datagram_received(self, data: bytes, addr: Any) -> None:
        self.transport.sendto(data, addr)


class Inbox(asyncio.DatagramProtocol):
    def __init__(self) -> None:
        self.received: list[tuple[int, bytes]] = []

    def connection_made(self, transport: Any) -> None:
        self.transport = transport

    def datagram_received(self, data: bytes, addr: Any) -> None:
        self.received.append((LoopClock().now_ns(), data))


def test_an_hour_of_virtual_time_passes_at_once_and_exactly() -> None:
    async def main() -> int:
        clock = LoopClock()
        start = clock.now_ns()
        for _ in range(36_000):
            await asyncio.sleep(0.1)
        return clock.now_ns() - start

    assert abs(virtual(main()) - 3600 * 10**9) < 1000


def test_datagrams_are_answered_at_the_virtual_instant_they_were_sent() -> None:
    async def main() -> list[tuple[int, bytes]]:
        loop = asyncio.get_running_loop()
        server, _ = await loop.create_datagram_endpoint(Echo, local_addr=("127.0.0.1", 0))
        client, inbox = await loop.create_datagram_endpoint(
            Inbox, remote_addr=server.get_extra_info("sockname")
        )
        for i in range(500):
            client.sendto(i.to_bytes(2, "big"))
            await asyncio.sleep(0.001)
        client.close()
        server.close()
        await asyncio.sleep(0)
        return inbox.received

    first, second = virtual(main()), virtual(main())
    assert first == second
    assert [data for _, data in first] == [i.to_bytes(2, "big") for i in range(500)]
    assert all(
        stamp == round((1000.0 + 0.001 * i) * 1e9) or abs(stamp - 1000e9 - i * 1e6) < 10
        for i, (stamp, _) in enumerate(first)
    )


def test_held_time_waits_for_work_outside_the_loop() -> None:
    async def main() -> int:
        loop, clock = asyncio.get_running_loop(), LoopClock()
        ticker = asyncio.create_task(asyncio.sleep(0.001))
        start = clock.now_ns()
        with held():
            await loop.run_in_executor(None, sum, range(3_000_000))
        waited = clock.now_ns() - start
        await ticker
        return waited

    assert virtual(main()) == 0


def test_scaled_time_runs_at_its_factor() -> None:
    async def main() -> float:
        loop = asyncio.get_running_loop()
        virtual, real = loop.time(), time.monotonic()
        await asyncio.sleep(1.0)
        return (loop.time() - virtual) / (time.monotonic() - real)

    assert abs(real(main(), speed=20.0) - 20.0) < 0.5
