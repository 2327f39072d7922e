"""An autopilot simulator elsewhere (ArduCopter's or PX4's SITL) as the airframe: its truth link.

The warehouse is laid where the vehicle stands when it is first heard: that place is the pad, and the way
its nose points is the heading with which the mission starts.
"""

from __future__ import annotations

import asyncio
import logging
import math
import re
from dataclasses import replace
from typing import Any, TypeAlias

from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.core.errors import InputError, UnavailableError
from flightd.core.geometry import wrap_pi
from flightd.ports import Clock
from flightd.runtime.within import Within
from flightd.sim.external.external_pace import PaceMonitor
from flightd.sim.external.external_truth import Placement, TruthReader
from flightd.sim.plant.kinematics import Kinematics
from flightd.sim.plant.truth_history import TruthHistory
from flightd.sim.sensors.instruments import SensorParams

Message: TypeAlias = Any

_LOG = logging.getLogger(__name__)

_WANTED_HZ = 100
_TRUTH_IDS = (
    dialect.MAVLINK_MSG_ID_SIM_STATE,
    dialect.MAVLINK_MSG_ID_SIMSTATE,
    dialect.MAVLINK_MSG_ID_HIL_STATE_QUATERNION,
    dialect.MAVLINK_MSG_ID_LOCAL_POSITION_NED,
    dialect.MAVLINK_MSG_ID_ATTITUDE,
)
_ASK_S = 2.0
_RANGE_S = 0.04
_AHEAD_MAX_S = 0.1
_SAMPLES = 1000
_WAITING_MAX = 4096
"""Bytes that may wait for a simulator that does not read; what is said beyond is said again later."""


class ExternalVehicle(asyncio.Protocol, asyncio.DatagramProtocol):
    """The truth link to an external simulator over TCP or UDP, in the place of a simulated vehicle.

    `open` waits for the first truth; a lost link is found again, the warehouse staying where it is.  The
    distance to our floor goes back as DISTANCE_SENSOR, for an autopilot whose range finder is fed so.
    The truth is that of the first autopilot heard: another vehicle on the same link tells nothing.
    """

    def __init__(self, url: str, clock: Clock, placement: Placement, patience_s: float = 30.0) -> None:
        self._url = url
        self._kind, self._host, self._port = truth_address(url)
        self._clock = clock
        self._reader = TruthReader(placement)
        self._truth = TruthHistory(_SAMPLES)
        self._patience_s = patience_s
        self._mav = dialect.MAVLink(None, srcSystem=254, srcComponent=dialect.MAV_COMP_ID_MISSIONPLANNER)
        self._mav.robust_parsing = True
        self._transport: Any = None
        self._peer: tuple[str, int] | None = None
        self._system_id: int | None = None
        self._range = SensorParams()
        self._pace = PaceMonitor()
        self._first = asyncio.Event()
        self._newest_ns = 0
        self._line: asyncio.Task[None] | None = None

    async def open(self) -> tuple[str, int]:
        """Connect and wait until the simulator tells the truth; the address of the link.

        UnavailableError when it does not within the patience.
        """
        if self._line is None:
            self._line = asyncio.create_task(self._hold(), name="external truth")
        try:
            async with Within(self._patience_s):
                await self._first.wait()
        except TimeoutError:
            await self.close()
            text = "no simulator tells its true state there: start it, and check the port"
            raise UnavailableError(f"--truth-url {self._url}: {text}") from None
        return self._host, self._port

    async def run(self) -> None:
        """Listen until cancelled."""
        await self.open()
        assert self._line is not None
        try:
            await self._line
        finally:
            await self.close()

    @property
    def armed(self) -> None:
        """Not told by the truth link."""

    def truth(self) -> Kinematics:
        """The true motion now."""
        return self.truth_at(self._clock.now_ns())

    def truth_at(self, stamp_ns: int) -> Kinematics:
        """The true motion at a moment of the last seconds, of the loop's clock; beyond the newest sample it
        goes on as it was, for a moment."""
        newest = self._truth.latest()
        if stamp_ns <= newest.stamp_ns:
            return self._truth.at(stamp_ns)
        ahead_s = min((stamp_ns - newest.stamp_ns) * 1e-9, _AHEAD_MAX_S)
        return replace(
            newest,
            stamp_ns=stamp_ns,
            x_m=newest.x_m + newest.vx_mps * ahead_s,
            y_m=newest.y_m + newest.vy_mps * ahead_s,
            height_m=newest.height_m + newest.climb_mps * ahead_s,
            roll_rad=newest.roll_rad + newest.roll_rate_radps * ahead_s,
            pitch_rad=newest.pitch_rad + newest.pitch_rate_radps * ahead_s,
            yaw_rad=wrap_pi(newest.yaw_rad + newest.yaw_rate_radps * ahead_s),
        )

    @property
    def unsent_bytes(self) -> int:
        """What the simulator has not read yet."""
        return 0 if self._transport is None else int(self._transport.get_write_buffer_size())

    async def close(self) -> None:
        """Give the connection up; `open` makes it anew."""
        if self._line is not None:
            self._line.cancel()
            await asyncio.gather(self._line, return_exceptions=True)
            self._line = None
        if self._transport is not None:
            self._transport.abort()
            self._transport = None

    async def _hold(self) -> None:
        while True:
            if self._transport is None:
                try:
                    await self._connect()
                except OSError:
                    await asyncio.sleep(_ASK_S / 2)
                    continue
            self.ask_streams()
            for _ in range(round(_ASK_S / _RANGE_S)):
                self._tell_range()
                await asyncio.sleep(_RANGE_S)

    async def _connect(self) -> None:
        loop, place = asyncio.get_running_loop(), (self._host, self._port)
        if self._kind == "tcp":
            await loop.create_connection(lambda: self, *place)
        else:
            await loop.create_datagram_endpoint(lambda: self, local_addr=place)

    def _tell_range(self) -> None:
        """What a range finder sees of the floor; nothing out of its reach, as a real one."""
        if not self._first.is_set():
            return
        truth = self.truth()
        least_m, most_m = self._range.range_min_m, self._range.range_max_m
        distance_m = truth.height_m / max(math.cos(truth.roll_rad) * math.cos(truth.pitch_rad), 0.1)
        if least_m <= distance_m <= most_m:
            limits_cm, distance_cm = (round(least_m * 100), round(most_m * 100)), round(distance_m * 100)
            kind, down = dialect.MAV_DISTANCE_SENSOR_LASER, dialect.MAV_SENSOR_ROTATION_PITCH_270
            boot_ms = truth.stamp_ns // 1_000_000 % 2**32
            self._send(
                dialect.MAVLink_distance_sensor_message(boot_ms, *limits_cm, distance_cm, kind, 1, down, 0)
            )

    def ask_streams(self) -> None:
        """A heartbeat, and the rates (a rebooted simulator has forgotten them)."""
        self._send(
            dialect.MAVLink_heartbeat_message(dialect.MAV_TYPE_GCS, dialect.MAV_AUTOPILOT_INVALID, 0, 0, 4, 3)
        )
        for message_id in _TRUTH_IDS:
            params = (message_id, 1e6 / _WANTED_HZ, 0, 0, 0, 0, 0)
            command = dialect.MAV_CMD_SET_MESSAGE_INTERVAL
            self._send(dialect.MAVLink_command_long_message(1, 1, command, 0, *params))

    def _send(self, message: Message) -> None:
        if self._transport is None or self.unsent_bytes > _WAITING_MAX:
            return
        frame = message.pack(self._mav)
        self._mav.seq = (self._mav.seq + 1) % 256
        if self._kind == "tcp":
            self._transport.write(frame)
        elif self._peer is not None:
            self._transport.sendto(frame, self._peer)

    def connection_made(self, transport: Any) -> None:
        self._transport = transport

    def connection_lost(self, _exc: Exception | None) -> None:
        self._transport = None

    def _mind_pace(self, boot_ms: int, now_ns: int) -> None:
        if (pace := self._pace.observe(boot_ms, now_ns)) is not None:
            _LOG.warning("the simulator runs %.2f times as fast as --speed says: make the two equal", pace)

    def error_received(self, exc: Exception) -> None:
        """Nobody is there at the moment (ICMP)."""

    def datagram_received(self, data: bytes, addr: Any) -> None:
        self._peer = (addr[0], addr[1])
        self._mav.buf, self._mav.buf_index = bytearray(), 0  # a broken datagram must not eat the next one
        self.data_received(data)

    def _is_vehicle(self, message: Message) -> bool:
        if message.get_srcComponent() != dialect.MAV_COMP_ID_AUTOPILOT1:
            return False
        if self._system_id is None:
            self._system_id = message.get_srcSystem()
        return bool(message.get_srcSystem() == self._system_id)

    def data_received(self, data: bytes) -> None:
        now_ns = self._clock.now_ns()
        for message in self._mav.parse_buffer(data) or ():
            if message.get_type().startswith(("BAD_DATA", "UNKNOWN")) or not self._is_vehicle(message):
                continue
            if message.get_type() == "ATTITUDE":
                self._mind_pace(message.time_boot_ms, now_ns)
            truth = self._reader.take(message, max(now_ns, self._newest_ns + 1))
            if truth is not None:
                self._newest_ns = truth.stamp_ns
                self._truth.add(truth)
                self._first.set()


def truth_address(url: str) -> tuple[str, str, int]:
    """Kind, host and port of `tcp:HOST:PORT` or `udpin:HOST:PORT`; InputError for anything else."""
    match = re.fullmatch(r"(tcp|udpin):(?://)?([^\s:]+):(\d{1,5})", url)
    if match is None or not 0 < int(match[3]) < 65536:
        forms = "use tcp:HOST:PORT, e.g. tcp:127.0.0.1:5762 (ArduPilot), or udpin:0.0.0.0:14550 (PX4)"
        raise InputError(f"--truth-url {url!r} is no address: {forms}")
    return match[1], match[2], int(match[3])
