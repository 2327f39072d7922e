"""A page's WebSocket as the server keeps it: one that answers no ping is cut off, whatever waits for it."""

from __future__ import annotations

from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol


class PageSocket(WebSocketsSansIOProtocol):
    """As uvicorn keeps it, but where the page takes nothing any more: uvicorn would close the connection once
    everything is sent, which is never, and the page of a machine that has gone would attend for ever."""

    def keepalive_timeout(self) -> None:
        """No answer in time: say so, if there is still a way, and be rid of it."""
        super().keepalive_timeout()
        self.transport.abort()
