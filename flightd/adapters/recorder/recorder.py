"""The daemon's side of the black box: encode, hand over, never wait."""

from __future__ import annotations

import asyncio
import fcntl
import os
import select
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Protocol, Self, TypeAlias

import msgspec

import flightd
from flightd.adapters.recorder.schemas import encode, picture_schema, schema_of
from flightd.adapters.recorder.writer_protocol import (
    HEADER,
    MESSAGES,
    PICTURE_SEQ,
    Definition,
    Kind,
    WriterTally,
    frames_within,
)
from flightd.adapters.recorder.writer_watch import HUNG_S, WriterWatch
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
"""The most that `close` takes in all, below the stop's time-out of the service."""

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

    `run` hands over what waits, kills a writing process that tells nothing for `hung_s`, and brings it back
    when it died: the new one goes on in the same file, with what waited.  Without `run` the queue is handed
    over in larger pieces and by `close`.
    """

    def __init__(
        self,
        path: Path,
        *,
        metadata: Mapping[str, str] | None = None,
        queue_bytes: int = QUEUE_BYTES,
        when_full: WhenFull = drop_newest,
        hung_s: float = HUNG_S,
    ) -> None:
        """Open `path` for a new log; UnavailableError if it cannot be written."""
        self._path = path
        self._queue_bytes = queue_bytes
        self._when_full = when_full
        self._queue = bytearray()
        self._sent = 0
        """Bytes of the first frame in the queue that the socket has taken already."""
        self._waiting = 0
        """Messages in the queue."""
        self._head_bytes = 0
        """What of the queue's front repeats to a new writer what an earlier one knew."""
        self._closed = False
        self._watch = WriterWatch(hung_s)
        self._starting = threading.Lock()
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
        self._queue += self._metadata
        with self._starting:
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
        """Why the log is not written, "" while it is: the disk refuses or does not answer, or a message found
        no room."""
        return self._tally.error or self._watch.trouble(time.monotonic())

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
        if not self._put(frame, self._queue_bytes):
            self._watch.refuse(time.monotonic())

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
        """Hand over what waits, and bring the writing process back whenever it died or hangs, for ever.

        That is no error here: it costs messages (`dropped`), is written into the log as an event and told by
        `restarts`, and the flight goes on.  One that the system cannot kill is trouble (`error`)."""
        while True:
            await asyncio.sleep(PUSH_S)
            self.push()
            now_s = time.monotonic()
            if self._child.poll() is not None:
                self._give_up()
                await asyncio.to_thread(self._start_again)
                await asyncio.sleep(RESTART_S)
            elif self._watch.hangs(now_s):
                self._watch.kill(now_s)
                self._child.kill()

    def close(self) -> None:
        """Hand over everything, wait until the file is finished; idempotent.

        Blocks for up to CLOSE_S when the disk is slow; a writer that needs longer goes on by itself."""
        due_s = time.monotonic() + CLOSE_S
        with self._starting:
            if self._closed:
                return
            self._closed = True
            if self._child.poll() is not None:
                self._give_up()
                self._start("resume")
        if self.dropped:
            self._queue += _metadata({"dropped": str(self.dropped)})
        with suppress(OSError):
            self._link.settimeout(_until(due_s))
            self._link.sendall(self._queue[self._sent :])
            self._queue.clear()
            self._link.shutdown(socket.SHUT_WR)
            while answer := self._link.recv(1 << 16):
                self._answers += answer
                self._link.settimeout(_until(due_s))
        self._read_answers()
        self._link.close()
        with suppress(subprocess.TimeoutExpired):
            self._child.wait(_until(due_s))

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

    def _put(self, frame: bytes, limit: int) -> bool:
        """Whether there was room for it."""
        if len(self._queue) + len(frame) > limit:
            self.push()
            self._when_full(self, limit - len(frame))
            if len(self._queue) + len(frame) > limit:
                self._refused += 1
                return False
        self._accepted += 1
        self._waiting += 1
        self._queue += frame
        if len(self._queue) >= _PUSH_BYTES:
            self.push()
        return True

    def push(self) -> None:
        """Send what the socket takes now."""
        try:
            while self._queue:
                with memoryview(self._queue) as queue, queue[self._sent :] as rest:
                    sent = self._link.send(rest)
                self._forget(self._sent + sent)
        except BlockingIOError:
            pass
        except OSError:  # the writing process is gone; `run` and `close` start another
            return
        with suppress(OSError):
            while answer := self._link.recv(1 << 16):
                self._answers += answer
        self._read_answers()

    def _forget(self, taken: int) -> None:
        """The first bytes of the queue were taken: the whole frames among them wait no more."""
        end = 0
        for kind, frame_end in frames_within(self._queue, taken):
            self._waiting -= kind in MESSAGES
            end = frame_end
        del self._queue[:end]
        self._sent = taken - end
        self._head_bytes = max(self._head_bytes - end, 0)

    def _read_answers(self) -> None:
        *lines, rest = self._answers.split(b"\n")
        self._answers = bytearray(rest)
        if lines:
            self._watch.hear(time.monotonic())
            with suppress(msgspec.DecodeError):  # a line that did not fit the socket came in part
                self._tally = msgspec.json.decode(lines[-1], type=WriterTally)

    def _give_up(self) -> None:
        """Let a writer go that died, and get ready to go on in the same file; what it did not take wholly
        waits for the next one."""
        if self._link.fileno() < 0:
            return
        self._link.close()
        code, hung = self._child.wait(), self._watch.was_killed
        self._restarts += 1
        waited = self._waiting
        self._forget(self._head_bytes)
        self._accepted -= waited - self._waiting  # nobody recorded what only repeats
        self._accepted_before = self._accepted - self._waiting
        self._tally = WriterTally(found=self._tally.written, written=self._tally.written, lost=0, error="")
        self._answers.clear()
        head = b"".join((self._metadata, *self._definitions, *self._retained.values()))
        self._queue[:0], self._head_bytes = head, len(head)
        self._accepted += len(self._retained)
        self._waiting += len(self._retained)
        why = "took nothing any more" if hung else f"died (exit code {code})"
        text = f"the writer of the flight log {why} and was started again"
        event = Event(self._newest_ns, EventLevel.WARNING, "recorder_died", text)
        self.record(Topic.EVENT, self._newest_ns, event)

    def _start_again(self) -> None:
        """In a thread, beside whatever is recorded meanwhile, unless `close` was first: its `run` may be
        cancelled, this cannot be, and of two that write one file the second dies."""
        with self._starting:
            if not self._closed:
                self._start("resume")

    def _start(self, how: str) -> None:
        """Begin a writing process; `_starting` is held."""
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_STREAM)
        ours.setblocking(False)
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
            self._watch.begin(time.monotonic())
            self._link = ours


def _until(due_s: float) -> float:
    """What is left until then, by the monotonic clock; never 0, by which a socket would not wait at all."""
    return max(due_s - time.monotonic(), 0.001)


def _frame(kind: Kind, channel: int, stamp_ns: int, payload: bytes) -> bytes:
    return HEADER.pack(len(payload), kind, channel, max(stamp_ns, 0)) + payload


def _metadata(values: Mapping[str, str]) -> bytes:
    return _frame(Kind.METADATA, 0, 0, msgspec.json.encode(("flightd", values)))
