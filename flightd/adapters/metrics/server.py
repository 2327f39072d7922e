"""A scrape over HTTP: prometheus_client's own answers, from a thread beside the daemon's loop."""

from __future__ import annotations

import asyncio
import logging
import socket
import threading
from functools import partial
from typing import Any
from wsgiref.simple_server import WSGIRequestHandler, make_server

from prometheus_client import CollectorRegistry, make_wsgi_app
from prometheus_client.exposition import ThreadingWSGIServer

from flightd.core.errors import UnavailableError

_LOG = logging.getLogger(__name__)

_CLIENTS = 8
_STOP_S = 0.1
"""So often the thread looks whether it shall end."""


class MetricsServer:
    """Listens from `open` to `close`.  At most eight clients at once, and one that is silent for `patience_s`
    is hung up on: `prometheus_client.start_http_server` alone would wait for ever, in a thread each.
    """

    def __init__(
        self, address: tuple[str, int], registry: CollectorRegistry, patience_s: float = 5.0
    ) -> None:
        self._address = address
        self._registry = registry
        self._patience_s = patience_s
        self._server: _Server | None = None
        self._thread: threading.Thread | None = None

    @property
    def port(self) -> int:
        """The port it listens on."""
        assert self._server is not None
        return int(self._server.server_port)

    async def open(self) -> None:
        """UnavailableError when the port is taken."""
        host, port = self._address
        kind = _Server6 if ":" in host else _Server
        app = make_wsgi_app(self._registry)
        try:
            # in a thread: binding looks the machine's own name up, which waits where no name server answers
            server = await asyncio.to_thread(make_server, host, port, app, kind, _Handler)
        except OSError as err:
            raise UnavailableError(
                f"metrics.listen {host}:{port}: {err.strerror}; give a free port"
            ) from None
        server.patience_s = self._patience_s
        self._server = server
        self._thread = threading.Thread(
            target=partial(server.serve_forever, _STOP_S), name="metrics", daemon=True
        )
        self._thread.start()

    async def close(self) -> None:
        """Listen no more.  A client that is being answered is answered."""
        if self._server is not None and self._thread is not None:
            await asyncio.to_thread(self._server.shutdown)
            self._thread.join()
            self._server.server_close()


class _Server(ThreadingWSGIServer):
    def __init__(self, address: tuple[str, int], handler: type[WSGIRequestHandler]) -> None:
        super().__init__(address, handler)
        self.patience_s = 0.0
        self._free = threading.BoundedSemaphore(_CLIENTS)

    def get_request(self) -> tuple[socket.socket, Any]:
        client, address = super().get_request()
        client.settimeout(self.patience_s)
        return client, address

    def verify_request(self, *_: object) -> bool:
        return self._free.acquire(blocking=False)

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        try:
            super().process_request_thread(request, client_address)
        finally:
            self._free.release()

    def handle_error(self, _request: object, client_address: object) -> None:
        """A client that hangs up, or says nothing, is no fault of ours."""
        _LOG.debug("scrape from %s", client_address, exc_info=True)


class _Server6(_Server):
    address_family = socket.AF_INET6


class _Handler(WSGIRequestHandler):
    def log_message(self, *_: object) -> None:
        """Scrapes are not worth a line."""
