"""The two UDP endpoints towards the drone: AT out, navdata in."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from typing import Any

from flightd.adapters.vehicle.ardrone.at import AtCommand, AtEncoder
from flightd.adapters.vehicle.ardrone.navdata import WAKE_UP, Navdata, NavdataError, NavdataOrder, parse
from flightd.adapters.vehicle.ardrone.settings import ArDroneSettings
from flightd.ports import Clock
from flightd.runtime.datagrams import is_stalled

_log = logging.getLogger(__name__)

WAKE_PERIOD_NS = 200_000_000
REOPEN_NS = 3_000_000_000


class ArDroneLink:
    """Sends commands, takes navdata and hands every accepted packet to `receive`.

    Sockets are connected, so only the drone is heard; they are opened anew when it stays silent, because
    a computer that has joined the drone's network again may have another address.  Numbers of commands
    go on counting through all that.
    """

    def __init__(
        self, settings: ArDroneSettings, clock: Clock, receive: Callable[[Navdata, int], None]
    ) -> None:
        self._settings = settings
        self._clock = clock
        self._receive = receive
        self._encoder = AtEncoder()
        self._order = NavdataOrder()
        self._at: asyncio.DatagramTransport | None = None
        self._navdata: asyncio.DatagramTransport | None = None
        self._next: asyncio.Future[Navdata] | None = None
        self._woken_ns = 0
        self._opened_ns = 0
        self.heard_ns = 0
        self.sent_ns = 0
        self.bad_packets = 0
        self.stale_packets = 0
        self.dropped = 0

    async def tend(self) -> None:
        """Open or reopen the sockets and wake the drone as its silence asks for; call at every beat."""
        now_ns = self._clock.now_ns()
        silent_ns = now_ns - max(self.heard_ns, self._opened_ns)
        if not self._opened_ns or silent_ns > REOPEN_NS:
            await self._open(now_ns)
        asleep = now_ns - max(self.heard_ns, self._woken_ns) >= WAKE_PERIOD_NS
        if asleep and self._navdata is not None:
            self._woken_ns = now_ns
            self._navdata.sendto(WAKE_UP)

    def send(self, *commands: AtCommand) -> None:
        """One group of commands, at once; lost when there is no network or it takes no more."""
        if self._at is None or not commands:
            return
        if is_stalled(self._at):
            self.dropped += 1
            return
        self.sent_ns = self._clock.now_ns()
        for datagram in self._encoder.datagrams([commands]):
            self._at.sendto(datagram)

    def restart_numbers(self) -> None:
        """Begin again at 1, which makes the drone obey whatever number it had reached."""
        self._encoder.restart()

    async def packet(self) -> Navdata:
        """The next accepted packet."""
        if self._next is None:
            self._next = asyncio.get_running_loop().create_future()
        return await asyncio.shield(self._next)

    def close(self) -> None:
        for endpoint in (self._at, self._navdata):
            if endpoint is not None:
                endpoint.close()
        self._at = self._navdata = None

    async def _open(self, now_ns: int) -> None:
        self.close()
        self._opened_ns = now_ns
        loop = asyncio.get_running_loop()
        host = self._settings.host
        try:
            self._at, _ = await loop.create_datagram_endpoint(
                asyncio.DatagramProtocol, remote_addr=(host, self._settings.at_port)
            )
            self._navdata, _ = await loop.create_datagram_endpoint(
                lambda: _NavdataReceiver(self._take), remote_addr=(host, self._settings.navdata_port)
            )
        except OSError as error:
            _log.warning("no network to the drone at %s: %s", host, error)
            self.close()

    def _take(self, datagram: bytes) -> None:
        now_ns = self._clock.now_ns()
        try:
            packet = parse(datagram)
        except NavdataError:
            self.bad_packets += 1
            return
        if not self._order.accept(packet, now_ns):
            self.stale_packets += 1
            return
        self.heard_ns = now_ns
        self._receive(packet, now_ns)
        if self._next is not None:
            self._next.set_result(packet)
            self._next = None


class _NavdataReceiver(asyncio.DatagramProtocol):
    def __init__(self, take: Callable[[bytes], None]) -> None:
        self._take = take

    def datagram_received(self, data: bytes, _addr: Any) -> None:
        self._take(data)
