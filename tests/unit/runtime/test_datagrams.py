"""UDP sockets and other lines, read in batches while much comes in."""

from __future__ import annotations

import asyncio
import itertools
import os
import socket
from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import Any

import pytest

from flightd.runtime.batched_reader import PacedReader
from flightd.runtime.datagrams import (
    Datagrams,
    OpenDatagrams,
    PacedDatagrams,
    is_stalled,
    open_datagrams,
    open_paced_datagrams,
)
from flightd.runtime.event_loops import VirtualLoop
from tests.rigs.event_loops import real, virtual


def opener_here() -> OpenDatagrams:
    """What a flight on the running loop opens its sockets with."""
    jumps = isinstance(asyncio.get_running_loop(), VirtualLoop)
    return open_datagrams if jumps else open_paced_datagrams


class Ear:
    """What came, and in how many readings."""

    def __init__(self) -> None:
        self.heard: list[bytes] = []
        self.errors: list[OSError] = []

    async def open(self, **place: Any) -> Datagrams:
        return await opener_here()(lambda data, _: self.heard.append(data), self.errors.append, **place)


@pytest.mark.parametrize("run", [real, virtual])
def test_a_flood_arrives_whole_and_in_order(run: Callable[[Coroutine[Any, Any, None]], None]) -> None:
    async def test() -> None:
        ear, mouth = Ear(), Ear()
        listening = await ear.open(local_addr=("127.0.0.1", 0))
        calling = await mouth.open(remote_addr=listening.socket.getsockname())
        sent = [str(number).encode() for number in range(600)]
        for at, data in enumerate(sent):
            assert calling.send(data)
            if at % 3 == 0:
                await asyncio.sleep(0.001)
        await asyncio.sleep(0.05)
        assert ear.heard == sent
        assert listening.send(b"answer", calling.socket.getsockname())
        await asyncio.sleep(0.05)
        assert mouth.heard == [b"answer"]
        for endpoint in (calling, listening):
            endpoint.close()
            endpoint.close()
            assert not endpoint.send(b"too late")
        await asyncio.sleep(0.01)

    run(test())


def test_a_port_that_refuses_is_told_and_outlived() -> None:
    async def test() -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as peer:
            peer.bind(("127.0.0.1", 0))
            place = peer.getsockname()
        ear = Ear()
        calling = await ear.open(remote_addr=place)
        assert calling.send(b"anybody")
        await asyncio.sleep(0.02)
        assert [type(error) for error in ear.errors] == [ConnectionRefusedError]
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as peer:
            peer.bind(place)
            assert calling.send(b"hello")
            data, address = peer.recvfrom(100)
            peer.sendto(b"and you", address)
            await asyncio.sleep(0.02)
        assert (data, ear.heard) == (b"hello", [b"and you"])
        calling.close()

    real(test())


def test_a_socket_closed_by_what_it_brought_is_left_alone() -> None:
    async def test() -> None:
        ear = Ear()
        listening: list[Datagrams] = []

        def take(data: bytes, _address: Any) -> None:
            ear.heard.append(data)
            listening[0].close()

        listening.append(await open_paced_datagrams(take, ear.errors.append, local_addr=("127.0.0.1", 0)))
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as caller:
            for data in (b"first", b"second"):
                caller.sendto(data, listening[0].socket.getsockname())
        await asyncio.sleep(0.05)
        assert ear.heard == [b"first"]
        assert ear.errors == []

    real(test())


def test_a_busy_line_is_read_in_batches_and_a_quiet_one_at_once() -> None:
    """Batches by virtual time, in which a pipe is as good as any line."""

    async def test() -> None:
        loop = asyncio.get_running_loop()
        out, into = os.pipe()
        os.set_blocking(out, False)
        readings: list[tuple[float, int]] = []

        def read() -> int:
            try:
                count = len(os.read(out, 100))
            except BlockingIOError:
                count = 0
            readings.append((loop.time(), count))
            return count

        reader = PacedReader(out, read)
        began_s = loop.time()
        for _ in range(10):  # quiet
            os.write(into, b"x")
            await asyncio.sleep(0.02)
        assert [count for _, count in readings] == [1] * 10
        assert [round(at_s - began_s, 3) for at_s, _ in readings] == [round(0.02 * i, 3) for i in range(10)]
        readings.clear()
        for _ in range(500):  # a thing each millisecond
            os.write(into, b"x")
            await asyncio.sleep(0.001)
        await asyncio.sleep(0.02)
        assert sum(count for _, count in readings) == 500
        assert len(readings) < 60
        gaps_s = [b - a for (a, _), (b, _) in itertools.pairwise(readings)]
        assert max(gaps_s) < 0.0101
        readings.clear()
        os.write(into, b"x")  # quiet again
        await asyncio.sleep(0)
        await asyncio.sleep(0)
        assert [count for _, count in readings] == [1]
        reader.close()
        os.write(into, b"x")
        await asyncio.sleep(0.05)
        assert len(readings) == 1
        os.close(out)
        os.close(into)

    virtual(test())


def test_a_busy_line_is_read_on_after_a_message_whose_taking_failed() -> None:
    async def test() -> None:
        told: list[Any] = []
        asyncio.get_running_loop().set_exception_handler(lambda _, context: told.append(context["exception"]))
        heard: list[bytes] = []

        def take(data: bytes, _address: Any) -> None:
            heard.append(data)
            if len(heard) in {1, 7, 8}:
                raise ValueError

        here, there = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
        line = PacedDatagrams(here, take, lambda _error: None)
        sent = [str(number).encode() for number in range(40)]
        for data in sent:
            there.send(data)
            await asyncio.sleep(0.001)
        await asyncio.sleep(0.05)
        assert heard == sent
        assert [type(error) for error in told] == [ValueError] * 3
        line.close()
        there.close()

    virtual(test())


def test_what_does_not_block_is_never_waited_for() -> None:
    async def test() -> None:
        here, there = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
        there.setblocking(False)
        line = PacedDatagrams(here, lambda _data, _address: None, lambda _error: None)
        taken = [line.send(bytes(1000)) for _ in range(5000)]
        assert taken[0]
        assert not taken[-1]
        line.close()
        there.close()

    real(test())


def test_an_endpoint_of_asyncios_that_holds_a_datagram_back_is_stalled(tmp_path: Path) -> None:
    async def test() -> None:
        loop = asyncio.get_running_loop()
        place = str(tmp_path / "peer")
        there = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        there.bind(place)
        endpoint: Any = loop.create_datagram_endpoint(
            asyncio.DatagramProtocol, remote_addr=place, family=socket.AF_UNIX
        )
        transport, _ = await endpoint
        assert not is_stalled(transport)
        for _ in range(5000):
            if is_stalled(transport):
                break
            transport.sendto(bytes(1000))
        assert is_stalled(transport)
        while is_stalled(transport):
            there.recv(2000)
            await asyncio.sleep(0)
        transport.abort()
        there.close()

    real(test())
