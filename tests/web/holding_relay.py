"""A way to a station on which requests below /api/ hang: their connection is held, and never answered."""

from __future__ import annotations

import contextlib
import socket
import threading
from collections.abc import Iterator
from dataclasses import dataclass, field


@dataclass
class Relay:
    """Where it listens, and how many requests it holds."""

    port: int
    held: int = 0
    sockets: list[socket.socket] = field(default_factory=list)


@contextlib.contextmanager
def holding(station_port: int) -> Iterator[Relay]:
    """Pass everything on to the station on loopback but what is to hang."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        relay = Relay(listener.getsockname()[1])
        accepting = threading.Thread(target=_accept, args=(listener, station_port, relay), daemon=True)
        accepting.start()
        try:
            yield relay
        finally:
            listener.shutdown(socket.SHUT_RDWR)
            accepting.join(10)
            for each in relay.sockets:
                with contextlib.suppress(OSError):  # the other end closed it
                    each.shutdown(socket.SHUT_RDWR)
                each.close()


def _accept(listener: socket.socket, station_port: int, relay: Relay) -> None:
    while True:
        try:
            browser, _ = listener.accept()
        except OSError:
            return  # the test is over
        station = socket.create_connection(("127.0.0.1", station_port))
        relay.sockets += [browser, station]
        threading.Thread(target=_pass, args=(browser, station, relay), daemon=True).start()
        threading.Thread(target=_pass, args=(station, browser, None), daemon=True).start()


def _pass(source: socket.socket, sink: socket.socket, relay: Relay | None) -> None:
    """Everything from one end to the other; with a relay until a request comes that is to be held."""
    with contextlib.suppress(OSError):  # one of them is gone
        while data := source.recv(65536):
            if relay is not None and data.split(b" ", 2)[1:2] and data.split(b" ", 2)[1].startswith(b"/api/"):
                relay.held += 1
                return
            sink.sendall(data)
        sink.shutdown(socket.SHUT_WR)
