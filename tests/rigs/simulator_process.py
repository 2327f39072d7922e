"""An autopilot simulator of one's own, as ArduCopter's SITL is: two MAVLink ports over TCP, its own place on
the globe, its own heading, its own airframe.  Run as a program; it prints its two ports and serves until its
input ends."""

from __future__ import annotations

import argparse
import asyncio
import math
import sys
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.runtime.clock import LoopClock
from flightd.runtime.event_loops import ScaledLoop
from flightd.sim.autopilot.autopilot import AutopilotPeer, PeerConfig
from flightd.sim.autopilot.copter import ArduCopterPeer
from flightd.sim.autopilot.link import Address, Message
from flightd.sim.autopilot.px4 import Px4Peer
from flightd.sim.plant.airframe import Airframe
from flightd.sim.plant.kinematics import Kinematics

LAT, LON, ALT_M = -35.363262, 149.165237, 584.0
YAW_RAD = math.radians(203.0)
_METRES_PER_DEGREE = 6_378_100.0 * math.pi / 180.0
_TRUTH_HZ = 100.0


class _Bridge(asyncio.Protocol, asyncio.DatagramProtocol):
    """One TCP client of the vehicle port, joined to the autopilot's UDP socket frame by frame."""

    def __init__(self, autopilot: Address) -> None:
        self._autopilot = autopilot
        self._parser = dialect.MAVLink(None)
        self._parser.robust_parsing = True
        self._stream: Any = None
        self._datagrams: Any = None
        self._waiting: list[bytes] = []
        self._opening: asyncio.Task[Any] | None = None

    def connection_made(self, transport: Any) -> None:
        if self._stream is None:
            self._stream = transport
            loop = asyncio.get_running_loop()
            opening = loop.create_datagram_endpoint(lambda: self, remote_addr=self._autopilot)
            self._opening = asyncio.ensure_future(opening)
        else:
            self._datagrams = transport
            for frame in self._waiting:
                transport.sendto(frame)

    def data_received(self, data: bytes) -> None:
        for message in self._parser.parse_buffer(data) or ():
            if message.get_type() == "BAD_DATA":
                continue
            if self._datagrams is None:
                self._waiting.append(bytes(message.get_msgbuf()))
            else:
                self._datagrams.sendto(bytes(message.get_msgbuf()))

    def datagram_received(self, data: bytes, addr: Any) -> None:
        if not self._stream.is_closing():
            self._stream.write(data)

    def error_received(self, exc: Exception) -> None:
        """The autopilot ends."""

    def connection_lost(self, exc: Exception | None) -> None:
        if self._datagrams is not None:
            self._datagrams.close()


class _TruthPort(asyncio.Protocol):
    """One TCP client of the second port: what it asks for by SET_MESSAGE_INTERVAL is sent, no more."""

    def __init__(self, peer: AutopilotPeer, tells: frozenset[int]) -> None:
        self._peer = peer
        self._tells = tells
        self._asked: set[int] = set()
        self._mav = dialect.MAVLink(None, srcSystem=1, srcComponent=1)
        self._mav.robust_parsing = True
        self._transport: Any = None
        self._task: asyncio.Task[None] | None = None

    def connection_made(self, transport: Any) -> None:
        self._transport = transport
        self._task = asyncio.ensure_future(self._tell())

    def connection_lost(self, _exc: Exception | None) -> None:
        assert self._task is not None
        self._task.cancel()

    def data_received(self, data: bytes) -> None:
        for message in self._mav.parse_buffer(data) or ():
            wanted = message.get_type() == "COMMAND_LONG" and message.command == 511
            if not wanted or (message.target_system, message.target_component) != (1, 1):
                continue
            message_id = int(message.param1)
            if message_id in self._tells:
                self._asked.add(message_id)
            self._send(dialect.MAVLink_command_ack_message(511, 0 if message_id in self._tells else 2))

    def _send(self, message: Message) -> None:
        self._transport.write(message.pack(self._mav))
        self._mav.seq = (self._mav.seq + 1) % 256

    async def _tell(self) -> None:
        while True:
            truth = self._peer.truth()
            for message_id in sorted(self._asked):
                self._send(_MAKERS[message_id](truth))
            await asyncio.sleep(1.0 / _TRUTH_HZ)


def _sim_state(t: Kinematics) -> Message:
    lat = LAT + t.x_m / _METRES_PER_DEGREE
    lon = LON + t.y_m / (_METRES_PER_DEGREE * math.cos(math.radians(LAT)))
    return dialect.MAVLink_sim_state_message(
        *(1.0, 0.0, 0.0, 0.0, t.roll_rad, t.pitch_rad, t.yaw_rad),
        *(0.0, 0.0, -9.8, t.roll_rate_radps, t.pitch_rate_radps, t.yaw_rate_radps),
        *(lat, lon, ALT_M + t.height_m, 0.0, 0.0, t.vx_mps, t.vy_mps, -t.climb_mps),
        *(round(lat * 1e7), round(lon * 1e7)),
    )


def _attitude(t: Kinematics) -> Message:
    rates = t.roll_rate_radps, t.pitch_rate_radps, t.yaw_rate_radps
    return dialect.MAVLink_attitude_message(
        t.stamp_ns // 1_000_000 % 2**32, t.roll_rad, t.pitch_rad, t.yaw_rad, *rates
    )


def _local_position(t: Kinematics) -> Message:
    return dialect.MAVLink_local_position_ned_message(
        t.stamp_ns // 1_000_000 % 2**32, t.x_m, t.y_m, -t.height_m, t.vx_mps, t.vy_mps, -t.climb_mps
    )


_MAKERS = {30: _attitude, 32: _local_position, 108: _sim_state}


async def serve(kind: str) -> None:
    """Serve until standard input ends."""
    clock, loop = LoopClock(), asyncio.get_running_loop()
    airframe = Airframe(x_m=7.0, y_m=-4.0, yaw_rad=YAW_RAD)
    make, tells = {
        "ardupilot": (ArduCopterPeer, frozenset({30, 108})),
        "px4": (Px4Peer, frozenset({30, 32})),
    }[kind]
    peer = make(clock, airframe, PeerConfig())
    autopilot = await peer.open()
    vehicle = await loop.create_server(lambda: _Bridge(autopilot), "127.0.0.1", 0)
    truth = await loop.create_server(lambda: _TruthPort(peer, tells), "127.0.0.1", 0)
    print(*(server.sockets[0].getsockname()[1] for server in (vehicle, truth)), flush=True)
    ended = asyncio.Event()
    loop.add_reader(sys.stdin.fileno(), ended.set)
    flying = asyncio.ensure_future(peer.run())
    await asyncio.wait([flying, asyncio.ensure_future(ended.wait())], return_when=asyncio.FIRST_COMPLETED)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kind", choices=["ardupilot", "px4"])
    parser.add_argument("--speed", type=float, default=1.0)
    options = parser.parse_args()
    with asyncio.Runner(loop_factory=lambda: ScaledLoop(options.speed)) as runner:
        runner.run(serve(options.kind))


if __name__ == "__main__":
    main()
