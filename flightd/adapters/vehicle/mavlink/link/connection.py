"""One MAVLink connection: kept for ever, with our heartbeat and the recognition of the autopilot."""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum

from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.adapters.vehicle.mavlink.link.codec import COMPANION, Codec, FrameParser, Message
from flightd.adapters.vehicle.mavlink.link.endpoint import Endpoint
from flightd.adapters.vehicle.mavlink.link.reconnection import Reconnection
from flightd.adapters.vehicle.mavlink.link.transport import Source, Transport
from flightd.ports import Clock
from flightd.runtime.within import Within

_HEARTBEAT_S = 0.05
_PARSERS_MAX = 16
_NAMESAKE_NS = 5_000_000_000
_LATE_MAX, _LATE_RUN_MAX = 64, 16
_STATES = frozenset({"HEARTBEAT", "EXTENDED_SYS_STATE"})
"""Messages of which only the newest counts and which carry no time stamp of their own."""


class Firmware(Enum):
    """What flies the vehicle, by HEARTBEAT.autopilot."""

    ARDUPILOT = dialect.MAV_AUTOPILOT_ARDUPILOTMEGA
    PX4 = dialect.MAV_AUTOPILOT_PX4


_FIRMWARES = {firmware.value: firmware for firmware in Firmware}


class MavlinkLink:
    """Sends and receives as the companion (component 191) of one vehicle.  Heartbeats are packed by `beats`,
    whose system id may be one that the autopilot's failsafe watches; everything else comes from the `codec`,
    with the vehicle's, else no ground station would show it.

    `holds` says whether there are heartbeats at all: without them the failsafe acts.
    `on_message(message, now_ns)` gets every sound message of that vehicle's autopilot, its HEARTBEAT
    included; what others say (ground stations, gimbals, other vehicles) is not passed on.
    """

    def __init__(
        self,
        transport: Transport,
        codec: Codec,
        clock: Clock,
        system_id: int,
        on_message: Callable[[Message, int], None],
        beats: Codec | None = None,
        holds: Callable[[], bool] = lambda: True,
    ) -> None:
        self._transport = transport
        self._codec = codec
        self._beats = beats or codec
        self._holds = holds
        self._namesake_ns: int | None = None
        self._clock = clock
        self._system_id = system_id
        self._on_message = on_message
        self._parsers: dict[Source, FrameParser] = {}
        self._reconnection = Reconnection(transport)
        self._sequence = 0
        self._late = 0
        self.system_status = dialect.MAV_STATE_STANDBY
        self.firmware: Firmware | None = None
        self.sent = 0
        self.dropped = 0
        """What no line could take."""
        self.received = 0
        transport.received = self._received

    def hears_namesake(self, now_ns: int) -> bool:
        """Somebody else has just sent heartbeats with the system id of ours."""
        return self._namesake_ns is not None and now_ns - self._namesake_ns < _NAMESAKE_NS

    @property
    def endpoint(self) -> Endpoint:
        return self._transport.endpoint

    async def run(self) -> None:
        """Hold the connection until cancelled.  UnavailableError when it can never work (port in use)."""
        await self._reconnection.run(self._beat)

    async def _beat(self) -> None:
        """Our HEARTBEAT twenty times a second while the connection stands: a failsafe of half a second on the
        autopilot's side tolerates nine lost ones."""
        lost = self._reconnection.lost
        while not lost.is_set():
            beat = dialect.MAVLink_heartbeat_message(
                dialect.MAV_TYPE_ONBOARD_CONTROLLER,
                dialect.MAV_AUTOPILOT_INVALID,
                0,
                0,
                self.system_status,
                3,
            )
            if self._holds():
                self._pass(self._beats.pack(beat))
            try:
                async with Within(_HEARTBEAT_S):
                    await lost.wait()
            except TimeoutError:
                continue
        self._parsers.clear()

    def send(self, message: Message) -> bool:
        """Pack and hand over one message; False when the line could not take it."""
        return self._pass(self._codec.pack(message))

    def _pass(self, frame: bytes) -> bool:
        out = self._transport.send(frame)
        self.sent += out
        self.dropped += not out
        return out

    def _received(self, data: bytes, source: Source) -> None:
        parser = self._parsers.get(source)
        if parser is None:
            if len(self._parsers) >= _PARSERS_MAX:
                self._parsers.clear()  # parsers of datagram peers hold no state worth keeping
            parser = self._parsers[source] = FrameParser(self._codec)
        messages = parser.datagram(data) if self._transport.datagrams else parser.stream(data)
        now_ns = self._clock.now_ns()
        for message in messages:
            self._sort(message, source, now_ns)

    def _is_late(self, message: Message) -> bool:
        """Whether a newer message overtook this one on the way and it says what is no longer so.

        Told by the sequence number, which counts modulo 256; one that stays behind is that of an
        autopilot which started anew.
        """
        behind = (self._sequence - message.get_seq()) % 256
        if not 0 < behind < _LATE_MAX or self._late >= _LATE_RUN_MAX:
            self._sequence, self._late = message.get_seq(), 0
            return False
        self._late += 1
        return message.get_type() in _STATES

    def _is_namesake(self, message: Message) -> bool:
        """A heartbeat by which the autopilot would believe us alive; not our own, come back by a router."""
        own = self._beats.system_id
        if own == self._system_id or message.get_type() != "HEARTBEAT" or message.get_srcSystem() != own:
            return False
        return bool(message.get_srcComponent() != COMPANION)

    def _sort(self, message: Message, source: Source, now_ns: int) -> None:
        header = message.get_header()
        if self._is_namesake(message):
            self._namesake_ns = now_ns
        if header.srcSystem != self._system_id or header.srcComponent != dialect.MAV_COMP_ID_AUTOPILOT1:
            return
        if message.get_type() == "HEARTBEAT":
            firmware = _FIRMWARES.get(message.autopilot)
            if firmware is None or message.type == dialect.MAV_TYPE_GCS:
                return
            if self._reconnection.is_peer(source, now_ns):
                self.firmware = firmware
        if source != self._transport.peer or self._is_late(message):
            return
        self.received += 1
        self._on_message(message, now_ns)
