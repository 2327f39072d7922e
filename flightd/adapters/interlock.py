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
    was not written for `max_age_s` (a controller that died goes on saying what it said last)."""

    def __init__(self, path: Path, closed: str, clock: Clock, max_age_s: float | None = None) -> None:
        self._path = path
        self._closed = closed.strip()
        self._clock = clock
        self._max_age_s = max_age_s
        self._read_ns: int | None = None

    @property
    def is_closed(self) -> bool:
        """Whether the newest reading says so, and is fresh."""
        return self._read_ns is not None and self._clock.now_ns() - self._read_ns <= _STALE_NS

    async def run(self) -> None:
        """Read until cancelled, beside the loop: a file may hang."""
        while True:
            now_ns = self._clock.now_ns()
            self._read_ns = now_ns if await asyncio.to_thread(self._says_closed) else None
            await asyncio.sleep(_PERIOD_S)

    def _says_closed(self) -> bool:
        try:
            with self._path.open("rb") as file:
                text = file.read(_MOST_BYTES)
                age_s = time.time() - os.fstat(file.fileno()).st_mtime
        except OSError:
            return False
        # one of the future is of a clock that was set
        if self._max_age_s is not None and abs(age_s) > self._max_age_s:
            return False
        return text.decode("utf-8", "replace").strip() == self._closed
