"""The daemon's side of the black box: encode, hand over, never wait."""

from __future__ import annotations

import asyncio
import fcntl
import os
import select
import socket
import subprocess
import sys
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Protocol, Self, TypeAlias

import msgspec

import flightd
from flightd.adapters.recorder.schemas import encode, picture_schema, schema_of
from flightd.adapters.recorder.writer_protocol import HEADER, PICTURE_SEQ, Definition, Kind, WriterTally
from flightd.core.errors import UnavailableError
from flightd.core.topics import RETAINED, Topic
from flightd.core.types import Event, EventLevel
from flightd.runtime.undisturbed_start import undisturbed

QUEUE_BYTES = 8 << 20
"""What may wait for the writing process; pictures may fill half of it, so that they are lost first."""

PUSH_S = 0.1
"""`run` hands over what waits at least this often."""

RESTART_S = 1.0
"""A writing process that dies at once is started again no sooner than this."""

CLOSE_S = 10.0
"""How long `close` waits for the writing process to finish the file."""

_PUSH_BYTES = 16 << 10


class Outbox(Protocol):
    """What waits for the writing process."""

    @property
    def waiting_bytes(self) -> int: ...

    def push(self) -> None:
        """Hand over what the writing process takes now."""
        ...

    def await_writer(self, patience_s: float) -> bool:
        """Wait until it may take more; False when it has died or takes nothing for so long."""
        ...


WhenFull: TypeAlias = Callable[[Outbox, int], None]
"""What is done when no more than so many bytes may wait for a message to find room."""


def drop_newest(outbox: Outbox, most_bytes: int) -> None:
    """Nothing: a flight goes on, what finds the queue full is dropped and counted."""


def wait_for_disk(outbox: Outbox, most_bytes: int) -> None:
    """Wait until there is room: for a simulation, whose time can wait, and for tools."""
    while outbox.waiting_bytes > max(most_bytes, 0):
        if not outbox.await_writer(CLOSE_S):
            return
        outbox.push()


class McapRecorder:
    """Writes a flight log (MCAP) through a process of its own.

    `record` and `image` are synchronous and take microseconds: they encode into a bounded queue that
    goes to the writing process by a non-blocking socket; `when_full` says what becomes of a message
    that finds it full.  Stamps are the caller's; wall time decides nothing.

    `run` hands over what waits, and brings the writing process back when it died: the new one goes on
    in the same file.  Without `run` the queue is handed over in larger pieces and by `close`.
    """

    def __init__(
        self,
        path: Path,
        *,
        metadata: Mapping[str, str] | None = None,
        queue_bytes: int = QUEUE_BYTES,
        when_full: WhenFull = drop_newest,
    ) -> None:
        """Open `path` for a new log; UnavailableError if it cannot be written."""
        self._path = path
        self._queue_bytes = queue_bytes
        self._when_full = when_full
        self._queue = bytearray()
        self._channels: dict[str, int] = {}
        self._definitions: list[bytes] = []
        self._retained: dict[str, bytes] = {}
        self._answers = bytearray()
        self._tally = WriterTally(found=0, written=0, lost=0, error="")
        self._newest_ns = 0
        self._accepted = 0
        self._accepted_before = 0
        self._refused = 0
        self._restarts = 0
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            with path.open("ab") as probe:
                fcntl.flock(probe, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise UnavailableError(f"{path}: another process is writing this flight log") from None
        except OSError as err:
            raise UnavailableError(f"{path}: cannot write the flight log: {err.strerror}") from None
        self._metadata = _metadata({"version": flightd.__version__, **(metadata or {})})
        self._start("create")

    @property
    def written(self) -> int:
        """Messages on disk, as the writing process last said (about once a second, and by `close`)."""
        return self._tally.written

    @property
    def dropped(self) -> int:
        """Messages lost: the queue was full, the disk refused, or the writing process died with them."""
        lost_with_process = self._accepted_before - self._tally.found
        return self._refused + lost_with_process + self._tally.lost

    @property
    def path(self) -> Path:
        return self._path

    @property
    def pid(self) -> int:
        """The writing process."""
        return self._child.pid

    @property
    def restarts(self) -> int:
        """How often the writing process died and was brought back."""
        return self._restarts

    @property
    def error(self) -> str:
        """Why the disk refused, "" while it does not."""
        return self._tally.error

    def record(self, topic: str, stamp_ns: int, message: object) -> None:
        """Take a message: a dataclass of plain fields or a dict.  TypeError if it has no JSON form."""
        payload = encode(message)
        self._newest_ns = max(self._newest_ns, stamp_ns)
        channel = self._channels.get(topic)
        if channel is None:
            name, schema = schema_of(message)
            channel = self._define(topic, name, msgspec.json.encode(schema))
        frame = _frame(Kind.MESSAGE, channel, stamp_ns, payload)
        if topic in RETAINED:
            self._retained[topic] = frame
        self._put(frame, self._queue_bytes)

    def image(self, topic: str, stamp_ns: int, seq: int, jpeg: bytes) -> None:
        """Take a JPEG picture, frame number `seq`, exposed at `stamp_ns`."""
        channel = self._channels.get(topic)
        if channel is None:
            name, schema = picture_schema()
            channel = self._define(topic, name, msgspec.json.encode(schema))
        frame = _frame(Kind.PICTURE, channel, stamp_ns, PICTURE_SEQ.pack(seq) + jpeg)
        self._put(frame, self._queue_bytes // 2)

    @property
    def waiting_bytes(self) -> int:
        """What the writing process has not taken yet."""
        return len(self._queue)

    def await_writer(self, patience_s: float) -> bool:
        """Block until it may take more; False when it has died or takes nothing for so long."""
        _, writable, _ = select.select([], [self._link], [], patience_s)
        return bool(writable) and self._child.poll() is None

    async def run(self) -> None:
        """Hand over what waits, and bring the writing process back whenever it died, for ever.

        A death is no error here: it costs messages (`dropped`), is written into the log as an event and
        told by `restarts`, and the flight goes on."""
        while True:
            await asyncio.sleep(PUSH_S)
            self.push()
            if self._child.poll() is not None:
                self._restart()
                await asyncio.sleep(RESTART_S)

    def close(self) -> None:
        """Hand over everything, wait until the file is finished; idempotent.

        Blocks for up to CLOSE_S when the disk is slow; a writer that needs longer goes on by itself."""
        if self._link.fileno() < 0:
            return
        if self._child.poll() is not None:
            self._restart()
        if self.dropped:
            self._queue += _metadata({"dropped": str(self.dropped)})
        with suppress(OSError):
            self._link.settimeout(CLOSE_S)
            self._link.sendall(self._queue)
            self._queue.clear()
            self._link.shutdown(socket.SHUT_WR)
            while answer := self._link.recv(1 << 16):
                self._answers += answer
        self._read_answers()
        self._link.close()
        with suppress(subprocess.TimeoutExpired):
            self._child.wait(CLOSE_S)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, err: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _define(self, topic: str, schema_name: str, schema: bytes) -> int:
        channel = self._channels[topic] = len(self._channels) + 1
        definition = msgspec.json.encode(Definition(topic, schema_name, schema.decode()))
        frame = _frame(Kind.DEFINE, channel, 0, definition)
        self._definitions.append(frame)
        self._queue += frame
        return channel

    def _put(self, frame: bytes, limit: int) -> None:
        if len(self._queue) + len(frame) > limit:
            self.push()
            self._when_full(self, limit - len(frame))
            if len(self._queue) + len(frame) > limit:
                self._refused += 1
                return
        self._accepted += 1
        self._queue += frame
        if len(self._queue) >= _PUSH_BYTES:
            self.push()

    def push(self) -> None:
        """Send what the socket takes now."""
        try:
            while self._queue:
                sent = self._link.send(self._queue)
                del self._queue[:sent]
        except BlockingIOError:
            pass
        except OSError:  # the writing process is gone; `run` and `close` start another
            return
        with suppress(OSError):
            while answer := self._link.recv(1 << 16):
                self._answers += answer
        self._read_answers()

    def _read_answers(self) -> None:
        *lines, rest = self._answers.split(b"\n")
        self._answers = bytearray(rest)
        if lines:
            with suppress(msgspec.DecodeError):  # a line that did not fit the socket came in part
                self._tally = msgspec.json.decode(lines[-1], type=WriterTally)

    def _restart(self) -> None:
        """Go on in the same file; what waited is given up, for its front may be half of a frame."""
        self._link.close()
        code = self._child.wait()
        self._restarts += 1
        self._accepted_before = self._accepted
        self._tally = WriterTally(found=self._tally.written, written=self._tally.written, lost=0, error="")
        self._answers.clear()
        self._queue.clear()
        self._start("resume")
        self._queue += b"".join((*self._definitions, *self._retained.values()))
        self._accepted += len(self._retained)
        text = f"the writer of the flight log died (exit code {code}) and was started again"
        event = Event(self._newest_ns, EventLevel.WARNING, "recorder_died", text)
        self.record(Topic.EVENT, self._newest_ns, event)

    def _start(self, how: str) -> None:
        self._link, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_STREAM)
        self._link.setblocking(False)
        package_root = str(Path(flightd.__file__).parents[1])
        search_path = os.pathsep.join(filter(None, (package_root, os.environ.get("PYTHONPATH"))))
        with theirs, undisturbed():
            self._child = subprocess.Popen(  # noqa: S603
                [
                    sys.executable,
                    "-m",
                    "flightd.adapters.recorder.writer_process",
                    str(theirs.fileno()),
                    how,
                    self._path,
                ],
                pass_fds=(theirs.fileno(),),
                stdin=subprocess.DEVNULL,
                env=os.environ | {"PYTHONPATH": search_path},
            )
        self._queue += self._metadata


def _frame(kind: Kind, channel: int, stamp_ns: int, payload: bytes) -> bytes:
    return HEADER.pack(len(payload), kind, channel, max(stamp_ns, 0)) + payload


def _metadata(values: Mapping[str, str]) -> bytes:
    return _frame(Kind.METADATA, 0, 0, msgspec.json.encode(("flightd", values)))
