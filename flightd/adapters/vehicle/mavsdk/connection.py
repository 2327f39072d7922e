"""MAVSDK's connection, carried by our own transports.

The library gets a `raw://` connection: what it wants to send comes here and leaves through the daemon's
event loop and the gate.  A loop that hangs therefore sends nothing, whatever the library's threads do.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable

from flightd.adapters.vehicle.mavlink.link.transport import Source, Transport
from flightd.adapters.vehicle.mavsdk.gate import SetpointGate
from flightd.ports import Clock

_LOG = logging.getLogger(__name__)

_BACKOFF_S = (0.5, 1.0, 2.0, 5.0)
_PEER_SILENT_NS = 3_000_000_000


class MavsdkConnection:
    """Keeps the transport open for ever and carries bytes both ways; all calls on the event loop.
    `received(data)` is set before `run`."""

    def __init__(self, transport: Transport, gate: SetpointGate, clock: Clock) -> None:
        self._transport = transport
        self._gate = gate
        self._clock = clock
        self.received: Callable[[bytes], None] = lambda _data: None
        self._lost = asyncio.Event()
        self._heard_ns = -2 * _PEER_SILENT_NS
        self.dropped = 0
        """Frames that the gate let pass and no line could take."""
        transport.received = self._take
        transport.lost = self._lost.set

    async def run(self) -> None:
        """Hold the connection until cancelled.  UnavailableError when it can never work (port in use)."""
        attempt = 0
        try:
            while True:
                try:
                    await self._transport.open()
                except OSError as err:
                    if attempt == 0:
                        _LOG.warning("%s: %s; trying again", self._transport.endpoint, err.strerror or err)
                    wait_s = _BACKOFF_S[min(attempt, len(_BACKOFF_S) - 1)]
                    attempt += 1
                    await asyncio.sleep(wait_s)
                    continue
                attempt = 0
                self._lost.clear()
                await self._lost.wait()
                _LOG.warning("%s: connection lost; trying again", self._transport.endpoint)
                self._transport.close()
                await asyncio.sleep(_BACKOFF_S[0])
        finally:
            self._transport.close()

    def send(self, frame: bytes) -> None:
        """One frame of the library's, if the gate lets it pass."""
        if self._gate.passes(frame, self._clock.now_ns()):
            self.dropped += not self._transport.send(frame)

    def _take(self, data: bytes, source: Source) -> None:
        """A listening socket answers whoever spoke first, until he falls silent."""
        now_ns = self._clock.now_ns()
        if source != self._transport.peer and now_ns - self._heard_ns > _PEER_SILENT_NS:
            self._transport.peer = source
        if source == self._transport.peer:
            self._heard_ns = now_ns
            self.received(data)
