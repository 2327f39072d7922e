"""Event loops whose time is virtual (jumps to the next timer) or scaled (a multiple of real time).

With `VirtualLoop` daemon and simulator run in lockstep in one process, over the same loopback sockets
as ever, and a flight is repeatable: time moves only when nobody has anything left to do.  Loopback UDP
is *nearly* synchronous (the kernel may defer delivery to another thread), so the loop counts the
datagrams which its own endpoints have sent to one another and waits for the stragglers.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import selectors
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from typing import Any

_LOG = logging.getLogger(__name__)

HOLD_PATIENCE_S = 60.0
"""Real time for which nothing may happen while time is held; then what is awaited counts as hung."""

_STRAGGLER_WAIT_S = 0.5
"""Real time after which a datagram counts as dropped (its receiver's buffer was full)."""


class PacedSelector(selectors.BaseSelector):
    """Passes everything to the real selector, but lets its loop decide what waiting means."""

    def __init__(self, wait: Callable[[selectors.BaseSelector, float | None], list[Any]]) -> None:
        self._real = selectors.DefaultSelector()
        self._wait = wait

    def register(self, fileobj: Any, events: int, data: Any = None) -> selectors.SelectorKey:
        return self._real.register(fileobj, events, data)

    def unregister(self, fileobj: Any) -> selectors.SelectorKey:
        return self._real.unregister(fileobj)

    def modify(self, fileobj: Any, events: int, data: Any = None) -> selectors.SelectorKey:
        return self._real.modify(fileobj, events, data)

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        return self._wait(self._real, timeout)

    def get_map(self) -> Mapping[Any, selectors.SelectorKey]:
        return self._real.get_map()

    def close(self) -> None:
        self._real.close()


class ScaledLoop(asyncio.SelectorEventLoop):
    """Time runs `factor` times as fast as the machine's; every process with one factor agrees on it."""

    def __init__(self, factor: float) -> None:
        if not factor > 0:
            raise ValueError(f"time factor {factor} is not positive")
        self._factor = factor
        super().__init__(PacedSelector(self._scaled_wait))

    def time(self) -> float:
        return time.monotonic() * self._factor

    def _scaled_wait(self, real: selectors.BaseSelector, timeout: float | None) -> list[Any]:
        return real.select(None if timeout is None else timeout / self._factor)


class VirtualLoop(asyncio.SelectorEventLoop):
    """Time starts at `start_s` and jumps to the next timer as soon as no socket is ready, no datagram is
    under way and nobody holds it.

    Who holds it and waits for something that hung would wait for ever: after `patience_s` of real time in
    which nothing happened time goes on until the holds end, so that time-outs do their work.  Each datagram
    has to come and go by `create_datagram_endpoint`.
    """

    def __init__(self, start_s: float = 1000.0, patience_s: float = HOLD_PATIENCE_S) -> None:
        self._now_s = start_s
        self._patience_s = patience_s
        self._holds = 0
        self._overdue = False
        self._in_flight: Counter[int] = Counter()  # local port -> datagrams sent to it, not yet received
        self._ports: dict[int, int] = {}  # local port -> fd
        self.lost_datagrams = 0
        super().__init__(PacedSelector(self._virtual_wait))

    def time(self) -> float:
        return self._now_s

    @contextlib.contextmanager
    def hold(self) -> Iterator[None]:
        """Keep time where it is while work outside the loop is awaited."""
        self._holds += 1
        try:
            yield
        finally:
            self._holds -= 1
            self._overdue = self._overdue and self._holds > 0

    async def create_datagram_endpoint(self, protocol_factory: Any, *args: Any, **kwargs: Any) -> Any:
        """As the base class, with each datagram between this loop's own endpoints counted."""
        transport, counted = await super().create_datagram_endpoint(
            lambda: _CountedProtocol(protocol_factory(), self), *args, **kwargs
        )
        return counted.transport_of(transport), counted.inner

    def datagram_sent(self, port: int | None) -> None:
        if port in self._ports:
            self._in_flight[port] += 1

    def datagram_received(self, port: int) -> None:
        if self._in_flight[port] > 0:
            self._in_flight[port] -= 1

    def endpoint_opened(self, port: int, fd: int) -> None:
        self._ports[port] = fd

    def endpoint_closed(self, port: int) -> None:
        self._ports.pop(port, None)
        self._in_flight.pop(port, None)

    def _virtual_wait(self, real: selectors.BaseSelector, timeout: float | None) -> list[Any]:
        events = self._settled(real)
        if events or timeout == 0:
            return events
        if timeout is None:
            return _in_order(real.select(None))
        if self._holds and not self._overdue:
            events = real.select(self._patience_s)
            if events:
                return _in_order(events)
            _LOG.warning("nothing happened in %g s while time was held: it goes on", self._patience_s)
            self._overdue = True
        self._now_s += timeout
        return []

    def _settled(self, real: selectors.BaseSelector) -> list[Any]:
        """Ready events, once every datagram under way has reached its socket."""
        deadline = None
        while True:
            events = real.select(0)
            under_way = [port for port, count in self._in_flight.items() if count]
            ready = {key.fd for key, _ in events} if under_way else set()
            missing = [port for port in under_way if self._ports[port] not in ready]
            if not missing:
                return _in_order(events)
            if deadline is None:
                deadline = time.monotonic() + _STRAGGLER_WAIT_S
            elif time.monotonic() > deadline:
                for port in missing:
                    self.lost_datagrams += self._in_flight.pop(port)
                return _in_order(events)
            time.sleep(0)  # let the kernel's own thread deliver


def _in_order(events: list[Any]) -> list[Any]:
    """Epoll's order depends on arrival; the file descriptors' does not."""
    return sorted(events, key=lambda event: event[0].fd) if len(events) > 1 else events


class _CountedTransport(asyncio.DatagramTransport):
    def __init__(self, inner: asyncio.DatagramTransport, loop: VirtualLoop) -> None:
        super().__init__()
        self._inner = inner
        self._loop = loop
        peer = inner.get_extra_info("peername")
        self._peer_port: int | None = peer[1] if isinstance(peer, tuple) else None

    def sendto(self, data: Any, addr: Any = None) -> None:
        self._inner.sendto(data, addr)
        if data:  # asyncio sends no empty datagrams
            self._loop.datagram_sent(addr[1] if isinstance(addr, tuple) else self._peer_port)

    def get_extra_info(self, name: str, default: Any = None) -> Any:
        return self._inner.get_extra_info(name, default)

    def get_write_buffer_size(self) -> int:
        size: int = self._inner.get_write_buffer_size()  # type: ignore[attr-defined]  # not in the stubs
        return size

    def close(self) -> None:
        self._inner.close()

    def abort(self) -> None:
        self._inner.abort()

    def is_closing(self) -> bool:
        return self._inner.is_closing()


class _CountedProtocol(asyncio.DatagramProtocol):
    def __init__(self, inner: Any, loop: VirtualLoop) -> None:
        self.inner = inner
        self._loop = loop
        self._port = 0
        self._transport: _CountedTransport | None = None

    def transport_of(self, transport: asyncio.DatagramTransport) -> _CountedTransport:
        if self._transport is None:
            self._transport = _CountedTransport(transport, self._loop)
        return self._transport

    def connection_made(self, transport: Any) -> None:
        sock = transport.get_extra_info("socket")
        name = transport.get_extra_info("sockname")
        if isinstance(name, tuple):
            self._port = name[1]
            self._loop.endpoint_opened(self._port, sock.fileno())
        self.inner.connection_made(self.transport_of(transport))

    def datagram_received(self, data: bytes, addr: Any) -> None:
        self._loop.datagram_received(self._port)
        self.inner.datagram_received(data, addr)

    def error_received(self, exc: Exception) -> None:
        self.inner.error_received(exc)

    def connection_lost(self, exc: Exception | None) -> None:
        self._loop.endpoint_closed(self._port)
        self.inner.connection_lost(exc)
