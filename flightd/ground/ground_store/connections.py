"""A few connections to a database, handed out and taken back."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Generic, Protocol, TypeVar

from flightd.core.errors import UnavailableError


class _Closable(Protocol):
    def close(self) -> None: ...


C = TypeVar("C", bound=_Closable)


class Connections(Generic[C]):
    """At most `most` at a time, made by `connect` as they are needed; who comes on top waits.  One that was
    idle is handed out where it `is_alive`."""

    def __init__(
        self,
        connect: Callable[[], C],
        most: int,
        wait_s: float,
        is_alive: Callable[[C], bool] = lambda _: True,
    ) -> None:
        self._connect = connect
        self._is_alive = is_alive
        self._wait_s = wait_s
        self._room = threading.BoundedSemaphore(most)
        self._lock = threading.Lock()
        self._idle: list[C] = []
        self._closed = False

    @contextmanager
    def one(self) -> Iterator[C]:
        """A connection meanwhile, closed where the block raises: nobody knows what state it is in.
        UnavailableError where none gets free."""
        if not self._room.acquire(timeout=self._wait_s):
            raise UnavailableError("too many questions to the store wait already", remedy="try again")
        try:
            connection = self._idle_one() or self._connect()
            try:
                yield connection
            except BaseException:
                connection.close()
                raise
            self._take_back(connection)
        finally:
            self._room.release()

    def close(self) -> None:
        """Close those that are idle; others when they come back."""
        with self._lock:
            self._closed, idle, self._idle = True, self._idle, []
        for connection in idle:
            connection.close()

    def _idle_one(self) -> C | None:
        while True:
            with self._lock:
                if not self._idle:
                    return None
                connection = self._idle.pop()
            if self._is_alive(connection):
                return connection
            connection.close()

    def _take_back(self, connection: C) -> None:
        with self._lock:
            if not self._closed:
                self._idle.append(connection)
                return
        connection.close()
