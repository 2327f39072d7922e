"""The audit log: every command that anybody sent, as lines of JSON, written by a thread of its own."""

from __future__ import annotations

import os
import queue
import threading
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path

import msgspec

from flightd.core.errors import UnavailableError

_WAITING = 1000
_ROTATE_BYTES = 16 << 20
_CLOSE_S = 2.0


class AuditEntry(msgspec.Struct, frozen=True):
    """One command: who sent what from where, and what came of it (accepted, repeated or a refusal's code).
    `node` holds the nodes of a plan, with commas."""

    client: str
    role: str
    address: str
    id: str
    command: str
    node: str
    outcome: str
    text: str


class AuditLog:
    """Appends to `path`; a file that grows past 16 MB becomes `path.1` (replacing the one before).

    `write` never waits: a slow disk fills a bounded queue, then entries are lost and counted in
    `dropped`, as are those that the disk refuses.  Each line is synced before the next is taken.
    """

    def __init__(self, path: Path, rotate_bytes: int = _ROTATE_BYTES, waiting: int = _WAITING) -> None:
        """UnavailableError if the file cannot be written."""
        self._path = path
        self._rotate_bytes = rotate_bytes
        self._queue: queue.Queue[bytes | None] = queue.Queue(waiting)
        self.dropped = 0
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._open()
        except OSError as err:
            raise UnavailableError(
                f"cannot write the audit log: {err.strerror}",
                file=path,
                key="ground.audit",
                remedy="make it and its folder writable for the user who runs this",
            ) from None
        self._thread = threading.Thread(target=self._write_all, name="audit", daemon=True)
        self._thread.start()

    def write(self, entry: msgspec.Struct) -> None:
        """Take an entry, of whatever fields; the time is now, UTC."""
        stamped = {"time": f"{datetime.now(UTC):%Y-%m-%dT%H:%M:%S.%fZ}", **msgspec.to_builtins(entry)}
        try:
            self._queue.put_nowait(msgspec.json.encode(stamped) + b"\n")
        except queue.Full:
            self.dropped += 1

    def close(self) -> None:
        """Write what waits; gives up on a disk that hangs."""
        try:
            self._queue.put(None, timeout=_CLOSE_S)
        except queue.Full:
            return
        self._thread.join(_CLOSE_S)

    def _open(self) -> None:
        self._fd = os.open(self._path, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o640)
        self._size = os.fstat(self._fd).st_size

    def _write_all(self) -> None:
        while (line := self._queue.get()) is not None:
            try:
                self._write(line)
            except OSError:
                self.dropped += 1
        os.close(self._fd)

    def _write(self, line: bytes) -> None:
        if self._size + len(line) > self._rotate_bytes:
            full = self._fd
            with suppress(FileNotFoundError):  # put aside already, and then no new one could be made
                self._path.replace(self._path.with_name(self._path.name + ".1"))
            self._open()
            os.close(full)
        self._size += os.write(self._fd, line)
        os.fsync(self._fd)
