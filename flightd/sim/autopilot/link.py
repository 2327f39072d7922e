"""The autopilot's side of MAVLink over UDP: one channel for each address that speaks to it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any, TypeAlias

from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.sim.autopilot.radio import Radio, RadioParams

Address: TypeAlias = tuple[str, int]
Message: TypeAlias = Any
"""An instance of one of the dialect's generated message classes."""

_CHANNELS_MAX = 8


class MavlinkChannel:
    """One peer address: its own sequence numbers and message intervals, as an autopilot's serial port."""

    def __init__(self, address: Address, system_id: int, component_id: int, key: bytes | None = None) -> None:
        self.address = address
        self._packer = dialect.MAVLink(None, srcSystem=system_id, srcComponent=component_id)
        if key is not None:
            self.sign(key)
        self.intervals_ns: dict[int, int] = {}
        self.due_ns: dict[int, int] = {}
        self.greeted = False
        """Whether it gets what the autopilot streams unasked."""
        self.heard = 0
        """The number of the newest message from there, of all that were heard; 0: none yet."""

    def sign(self, key: bytes) -> None:
        """Sign what goes out from now on."""
        self._packer.signing.secret_key = key
        self._packer.signing.sign_outgoing = True

    def pack(self, message: Message, signing_time: int) -> bytes:
        """One frame; a signature is stamped no earlier than `signing_time`."""
        self._packer.signing.timestamp = max(self._packer.signing.timestamp, signing_time)
        frame: bytes = message.pack(self._packer)
        self._packer.seq = (self._packer.seq + 1) % 256
        return frame

    def stream(self, message_id: int, period_ns: int, now_ns: int) -> None:
        """Send the message every `period_ns` from now on; 0 or less stops it."""
        if period_ns > 0:
            self.intervals_ns[message_id] = period_ns
            self.due_ns[message_id] = now_ns + period_ns
        else:
            self.intervals_ns.pop(message_id, None)
            self.due_ns.pop(message_id, None)


class UdpLink(asyncio.DatagramProtocol):
    """A bound UDP socket.  `received(channel, message)` is called for every sound message; with a `key`
    MAVLink 2 signatures are made and demanded; their time is the newest heard, as on an autopilot
    without a clock."""

    def __init__(
        self,
        system_id: int,
        component_id: int,
        received: Callable[[MavlinkChannel, Message], None],
        key: bytes | None = None,
        seed: int = 0,
    ) -> None:
        self.down = Radio(RadioParams(), seed)
        """From the vehicle to its companion."""
        self.up = Radio(RadioParams(), seed + 1)
        self._system_id = system_id
        self._component_id = component_id
        self._received = received
        self._parser = dialect.MAVLink(None)
        self._parser.robust_parsing = True
        self._parser.signing.secret_key = key
        self._key = key
        self._transport: asyncio.DatagramTransport | None = None
        self._heard = 0
        self.channels: dict[Address, MavlinkChannel] = {}
        self.silent = False
        """Nothing goes out any more, what comes in is heard."""
        self.deaf = False
        """Nothing comes in any more, what goes out is heard."""
        self.muted = False
        """A cut cable: nothing goes out, nothing comes in."""
        self.withheld: set[int] = set()
        """Ids of messages that are not sent."""

    async def open(self, host: str, port: int) -> Address:
        """Bind; port 0 takes a free one.  Returns the address bound."""
        loop = asyncio.get_running_loop()
        transport, _ = await loop.create_datagram_endpoint(lambda: self, local_addr=(host, port))
        self._transport = transport
        name: Address = transport.get_extra_info("sockname")[:2]
        return name

    def sign(self, key: bytes, stamp: int) -> None:
        """Sign from now on, and demand it."""
        self._key = self._parser.signing.secret_key = key
        self._parser.signing.timestamp = max(self._parser.signing.timestamp, stamp)
        for channel in self.channels.values():
            channel.sign(key)

    def close(self) -> None:
        if self._transport is not None:
            self._transport.close()
            self._transport = None

    def channel(self, address: Address) -> MavlinkChannel | None:
        """The channel of that address, made at its first use.  Where there are too many, the one that was
        silent for the longest gives way: a program that was started anew speaks from another port.  One that
        was never heard stays; None where all are such."""
        channel = self.channels.get(address)
        if channel is None:
            if len(self.channels) >= _CHANNELS_MAX and not self._give_way():
                return None
            channel = self.channels[address] = MavlinkChannel(
                address, self._system_id, self._component_id, self._key
            )
        return channel

    def _give_way(self) -> bool:
        """Drop the channel that was silent for the longest."""
        spoke = [channel for channel in self.channels.values() if channel.heard]
        if spoke:
            del self.channels[min(spoke, key=lambda channel: channel.heard).address]
        return bool(spoke)

    def send(self, channel: MavlinkChannel, message: Message) -> None:
        if self._transport is not None and not self.muted and message.get_msgId() not in self.withheld:
            frame = channel.pack(message, self._parser.signing.timestamp)
            self.down.carry(lambda: self.transmit(frame, channel.address))

    def broadcast(self, message: Message) -> None:
        for channel in self.channels.values():
            self.send(channel, message)

    def transmit(self, frame: bytes, address: Address) -> None:
        """Put one packed frame on the wire."""
        if self._transport is not None and not (self.muted or self.silent):
            self._transport.sendto(frame, address)

    def datagram_received(self, data: bytes, addr: Any) -> None:
        if not (self.muted or self.deaf):
            self.up.carry(lambda: self._in(data, addr))

    def _in(self, data: bytes, addr: Any) -> None:
        self._parser.buf = bytearray()
        self._parser.buf_index = 0
        for message in self._parser.parse_buffer(data) or ():
            if message.get_type().startswith(("BAD_DATA", "UNKNOWN")):
                continue
            channel = self.channel((addr[0], addr[1]))
            if channel is not None:
                self._heard += 1
                channel.heard = self._heard
                self._received(channel, message)

    def error_received(self, exc: Exception) -> None:
        """A remote port is closed: it may open later."""
