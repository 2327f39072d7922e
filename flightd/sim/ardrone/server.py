"""The emulated drone on its four ports, on the time of the running event loop."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable, Coroutine
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Self, TypeAlias

from flightd.core.types import Image
from flightd.ports import Clock
from flightd.sim.ardrone.drone import Drone
from flightd.sim.ardrone.video import Encoder, Packer, VideoChannel, is_idr
from flightd.sim.autopilot.radio import PERFECT, Radio, RadioParams
from flightd.sim.plant.airframe import Airframe
from flightd.sim.plant.kinematics import Kinematics
from flightd.sim.plant.truth_history import TruthHistory

STEP_NS = 5_000_000
_Serve: TypeAlias = Callable[[asyncio.StreamReader, asyncio.StreamWriter], Coroutine[Any, Any, None]]

_VIDEO_BACKLOG_BYTES = 200_000
_TRUTH_SAMPLES = 1000
_CATCH_UP_NS = 2_000_000_000


@dataclass(frozen=True, slots=True)
class DronePorts:
    """Where the drone listens; 0 takes any free port."""

    host: str = "127.0.0.1"
    at: int = 5556
    navdata: int = 5554
    video: int = 5555
    control: int = 5559


class ArDroneServer:
    """Serves one `Drone`.  `run` listens and lets its time pass until cancelled; `open` before it binds the
    sockets early (`ports` tells which), and `close`, or leaving `async with`, frees them.

    `radio` False loses everything in both directions, as out of range;
    `air` is what the radio does to datagrams otherwise, each way; `congested` True loses pictures.
    Pictures come from outside: `show` takes one of either camera and streams that which `channel` names.
    """

    def __init__(
        self,
        drone: Drone,
        clock: Clock,
        ports: DronePorts | None = None,
        *,
        video_header_bytes: int = 64,
        air: RadioParams = PERFECT,
        seed: int = 0,
    ) -> None:
        self.drone = drone
        self.ports = ports or DronePorts()
        self.radio = True
        self.congested = False
        self._up, self._down = Radio(air, seed), Radio(air, seed + 1)
        self._clock = clock
        self._now_ns = clock.now_ns()
        self._truth = TruthHistory(_TRUTH_SAMPLES)
        self._truth.add(self.airframe.kinematics(self._now_ns))
        self._video_header_bytes = video_header_bytes
        self._at: asyncio.DatagramTransport | None = None
        self._navdata: asyncio.DatagramTransport | None = None
        self._client: Any = None
        self._servers: list[asyncio.Server] = []
        self._watchers: dict[asyncio.StreamWriter, _Stream] = {}
        self._readers: list[asyncio.StreamWriter] = []
        self._pending_configuration: list[bytes] = []
        self._handlers: set[asyncio.Task[None]] = set()
        drone.send_configuration = self._send_configuration

    @property
    def airframe(self) -> Airframe:
        return self.drone.airframe

    @property
    def channel(self) -> VideoChannel:
        """The camera whose pictures the client asked for."""
        bottom = int(self.drone.configuration.number("video:video_channel")) in (1, 3)
        return VideoChannel.BOTTOM if bottom else VideoChannel.FRONT

    @property
    def watched(self) -> bool:
        """Whether anyone is connected to the video."""
        return bool(self._watchers)

    async def __aenter__(self) -> Self:
        await self.open()
        return self

    async def __aexit__(self, *_error: object) -> None:
        await self.close()

    async def open(self) -> tuple[str, int]:
        """Bind all four ports; the address of the commands.  OSError when one is taken."""
        if self._at is not None:
            return self.ports.host, self.ports.at
        loop = asyncio.get_running_loop()
        host = self.ports.host
        self._at, _ = await loop.create_datagram_endpoint(
            lambda: _PortReceiver(self._command), local_addr=(host, self.ports.at)
        )
        self._navdata, _ = await loop.create_datagram_endpoint(
            lambda: _PortReceiver(self._wake), local_addr=(host, self.ports.navdata)
        )
        video = await asyncio.start_server(self._handled(self._watch_video), host, self.ports.video)
        control = await asyncio.start_server(
            self._handled(self._read_configuration), host, self.ports.control
        )
        self._servers = [video, control]
        self.ports = replace(
            self.ports,
            at=self._at.get_extra_info("sockname")[1],
            navdata=self._navdata.get_extra_info("sockname")[1],
            video=video.sockets[0].getsockname()[1],
            control=control.sockets[0].getsockname()[1],
        )
        return host, self.ports.at

    async def close(self) -> None:
        """Disconnect everyone and free the ports."""
        for endpoint in (self._at, self._navdata):
            if endpoint is not None:
                endpoint.close()
        self._at = self._navdata = None
        for writer in [*self._watchers, *self._readers]:
            writer.transport.abort()
        servers, self._servers = self._servers, []
        for server in servers:
            server.close()
            await server.wait_closed()
        await asyncio.gather(*self._handlers, return_exceptions=True)

    async def run(self) -> None:
        """Step the drone every 5 ms of the loop's time and send its navdata, for ever."""
        await self.open()
        try:
            while True:
                self.advance(self._clock.now_ns())
                await asyncio.sleep((self._now_ns + STEP_NS - self._clock.now_ns()) / 1e9)
        finally:
            await self.close()

    def advance(self, now_ns: int) -> None:
        """Let the drone's time pass up to `now_ns` in whole steps; what a stopped process missed by more
        than 2 s is never simulated."""
        if now_ns - self._now_ns > _CATCH_UP_NS:
            self._now_ns = now_ns - STEP_NS
        while self._now_ns + STEP_NS <= now_ns:
            self._now_ns += STEP_NS
            self.drone.step(self._now_ns, STEP_NS / 1e9)
            self._truth.add(self.airframe.kinematics(self._now_ns))
            packet = self.drone.navdata(self._now_ns)
            if packet is not None and self._client is not None and self._navdata is not None and self.radio:
                self._down.carry(partial(self.send_navdata, packet))

    @property
    def armed(self) -> bool:
        """Its motors turn in the air only, or on the way there and back."""
        return self.drone.airborne

    def truth(self) -> Kinematics:
        """The true motion now."""
        return self.truth_at(self._clock.now_ns())

    def truth_at(self, stamp_ns: int) -> Kinematics:
        """The true motion at a moment of the last seconds, of the loop's clock."""
        self.advance(min(stamp_ns, self._clock.now_ns()))
        return self._truth.at(stamp_ns)

    def reboot(self) -> None:
        """Power the drone off and on: everyone is disconnected and forgotten."""
        self.drone.reboot()
        self._client = None
        for writer in [*self._watchers, *self._readers]:
            writer.transport.abort()

    def show(self, bgr: Image, stamp_ns: int | None = None, camera: VideoChannel | None = None) -> None:
        """Stream one picture of `camera` (the one in use when left out) to whoever watches; (H, W, 3) of any
        size, exposed at `stamp_ns` (now when left out).  Pictures of the other camera are dropped."""
        if not self.radio or (camera is not None and camera is not self.channel):
            return
        timestamp_ms = (self._clock.now_ns() if stamp_ns is None else stamp_ns) // 1_000_000
        for writer, stream in list(self._watchers.items()):
            full = self.congested or writer.transport.get_write_buffer_size() > _VIDEO_BACKLOG_BYTES
            data = stream.frame(bgr, timestamp_ms, room=not full)
            if data and not writer.is_closing():
                writer.write(data)

    def send_video(self, data: bytes) -> None:
        """Put these bytes, pictures or not, into the streams of all who watch."""
        for writer in self._watchers:
            writer.write(data)

    def send_navdata(self, packet: bytes) -> None:
        """Send one packet of telemetry, sound or not, to the client."""
        if self._client is not None and self._navdata is not None:
            self._navdata.sendto(packet, self._client)

    def _command(self, datagram: bytes, _sender: Any) -> None:
        if self.radio:
            self._up.carry(lambda: self.drone.command(datagram, self._clock.now_ns()))

    def _wake(self, _datagram: bytes, sender: Any) -> None:
        if self.radio:
            self._client = sender
            self._up.carry(self.drone.wake)

    def _handled(self, serve: _Serve) -> Callable[[asyncio.StreamReader, asyncio.StreamWriter], None]:
        """Serve each connection in a task that this server awaits when it closes."""

        def connected(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            task = asyncio.get_running_loop().create_task(serve(reader, writer), name="ardrone connection")
            self._handlers.add(task)
            task.add_done_callback(self._handlers.discard)

        return connected

    async def _watch_video(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._watchers[writer] = _Stream(self._video_header_bytes)
        with contextlib.suppress(ConnectionError):
            while await reader.read(4096):
                pass
        del self._watchers[writer]
        writer.close()

    async def _read_configuration(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._readers.append(writer)
        if self._pending_configuration:
            self._send_configuration(self._pending_configuration.pop())
        with contextlib.suppress(ConnectionError):
            while await reader.read(4096):
                pass
        self._readers.remove(writer)
        writer.close()

    def _send_configuration(self, text: bytes) -> None:
        """To all who read the control port, or to the next who connects (its SYN may still be on the way)."""
        self._pending_configuration = [] if self._readers else [text]
        for writer in self._readers:
            if not writer.is_closing() and self.radio:
                writer.write(text)


class _Stream:
    """One connection's pictures."""

    def __init__(self, header_bytes: int) -> None:
        self._encoder = Encoder()
        self._packer = Packer(header_bytes)
        self._begun = False

    def frame(self, bgr: Image, timestamp_ms: int, *, room: bool) -> bytes:
        """The next frame's bytes, or none: the encoder's first IDR was before this client's time."""
        units = self._encoder.encode(bgr)
        if not self._begun and is_idr(units):
            self._begun = True
            return b""
        if not room:
            self._packer.skip()
            return b""
        return self._packer.pack(units, timestamp_ms)


class _PortReceiver(asyncio.DatagramProtocol):
    def __init__(self, receive: Any) -> None:
        self._receive = receive

    def datagram_received(self, data: bytes, addr: Any) -> None:
        self._receive(data, addr)
