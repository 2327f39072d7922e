"""A transport that is opened again whenever it is lost, and whom a listening one talks to."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable

from flightd.adapters.vehicle.mavlink.link.transport import Source, Transport

_LOG = logging.getLogger(__name__)

_BACKOFF_S = (0.5, 1.0, 2.0, 5.0)
_PEER_SILENT_NS = 3_000_000_000
"""After this long another address may take over as the autopilot's."""


class Reconnection:
    """Keeps one transport open; its `received` is the caller's own."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport
        self._heard_ns = -2 * _PEER_SILENT_NS
        self.lost = asyncio.Event()
        """Set while the connection that stood is gone."""
        transport.lost = self.lost.set

    async def run(self, serve: Callable[[], Awaitable[object]]) -> None:
        """Hold the connection until cancelled; `serve` runs while it stands and returns when it is `lost`.
        UnavailableError when it can never work (port in use)."""
        transport, attempt = self._transport, 0
        try:
            while True:
                try:
                    await transport.open()
                except OSError as err:
                    if attempt == 0:
                        _LOG.warning("%s: %s; trying again", transport.endpoint, err.strerror or err)
                    wait_s = _BACKOFF_S[min(attempt, len(_BACKOFF_S) - 1)]
                    attempt += 1
                    await asyncio.sleep(wait_s)
                    continue
                attempt = 0
                self.lost.clear()
                await serve()
                _LOG.warning("%s: connection lost; trying again", transport.endpoint)
                transport.close()
                await asyncio.sleep(_BACKOFF_S[0])
        finally:
            transport.close()

    def is_peer(self, source: Source, now_ns: int) -> bool:
        """Whether the vehicle spoke that is answered: a listening socket keeps to whoever spoke first, until
        he falls silent."""
        if source != self._transport.peer and now_ns - self._heard_ns > _PEER_SILENT_NS:
            self._transport.peer = source
        if source != self._transport.peer:
            return False
        self._heard_ns = now_ns
        return True
