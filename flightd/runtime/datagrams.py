"""Datagrams that must go out now or not at all, and come in batches when there are many."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import Callable
from typing import Any, Protocol, TypeAlias

from flightd.runtime.batched_reader import PacedReader

Received: TypeAlias = Callable[[bytes, Any], None]
"""Gets each datagram and the address it came from."""
Failed: TypeAlias = Callable[[OSError], None]
"""Gets what the network reports."""

_BATCH_MAX = 256
_DATAGRAM_MAX_BYTES = 65_536


class Datagrams(Protocol):
    """An open UDP socket."""

    @property
    def socket(self) -> socket.socket: ...

    def send(self, data: bytes, address: Any = None) -> bool:
        """Without an address to whom it was opened for.  False when the network does not take it."""
        ...

    def close(self) -> None: ...


class OpenDatagrams(Protocol):
    """What opens a socket at `local_addr` or for `remote_addr`; OSError when that cannot be."""

    async def __call__(self, received: Received, failed: Failed, **place: Any) -> Datagrams: ...


async def open_datagrams(received: Received, failed: Failed, **place: Any) -> Datagrams:
    """`OpenDatagrams` by the loop's own endpoint, on any loop: one of virtual time sees each datagram."""
    loop = asyncio.get_running_loop()
    return (await loop.create_datagram_endpoint(lambda: _LoopDatagrams(received, failed), **place))[1]


async def open_paced_datagrams(received: Received, failed: Failed, **place: Any) -> Datagrams:
    """`OpenDatagrams` that stands a flood, for what flies by the machine's clock."""
    loop = asyncio.get_running_loop()
    transport, _ = await loop.create_datagram_endpoint(asyncio.DatagramProtocol, **place)
    own = transport.get_extra_info("socket").dup()
    transport.close()
    return PacedDatagrams(own, received, failed)


def is_stalled(transport: asyncio.DatagramTransport) -> bool:
    """Whether a datagram given earlier still waits here for the network to take it.  asyncio lets them pile
    up without a bound and sends all of them once it can, however old."""
    return bool(transport.get_write_buffer_size())  # type: ignore[attr-defined]  # the stubs leave it out


class PacedDatagrams:
    """A socket that does not block, read by a `PacedReader` and closed with this."""

    def __init__(self, sock: socket.socket, received: Received, failed: Failed) -> None:
        sock.setblocking(False)
        self.socket = sock
        self._received = received
        self._failed = failed
        self._closed = False
        self._reader = PacedReader(sock.fileno(), self._drain)

    def send(self, data: bytes, address: Any = None) -> bool:
        if self._closed:
            return False
        try:
            if address is None:
                self.socket.send(data)
            else:
                self.socket.sendto(data, address)
        except BlockingIOError:
            return False
        except OSError as err:
            self._failed(err)
            return False
        return True

    def close(self) -> None:
        if not self._closed:
            self._closed = True
            self._reader.close()
            self.socket.close()

    def _drain(self) -> int:
        for count in range(_BATCH_MAX):
            if self._closed:
                return count
            try:
                data, address = self.socket.recvfrom(_DATAGRAM_MAX_BYTES)
            except BlockingIOError:
                return count
            except OSError as err:
                self._failed(err)
            else:
                self._received(data, address)
        return _BATCH_MAX


class _LoopDatagrams(asyncio.DatagramProtocol):
    """The loop's own endpoint."""

    def __init__(self, received: Received, failed: Failed) -> None:
        self._received = received
        self._failed = failed
        self._transport: asyncio.DatagramTransport | None = None

    @property
    def socket(self) -> socket.socket:
        assert self._transport is not None
        sock: socket.socket = self._transport.get_extra_info("socket")
        return sock

    def connection_made(self, transport: Any) -> None:
        self._transport = transport

    def send(self, data: bytes, address: Any = None) -> bool:
        if self._transport is None or is_stalled(self._transport):
            return False
        self._transport.sendto(data, address)
        return True

    def close(self) -> None:
        if self._transport is not None:
            self._transport.close()
            self._transport = None

    def datagram_received(self, data: bytes, addr: Any) -> None:
        self._received(data, addr)

    def error_received(self, exc: Exception) -> None:
        if isinstance(exc, OSError):
            self._failed(exc)
