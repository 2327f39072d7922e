"""A scrape over HTTP/1.1: GET /metrics, nothing else, in the daemon's own loop."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable

from flightd.adapters.metrics.metrics import CONTENT_TYPE
from flightd.core.errors import UnavailableError

_CLIENTS = 8
_LINE_BYTES = 8192
_PATIENCE_S = 5.0


class MetricsServer:
    """Listens from `open` to `close`.  At most eight clients at once, five seconds each, one answer each."""

    def __init__(self, address: tuple[str, int], exposition: Callable[[], bytes]) -> None:
        self._address = address
        self._exposition = exposition
        self._server: asyncio.Server | None = None
        self._clients: set[asyncio.Task[None]] = set()

    @property
    def port(self) -> int:
        """The port it listens on."""
        assert self._server is not None
        return int(self._server.sockets[0].getsockname()[1])

    async def open(self) -> None:
        """UnavailableError when the port is taken."""
        host, port = self._address
        try:
            self._server = await asyncio.start_server(self._serve, host, port, limit=_LINE_BYTES)
        except OSError as err:
            raise UnavailableError(
                f"metrics.listen {host}:{port}: {err.strerror}; give a free port"
            ) from None

    async def close(self) -> None:
        if self._server is not None:
            self._server.close()
        for client in self._clients:
            client.cancel()
        await asyncio.gather(*self._clients, return_exceptions=True)

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        assert task is not None
        if len(self._clients) >= _CLIENTS:
            writer.transport.abort()
            return
        self._clients.add(task)
        try:
            with contextlib.suppress(OSError, ValueError, TimeoutError, asyncio.IncompleteReadError):
                async with asyncio.timeout(_PATIENCE_S):
                    writer.write(self._answer(await reader.readline()))
                    while (await reader.readline()).strip():  # the rest of the head says nothing to us
                        pass
                    await writer.drain()
        finally:
            self._clients.discard(task)
            writer.close()

    def _answer(self, request: bytes) -> bytes:
        method, _, rest = request.partition(b" ")
        path = rest.split(b" ", maxsplit=1)[0].split(b"?", maxsplit=1)[0]
        if path != b"/metrics":
            return _response("404 Not Found", b"the metrics are at /metrics\n")
        if method not in {b"GET", b"HEAD"}:
            return _response("405 Method Not Allowed", b"GET only\n")
        return _response("200 OK", self._exposition(), with_body=method == b"GET")


def _response(status: str, body: bytes, *, with_body: bool = True) -> bytes:
    head = (
        f"HTTP/1.1 {status}\r\nContent-Type: {CONTENT_TYPE}\r\nContent-Length: {len(body)}\r\n"
        "Connection: close\r\n\r\n"
    )
    return head.encode() + (body if with_body else b"")
