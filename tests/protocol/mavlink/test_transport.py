"""Addresses, and UDP, TCP and serial lines that come and go."""

from __future__ import annotations

import asyncio
import errno
import fcntl
import os
import socket
import termios
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.adapters.vehicle.mavlink.ardupilot import ArduPilotVehicle
from flightd.adapters.vehicle.mavlink.link.codec import Codec, FrameParser
from flightd.adapters.vehicle.mavlink.link.endpoint import Endpoint, EndpointKind, parse_endpoint
from flightd.adapters.vehicle.mavlink.link.transport import SerialTransport, TcpTransport, UdpTransport
from flightd.core.errors import InputError, UnavailableError
from flightd.core.types import Demand
from flightd.runtime.clock import LoopClock
from flightd.runtime.datagrams import (
    Datagrams,
    OpenDatagrams,
    PacedDatagrams,
    open_datagrams,
    open_paced_datagrams,
)
from flightd.runtime.free_ports import free_port
from flightd.sim.autopilot.autopilot import PeerConfig
from flightd.sim.autopilot.copter import ArduCopterPeer
from flightd.sim.plant.airframe import Airframe
from tests.rigs.event_loops import real, virtual
from tests.rigs.vehicles import Rig

_TIOCGEXCL = 0x80045440
"""Whether a terminal refuses to be opened once more; `termios` leaves it out."""


class StandingSocket:
    """In the place of a socket: it takes nothing until it `runs`."""

    def __init__(self, real: socket.socket) -> None:
        self._socket = real
        self.runs = False
        self.sent: list[bytes] = []

    def send(self, data: bytes) -> None:
        if not self.runs:
            raise BlockingIOError
        self.sent.append(data)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._socket, name)


@pytest.mark.parametrize(
    ("url", "endpoint"),
    [
        ("udpin://0.0.0.0:14550", Endpoint(EndpointKind.UDP_IN, "0.0.0.0", 14550)),
        ("udpout://127.0.0.1:14551", Endpoint(EndpointKind.UDP_OUT, "127.0.0.1", 14551)),
        ("tcp://localhost:5760", Endpoint(EndpointKind.TCP, "localhost", 5760)),
        ("tcp:127.0.0.1:5760", Endpoint(EndpointKind.TCP, "127.0.0.1", 5760)),
        ("udpin://[::1]:14550", Endpoint(EndpointKind.UDP_IN, "::1", 14550)),
        ("serial:///dev/ttyAMA0:921600", Endpoint(EndpointKind.SERIAL, device="/dev/ttyAMA0", baud=921600)),
    ],
)
def test_addresses_are_read(url: str, endpoint: Endpoint) -> None:
    assert parse_endpoint(url) == endpoint
    assert parse_endpoint(str(endpoint)) == endpoint


@pytest.mark.parametrize(
    "url",
    [
        "",
        "14550",
        "udp://127.0.0.1:14550",
        "udpin://0.0.0.0",
        "tcp://h:70000",
        "tcp://h:0",
        "serial://COM1:9600",
    ],
)
def test_bad_addresses_name_what_is_understood(url: str) -> None:
    with pytest.raises(InputError, match=r"vehicle\.url") as caught:
        parse_endpoint(url)
    assert "\n" not in str(caught.value)


def test_a_baud_rate_that_does_not_exist_is_bad_input() -> None:
    async def test() -> None:
        with pytest.raises(InputError, match="baud"):
            ArduPilotVehicle("serial:///dev/ttyAMA0:12345", LoopClock())

    virtual(test())


def test_a_port_in_use_is_told_in_one_line() -> None:
    async def test() -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
            taken.bind(("127.0.0.1", 0))
            vehicle = ArduPilotVehicle(f"udpin://127.0.0.1:{taken.getsockname()[1]}", LoopClock())
            with pytest.raises(UnavailableError, match="the port is in use") as caught:
                await vehicle.run()
            assert "\n" not in str(caught.value)

    virtual(test())


def test_what_is_no_serial_device_is_told() -> None:
    async def test() -> None:
        with pytest.raises(UnavailableError, match="not a serial device"):
            await ArduPilotVehicle("serial:///dev/null:57600", LoopClock()).run()

    virtual(test())


def test_a_listening_vehicle_answers_the_autopilot_that_calls() -> None:
    async def test() -> None:
        clock, port = LoopClock(), free_port()
        vehicle = ArduPilotVehicle(f"udpin://127.0.0.1:{port}", clock)
        config = PeerConfig(ready_s=0.5, remotes=(("127.0.0.1", port),))
        peer = ArduCopterPeer(clock, Airframe(), config)
        tasks = [asyncio.create_task(vehicle.run()), asyncio.create_task(peer.run())]
        rig = Rig(vehicle, peer, lambda: None, lambda apart: None)
        await rig.take_off(1.0)
        assert rig.known().in_control
        assert peer.truth().height_m > 0.9
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    virtual(test())


def test_while_the_autopilot_speaks_no_other_address_can_replace_it() -> None:
    async def test() -> None:
        clock, port = LoopClock(), free_port()
        vehicle = ArduPilotVehicle(f"udpin://127.0.0.1:{port}", clock)
        config = PeerConfig(ready_s=0.5, remotes=(("127.0.0.1", port),))
        peer, thief = (ArduCopterPeer(clock, Airframe(), config) for _ in range(2))
        tasks = [asyncio.create_task(part.run()) for part in (vehicle, peer)]
        rig = Rig(vehicle, peer, lambda: None, lambda apart: None)
        await rig.take_off(1.0)
        tasks.append(asyncio.create_task(thief.run()))
        thief.mode = type(thief.mode).ALT_HOLD
        assert all(await rig.stream(5.0))
        tasks[1].cancel()  # now the first is gone and the other may speak
        await asyncio.sleep(6.0)
        assert rig.known().mode == "ALT_HOLD"
        assert not rig.known().in_control
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    virtual(test())


class StreamAutopilot(asyncio.Protocol):
    """Beats on every TCP connection that comes and acknowledges every command."""

    open: list[StreamAutopilot] = []  # noqa: RUF012 - one list for all connections of a test
    frames: list[Any] = []  # noqa: RUF012

    def connection_made(self, transport: Any) -> None:
        self.transport = transport
        self.codec = Codec(1, 1)
        self.parser = FrameParser(Codec(1, 1))
        StreamAutopilot.open.append(self)

    def data_received(self, data: bytes) -> None:
        for message in self.parser.stream(data):
            StreamAutopilot.frames.append(message)
            if message.get_type() == "COMMAND_LONG":
                self.say(dialect.MAVLink_command_ack_message(message.command, 0, 0, 0, 1, 191))

    def say(self, message: Any) -> None:
        self.transport.write(self.codec.pack(message))

    def beat(self) -> None:
        self.say(dialect.MAVLink_heartbeat_message(2, 3, 1, 0, 4, 3))
        self.say(dialect.MAVLink_attitude_message(0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0))


@asynccontextmanager
async def tcp_vehicle(port: int) -> AsyncIterator[ArduPilotVehicle]:
    StreamAutopilot.open, StreamAutopilot.frames = [], []
    vehicle = ArduPilotVehicle(f"tcp:127.0.0.1:{port}", LoopClock())
    task = asyncio.create_task(vehicle.run())
    try:
        yield vehicle
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
        for connection in StreamAutopilot.open:
            connection.transport.abort()
        await asyncio.sleep(0.1)


async def beating(duration_s: float) -> None:
    for _ in range(round(duration_s / 0.05)):
        for connection in StreamAutopilot.open:
            if not connection.transport.is_closing():
                connection.beat()
        await asyncio.sleep(0.05)


def test_tcp_waits_for_the_other_side_and_comes_back_after_a_loss() -> None:
    async def test() -> None:
        port = free_port(socket.SOCK_STREAM)
        async with tcp_vehicle(port) as vehicle:
            await asyncio.sleep(20.0)
            assert vehicle.state() is None
            loop = asyncio.get_running_loop()
            server = await loop.create_server(StreamAutopilot, "127.0.0.1", port)
            await beating(7.0)
            assert vehicle.state() is not None
            assert {m.get_type() for m in StreamAutopilot.frames} >= {"HEARTBEAT", "COMMAND_LONG", "TIMESYNC"}
            StreamAutopilot.open.pop().transport.abort()
            await beating(4.0)
            assert len(StreamAutopilot.open) == 1
            state = vehicle.state()
            assert state is not None
            assert LoopClock().now_ns() - state.heartbeat_ns < 0.2e9
            server.close()
            await server.wait_closed()

    virtual(test())


def test_a_stalled_tcp_line_drops_what_is_new_instead_of_piling_it_up() -> None:
    async def test() -> None:
        port = free_port(socket.SOCK_STREAM)
        async with tcp_vehicle(port) as vehicle:
            loop = asyncio.get_running_loop()
            server = await loop.create_server(StreamAutopilot, "127.0.0.1", port)
            await beating(2.0)
            StreamAutopilot.open[0].transport.pause_reading()
            beat = dialect.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3)
            accepted = sum(vehicle.link.send(beat) for _ in range(400_000))  # 8 MB
            assert accepted < 400_000
            assert vehicle.dropped >= 400_000 - accepted
            server.close()
            await server.wait_closed()

    virtual(test())


class NotedOpener:
    """Keeps each socket that `opener` opens, with what is told of its errors."""

    def __init__(self, opener: OpenDatagrams) -> None:
        self._opener = opener
        self.opened: list[tuple[Datagrams, Callable[[OSError], None]]] = []

    async def __call__(
        self, received: Callable[[bytes, Any], None], failed: Callable[[OSError], None], **place: Any
    ) -> Datagrams:
        endpoint = await self._opener(received, failed, **place)
        self.opened.append((endpoint, failed))
        return endpoint


def test_a_stalled_network_drops_datagrams_instead_of_piling_them_up() -> None:
    async def test() -> None:
        opener = NotedOpener(open_paced_datagrams)
        line = UdpTransport(parse_endpoint("udpout://127.0.0.1:9"), opener)
        await line.open()
        ((endpoint, _),) = opener.opened
        assert isinstance(endpoint, PacedDatagrams)
        standing: Any = StandingSocket(endpoint.socket)
        endpoint.socket = standing
        assert [line.send(b"old") for _ in range(20)] == [False] * 20
        await asyncio.sleep(0.02)
        standing.runs = True
        await asyncio.sleep(0.02)
        assert line.send(b"newest")
        assert standing.sent == [b"newest"]
        line.close()

    real(test())


def test_a_called_socket_of_another_network_is_opened_anew() -> None:
    async def test() -> None:
        opener = NotedOpener(open_datagrams)
        for url, number, opened_anew in (
            ("udpout://127.0.0.1:9", errno.EINVAL, True),
            ("udpout://127.0.0.1:9", errno.ENETUNREACH, True),
            ("udpout://127.0.0.1:9", errno.ECONNREFUSED, False),
            ("udpin://127.0.0.1:0", errno.ENETUNREACH, False),
        ):
            kind, _, place = url.partition("://")
            endpoint = Endpoint(EndpointKind(kind), "127.0.0.1", int(place.rpartition(":")[2]))
            line = UdpTransport(endpoint, opener)
            losses: list[int] = []
            line.lost = lambda losses=losses: losses.append(1)  # type: ignore[misc]
            await line.open()
            _, failed = opener.opened[-1]
            failed(OSError(number, "no way out"))
            assert bool(losses) is opened_anew, (url, number)
            line.close()

    virtual(test())


def test_a_tcp_port_that_never_answers_is_called_again_soon() -> None:
    async def test() -> None:
        with socket.socket() as full:
            full.bind(("127.0.0.1", 0))
            full.listen(0)
            place = full.getsockname()
            waiting = []
            for _ in range(4):  # more than it queues: what comes then is not even refused
                caller = socket.socket()
                caller.setblocking(False)
                caller.connect_ex(place)
                waiting.append(caller)
            line = TcpTransport(Endpoint(EndpointKind.TCP, *place))
            began_s = asyncio.get_running_loop().time()
            with pytest.raises(OSError, match="timed out"):
                await line.open()
            assert asyncio.get_running_loop().time() - began_s < 5.0
            for caller in waiting:
                caller.close()

    virtual(test())


def test_a_serial_line_is_opened_raw_heard_and_found_again_after_a_loss(tmp_path: Path) -> None:
    async def test() -> None:
        link = tmp_path / "ttyTEST"
        vehicle = ArduPilotVehicle(f"serial://{link}:57600", LoopClock())
        task = asyncio.create_task(vehicle.run())
        await asyncio.sleep(3.0)  # no such device yet
        for _ in range(2):
            master, slave = os.openpty()
            link.symlink_to(os.ttyname(slave))
            await asyncio.sleep(6.0)
            codec, heard = Codec(1, 1), b""
            os.set_blocking(master, False)
            for _ in range(40):
                os.write(master, codec.pack(dialect.MAVLink_heartbeat_message(2, 3, 1, 0, 4, 3)))
                os.write(
                    master, codec.pack(dialect.MAVLink_attitude_message(0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0))
                )
                await asyncio.sleep(0.05)
                try:
                    heard += os.read(master, 4096)
                except BlockingIOError:
                    continue
            state = vehicle.state()
            assert state is not None
            assert LoopClock().now_ns() - state.heartbeat_ns < 0.2e9
            kinds = {m.get_type() for m in FrameParser(Codec(1)).stream(heard)}
            assert {"HEARTBEAT", "COMMAND_LONG"} <= kinds
            link.unlink()
            os.close(slave)
            os.close(master)  # unplugged
            await asyncio.sleep(1.0)
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)

    virtual(test())


@pytest.mark.parametrize(
    ("number", "ends"),
    [(errno.EIO, False), (errno.ENODEV, False), (errno.ENOTTY, True), (errno.EINVAL, True)],
)
def test_a_serial_line_that_goes_away_while_it_is_opened_is_tried_again(
    monkeypatch: pytest.MonkeyPatch, number: int, ends: bool
) -> None:
    def gone(*_: Any) -> None:
        raise termios.error(number, os.strerror(number))

    async def test() -> None:
        master, slave = os.openpty()
        line = SerialTransport(Endpoint(EndpointKind.SERIAL, device=os.ttyname(slave), baud=57600))
        monkeypatch.setattr(termios, "tcsetattr", gone)
        with pytest.raises(UnavailableError if ends else OSError):
            await line.open()
        monkeypatch.undo()
        await line.open()
        line.close()
        os.close(slave)
        os.close(master)

    virtual(test())


def is_exclusive(fd: int) -> bool:
    return bool(fcntl.ioctl(fd, _TIOCGEXCL, bytes(4)) != bytes(4))


def test_a_serial_line_that_another_program_has_is_waited_for_and_then_had_alone() -> None:
    async def test() -> None:
        master, slave = os.openpty()
        name = os.ttyname(slave)
        other = os.open(name, os.O_RDWR | os.O_NOCTTY)
        fcntl.flock(other, fcntl.LOCK_EX)
        line = SerialTransport(Endpoint(EndpointKind.SERIAL, device=name, baud=57600))
        with pytest.raises(OSError, match="another program"):
            await line.open()
        os.close(other)
        await line.open()
        late = os.open(name, os.O_RDWR | os.O_NOCTTY)
        with pytest.raises(BlockingIOError):
            fcntl.flock(late, fcntl.LOCK_EX | fcntl.LOCK_NB)
        assert is_exclusive(late)
        line.close()
        fcntl.flock(late, fcntl.LOCK_EX | fcntl.LOCK_NB)
        assert not is_exclusive(late), "who had it open all the time must not lock us out"
        for fd in (late, slave, master):
            os.close(fd)

    virtual(test())


def test_a_demand_before_the_link_is_worked_on_when_it_comes() -> None:
    async def test() -> None:
        clock, port = LoopClock(), free_port()
        vehicle = ArduPilotVehicle(f"udpin://127.0.0.1:{port}", clock)
        vehicle.demand(Demand.FLY)
        running = asyncio.create_task(vehicle.run())
        await asyncio.sleep(5.0)
        peer = ArduCopterPeer(clock, Airframe(), PeerConfig(ready_s=0.5, remotes=(("127.0.0.1", port),)))
        serving = asyncio.create_task(peer.run())
        rig = Rig(vehicle, peer, lambda: None, lambda apart: None)
        await rig.until(lambda: vehicle.state() is not None and rig.known().armed)
        for task in (running, serving):
            task.cancel()
        await asyncio.gather(running, serving, return_exceptions=True)

    virtual(test())
