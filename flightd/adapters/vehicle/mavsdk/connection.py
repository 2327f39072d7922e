"""MAVSDK's connection, carried by our own transports.

The library gets a `raw://` connection: what it wants to send comes here and leaves through the daemon's
event loop and the gate.  A loop that hangs therefore sends nothing, whatever the library's threads do.
"""

from __future__ import annotations

from collections.abc import Callable

from flightd.adapters.vehicle.mavlink.link.reconnection import Reconnection
from flightd.adapters.vehicle.mavlink.link.transport import Source, Transport
from flightd.adapters.vehicle.mavsdk.gate import SetpointGate
from flightd.ports import Clock


class MavsdkConnection:
    """Keeps the transport open for ever and carries bytes both ways; all calls on the event loop.
    `received(data)` is set before `run`."""

    def __init__(self, transport: Transport, gate: SetpointGate, clock: Clock) -> None:
        self._transport = transport
        self._gate = gate
        self._clock = clock
        self.received: Callable[[bytes], None] = lambda _data: None
        self._reconnection = Reconnection(transport)
        self.dropped = 0
        """Frames that the gate let pass and no line could take."""
        transport.received = self._take

    async def run(self) -> None:
        """Hold the connection until cancelled.  UnavailableError when it can never work (port in use)."""
        await self._reconnection.run(self._reconnection.lost.wait)

    def send(self, frame: bytes) -> None:
        """One frame of the library's, if the gate lets it pass."""
        if self._gate.passes(frame, self._clock.now_ns()):
            self.dropped += not self._transport.send(frame)

    def _take(self, data: bytes, source: Source) -> None:
        if self._reconnection.is_peer(source, self._clock.now_ns()):
            self.received(data)
