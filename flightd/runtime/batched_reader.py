"""Reading a busy line in batches: waking the event loop costs several times what a message does."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

_BUSY_S = 0.003
"""Readings closer than this make a line busy."""
_BATCH_S = 0.010
"""A busy line is read so often: twice in a control tick.  What comes waits no longer, a tenth of what a
take-over may, and a time comparison still fits PX4's 10 ms nine times in ten."""


class PacedReader:
    """Calls `read` when there is something on a file descriptor, at once on a quiet line and every 10 ms on
    a busy one.  `read` takes what has come and returns in how many pieces; 0 when there was nothing."""

    def __init__(self, fd: int, read: Callable[[], int]) -> None:
        self._loop = asyncio.get_running_loop()
        self._fd = fd
        self._read = read
        self._read_s = -_BUSY_S
        self._timer: asyncio.TimerHandle | None = None
        self._closed = False
        self._loop.add_reader(fd, self._ready)

    def close(self) -> None:
        """Read no more; to be called before the descriptor is closed."""
        if self._closed:
            return
        self._closed = True
        if self._timer is None:
            self._loop.remove_reader(self._fd)
        else:
            self._timer.cancel()

    def _ready(self) -> None:
        now_s = self._loop.time()
        busy = now_s - self._read_s < _BUSY_S
        self._read_s = now_s
        self._read()
        if busy and not self._closed:
            self._loop.remove_reader(self._fd)
            self._wait()

    def _due(self) -> None:
        self._timer = None
        busy = True  # also when the reading fails: what comes behind it is still to be read
        try:
            busy = self._read() > 1
        finally:
            if not self._closed and busy:
                self._wait()
            elif not self._closed:
                self._loop.add_reader(self._fd, self._ready)

    def _wait(self) -> None:
        self._timer = self._loop.call_later(_BATCH_S, self._due)
