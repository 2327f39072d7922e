"""Whether the aisles are closed to people, read from a file: a GPIO's value, or what a controller writes."""

from __future__ import annotations

import asyncio
import os
import time
from pathlib import Path

from flightd.ports import Clock

_PERIOD_S = 0.1
_STALE_NS = 500_000_000
"""A reading this old says nothing: whoever reads hangs."""
_MOST_BYTES = 256


class FileInterlock:
    """`ports.Interlock` of one file; open until it was read, whenever that fails or takes long, and when it
    was not written for `max_age_s` (a controller that died goes on saying what it said last).  By the time
    of day only what was written before the first reading is judged: that is set, maybe in flight."""

    def __init__(self, path: Path, closed: str, clock: Clock, max_age_s: float | None = None) -> None:
        self._path = path
        self._closed = closed.strip()
        self._clock = clock
        self._max_age_s = max_age_s
        self._read_ns: int | None = None
        self._version: tuple[int, int] | None = None
        """Which file, and its time of change, as they were seen last."""
        self._written_ns = 0

    @property
    def is_closed(self) -> bool:
        """Whether the newest reading says so, and is fresh."""
        return self._read_ns is not None and self._clock.now_ns() - self._read_ns <= _STALE_NS

    async def run(self) -> None:
        """Read until cancelled, beside the loop: a file may hang."""
        while True:
            now_ns = self._clock.now_ns()
            closed = await asyncio.to_thread(self.says_closed, now_ns)
            self._read_ns = now_ns if closed else None
            await asyncio.sleep(_PERIOD_S)

    def says_closed(self, now_ns: int) -> bool:
        """Whether the file says so now; may hang."""
        try:
            with self._path.open("rb") as file:
                text = file.read(_MOST_BYTES)
                stat = os.fstat(file.fileno())
        except OSError:
            return False
        if self._max_age_s is not None and self._age_s(stat, now_ns) > self._max_age_s:
            return False
        return text.decode("utf-8", "replace").strip() == self._closed

    def _age_s(self, stat: os.stat_result, now_ns: int) -> float:
        """For how long it has not been written."""
        version = stat.st_ino, stat.st_mtime_ns
        if self._version is None:
            # one of the future is of a clock that was set
            self._written_ns = now_ns - abs(time.time_ns() - stat.st_mtime_ns)
        elif version != self._version:
            self._written_ns = now_ns
        self._version = version
        return (now_ns - self._written_ns) * 1e-9
