"""A small file that keeps what was told last, and survives a power cut."""

from __future__ import annotations

import asyncio
import contextlib
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Generic, TypeVar

from flightd.core.errors import TransientError
from flightd.runtime.disk_threads import on_disk
from flightd.runtime.durable_files import replace_file
from flightd.runtime.latest_slot import Latest
from flightd.runtime.within import Within

T = TypeVar("T")

_LAST_WRITE_S = 2.0


class KeptFile(Generic[T]):
    """`put` from the tick, `run` beside it.  What is put last is what is written, as `encode` says; `what`
    it is in an error."""

    def __init__(self, path: Path, what: str, encode: Callable[[T], str]) -> None:
        self._path, self._what, self._encode = path, what, encode
        self._changed: Latest[bool] = Latest()
        self._writing = threading.Lock()
        self._put: T | None = None
        self._written: T | None = None

    def put(self, value: T) -> None:
        """What is so now; cheap when nothing has changed."""
        if value != self._put:
            self._put = value
            self._changed.put(True)

    async def run(self) -> None:
        """Write each change until cancelled, the last one too.  TransientError when the disk refuses.

        The loop never waits for the disk, at the end neither: the vehicle is being handed back then."""
        try:
            while True:
                await self._changed.get()
                await on_disk(self._write)
        except asyncio.CancelledError:
            # ending comes before saving what a disk refuses, or takes too long for
            with contextlib.suppress(TransientError, TimeoutError):
                async with Within(_LAST_WRITE_S):
                    await on_disk(self._write)
            raise

    def _write(self) -> None:
        """Bring the file up to what was put last, whoever comes last."""
        with self._writing:
            value = self._put
            if value is not None and value != self._written:
                self._replace(self._encode(value))
                self._written = value

    def _replace(self, text: str) -> None:
        beside = self._path.with_suffix(self._path.suffix + ".new")
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            replace_file(self._path, beside, f"{text}\n".encode())
        except OSError as err:
            raise TransientError(f"{self._what} {self._path}: {err.strerror or err}") from err
