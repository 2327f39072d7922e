"""UDP, TCP and serial lines behind one small interface, on asyncio alone.

Own code for serial lines too: pyserial-asyncio-fast 0.16 wakes the loop 412 times a second at 500 frames
where `PacedReader` does 72 times, 19 ms of processor a second against 9 (tools/bench_serial.py); it keeps
what the line does not take, and setpoints that are late are better dropped.
"""

from __future__ import annotations

import abc
import asyncio
import contextlib
import errno
import fcntl
import os
import socket
import termios
from collections.abc import Callable
from typing import Any, TypeAlias

from flightd.adapters.vehicle.mavlink.link.endpoint import Endpoint, EndpointKind
from flightd.core.errors import InputError, UnavailableError
from flightd.runtime.batched_reader import PacedReader
from flightd.runtime.datagrams import Datagrams, OpenDatagrams, open_datagrams
from flightd.runtime.within import Within

Source: TypeAlias = tuple[str, int] | None
"""Address a datagram came from; None on a stream."""

_RECEIVE_BUFFER_BYTES = 1 << 20
_BACKLOG_MAX_BYTES = 4096
"""More than this unsent means a stalled link: what is new is dropped, stale setpoints must not pile up."""
_SEND_BUFFER_BYTES = 16_384
"""Nor may they in the kernel, whose own choice holds half a minute of them."""
_CONNECT_S = 3.0
_UNHEARD_MS = 5_000
"""A TCP line whose other end acknowledges nothing for so long is dead, though nobody has said so."""
_MOVED = frozenset({errno.EINVAL, errno.EADDRNOTAVAIL, errno.ENETUNREACH, errno.ENETDOWN})
"""What a called UDP socket says once this computer has left its network or has another address there."""

_UNPLUGGED = frozenset({errno.EIO, errno.ENXIO, errno.ENODEV})
"""What a serial device says that goes away just as it is opened."""


class Transport(abc.ABC):
    """One line to the vehicle.  `received(data, source)` and `lost()` are set before `open`."""

    datagrams: bool
    """Whether data comes in datagrams (whole frames) or as a stream."""

    def __init__(self, endpoint: Endpoint) -> None:
        self.endpoint = endpoint
        self.received: Callable[[bytes, Source], None] = lambda _data, _source: None
        self.lost: Callable[[], None] = lambda: None
        self.peer: Source = None
        """Whom a listening socket answers to."""

    @abc.abstractmethod
    async def open(self) -> None:
        """Open once; OSError when the other side is not there (try again), UnavailableError when it
        can never work so."""

    @abc.abstractmethod
    def send(self, data: bytes) -> bool:
        """Hand over one frame without blocking; False when it was dropped."""

    @abc.abstractmethod
    def close(self) -> None: ...


class UdpTransport(Transport):
    """udpin: bound, answers to `peer`.  udpout: speaks first, to one address."""

    datagrams = True

    def __init__(self, endpoint: Endpoint, opener: OpenDatagrams = open_datagrams) -> None:
        super().__init__(endpoint)
        self._opener = opener
        self._open: Datagrams | None = None

    async def open(self) -> None:
        address = (self.endpoint.host, self.endpoint.port)
        listening = self.endpoint.kind is EndpointKind.UDP_IN
        place: dict[str, Any] = {"local_addr": address} if listening else {"remote_addr": address}
        try:
            self._open = await self._opener(self._take, self._failed, **place)
        except OSError as err:
            if err.errno == errno.EADDRINUSE:
                text = f"{self.endpoint}: the port is in use: stop the other program or choose another port"
                raise UnavailableError(text) from err
            raise
        sock = self._open.socket
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _RECEIVE_BUFFER_BYTES)
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _SEND_BUFFER_BYTES)

    @property
    def address(self) -> tuple[str, int]:
        """The local address once open."""
        assert self._open is not None
        name: tuple[str, int] = self._open.socket.getsockname()[:2]
        return name

    def send(self, data: bytes) -> bool:
        if self._open is None:
            return False
        if self.endpoint.kind is EndpointKind.UDP_OUT:
            return self._open.send(data)
        return self.peer is not None and self._open.send(data, self.peer)

    def close(self) -> None:
        if self._open is not None:
            self._open.close()
            self._open = None

    def _take(self, data: bytes, address: Any) -> None:
        self.received(data, (address[0], address[1]))

    def _failed(self, err: OSError) -> None:
        """Nobody listens there yet (ICMP): the vehicle may boot later.  A socket of another network is
        opened anew."""
        if self.endpoint.kind is EndpointKind.UDP_OUT and err.errno in _MOVED:
            self.lost()


class TcpTransport(Transport, asyncio.Protocol):
    """A TCP client."""

    datagrams = False

    def __init__(self, endpoint: Endpoint) -> None:
        super().__init__(endpoint)
        self._transport: asyncio.Transport | None = None

    async def open(self) -> None:
        loop = asyncio.get_running_loop()
        try:
            async with Within(_CONNECT_S):
                self._transport, _ = await loop.create_connection(
                    lambda: self, self.endpoint.host, self.endpoint.port
                )
        except TimeoutError as err:
            raise OSError(errno.ETIMEDOUT, os.strerror(errno.ETIMEDOUT)) from err
        sock = self._transport.get_extra_info("socket")
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _SEND_BUFFER_BYTES)
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, _UNHEARD_MS)

    def send(self, data: bytes) -> bool:
        transport = self._transport
        if transport is None or transport.get_write_buffer_size() > _BACKLOG_MAX_BYTES:
            return False
        transport.write(data)
        return True

    def close(self) -> None:
        if self._transport is not None:
            self._transport.abort()
            self._transport = None

    def data_received(self, data: bytes) -> None:
        self.received(data, None)

    def connection_lost(self, _exc: Exception | None) -> None:
        self._transport = None
        self.lost()


class SerialTransport(Transport):
    """A serial device in raw mode."""

    datagrams = False

    def __init__(self, endpoint: Endpoint) -> None:
        super().__init__(endpoint)
        self._speed = getattr(termios, f"B{endpoint.baud}", None)
        if self._speed is None:
            raise InputError(f"vehicle.url {endpoint}: {endpoint.baud} is not a baud rate of this machine")
        self._fd = -1
        self._reader: PacedReader | None = None

    async def open(self) -> None:
        fd = os.open(self.endpoint.device, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        try:
            control = termios.tcgetattr(fd)[6]
            self._claim(fd)  # before anything is changed under another's hands
            self._make_raw(fd, control)
        except termios.error as err:
            os.close(fd)
            if err.args[0] in _UNPLUGGED:
                raise OSError(*err.args) from err
            text = f"{self.endpoint}: {self.endpoint.device} is not a serial device: check the path"
            raise UnavailableError(text) from err
        except OSError:
            os.close(fd)
            raise
        self._fd = fd
        self._reader = PacedReader(fd, self._read)

    def send(self, data: bytes) -> bool:
        if self._fd < 0:
            return False
        try:
            return os.write(self._fd, data) == len(data)
        except BlockingIOError:
            return False
        except OSError:
            self._fail()
            return False

    def close(self) -> None:
        if self._fd >= 0:
            if self._reader is not None:
                self._reader.close()
            with contextlib.suppress(OSError):  # else who had it open before us would lock us out
                fcntl.ioctl(self._fd, termios.TIOCNXCL)
            with contextlib.suppress(OSError):
                os.close(self._fd)
            self._fd = -1

    def _make_raw(self, fd: int, control: list[bytes | int]) -> None:
        """8 data bits, no parity, one stop bit, no flow control, nothing interpreted."""
        iflag = termios.IGNBRK
        cflag = termios.CS8 | termios.CREAD | termios.CLOCAL
        assert self._speed is not None
        termios.tcsetattr(fd, termios.TCSANOW, [iflag, 0, cflag, 0, self._speed, self._speed, control])
        termios.tcflush(fd, termios.TCIOFLUSH)

    @staticmethod
    def _claim(fd: int) -> None:
        """Two programs on one line tear each other's frames.  OSError while another has it: one that only
        looks what was plugged in lets go of it soon."""
        try:
            fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
            fcntl.ioctl(fd, termios.TIOCEXCL)
        except BlockingIOError as err:
            raise OSError(errno.EBUSY, "another program has this serial line: stop it") from err

    def _read(self) -> int:
        """Bytes that came."""
        try:
            data = os.read(self._fd, 4096)
        except BlockingIOError:
            return 0
        except OSError:
            data = b""
        if data:
            self.received(data, None)
        else:
            self._fail()
        return len(data)

    def _fail(self) -> None:
        self.close()
        self.lost()


def make_transport(endpoint: Endpoint, opener: OpenDatagrams = open_datagrams) -> Transport:
    """The transport for an endpoint; `opener` opens a UDP one.  InputError for a baud rate that this machine
    cannot set."""
    match endpoint.kind:
        case EndpointKind.TCP:
            return TcpTransport(endpoint)
        case EndpointKind.SERIAL:
            return SerialTransport(endpoint)
        case _:
            return UdpTransport(endpoint, opener)
