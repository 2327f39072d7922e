"""The process that writes the log: takes frames from a socket until it ends, so it outlives the daemon.

It ignores SIGINT and SIGTERM: when the daemon goes, however it goes, the socket closes and the log
is finished.  What a disk refuses waits for it, within bounds; beyond them it costs messages, never the
process.
"""

from __future__ import annotations

import base64
import select
import signal
import socket
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import msgspec

from flightd.adapters.recorder.foxglove import conforming
from flightd.adapters.recorder.mcap_file import McapFile
from flightd.adapters.recorder.writer_protocol import (
    PICTURE_SEQ,
    Definition,
    Kind,
    WireFrame,
    WriterTally,
    take_frames,
)
from flightd.runtime.niceness import give_way

FLUSH_S = 1.0
"""The most that a kill of this process loses."""

_RECEIVE_BYTES = 1 << 18
_NICENESS = 5


class LogWriter:
    """Puts frames into a file and keeps the tally of what reached the disk."""

    def __init__(self, file: McapFile) -> None:
        self._file = file
        self._found = file.messages
        self._append: dict[int, Callable[[bytes, int], bytes] | None] = {}
        self._taken = 0
        self._error = ""

    def tally(self) -> WriterTally:
        written = self._file.messages
        lost = self._found + self._taken - written - self._file.pending
        return WriterTally(found=self._found, written=written, lost=lost, error=self._error)

    def take(self, frame: WireFrame) -> None:
        try:
            self._put(frame)
        except OSError as err:
            self._error = err.strerror or str(err)

    def flush(self) -> None:
        try:
            self._file.flush()
            self._file.sync()
        except OSError as err:
            self._error = err.strerror or str(err)
        else:
            self._error = ""

    def close(self) -> None:
        self.flush()
        try:
            self._file.close()
        except OSError as err:
            self._error = err.strerror or str(err)

    def _put(self, frame: WireFrame) -> None:
        kind, channel, stamp_ns, payload = frame
        if kind == Kind.MESSAGE:
            self._taken += 1
            append = self._append.get(channel)
            self._file.add_message(channel, stamp_ns, append(payload, stamp_ns) if append else payload)
        elif kind == Kind.PICTURE:
            self._taken += 1
            self._file.add_message(channel, stamp_ns, _picture(stamp_ns, payload))
        elif kind == Kind.DEFINE:
            definition = msgspec.json.decode(payload, type=Definition)
            self._append[channel] = conforming(definition.schema_name)
            self._file.add_channel(channel, definition.topic, definition.schema_name, definition.schema)
        elif kind == Kind.METADATA:
            name, values = msgspec.json.decode(payload, type=tuple[str, dict[str, str]])
            self._file.add_metadata(name, values)


def _picture(stamp_ns: int, payload: bytes) -> bytes:
    (seq,) = PICTURE_SEQ.unpack_from(payload)
    seconds, nanoseconds = divmod(stamp_ns, 1_000_000_000)
    data = base64.b64encode(memoryview(payload)[PICTURE_SEQ.size :])
    head = (
        f'{{"timestamp":{{"sec":{seconds},"nsec":{nanoseconds}}},"frame_id":"down_camera",'
        f'"format":"jpeg","seq":{seq},"data":"'
    )
    return head.encode() + data + b'"}'


def serve(link: socket.socket, file: McapFile) -> None:
    """Write what comes down `link` until its end, with a tally after each flush."""
    writer = LogWriter(file)
    buffer = bytearray()
    flush_at_s = time.monotonic()
    while True:
        wait_s = max(0.0, flush_at_s - time.monotonic())
        if select.select([link], [], [], wait_s)[0]:
            try:
                received = link.recv(_RECEIVE_BYTES)
            except ConnectionError:  # the daemon was killed: what came is written, as at any end
                received = b""
            if not received:
                break
            buffer += received
            for frame in take_frames(buffer):
                writer.take(frame)
        if time.monotonic() >= flush_at_s:
            writer.flush()
            _tell(link, writer.tally())
            flush_at_s = time.monotonic() + FLUSH_S
    writer.close()
    _tell(link, writer.tally())


def _tell(link: socket.socket, tally: WriterTally) -> None:
    """Best effort: the daemon may be gone or not reading."""
    with suppress(OSError):
        link.send(msgspec.json.encode(tally) + b"\n", socket.MSG_DONTWAIT | socket.MSG_NOSIGNAL)


def main() -> None:
    """Arguments: the descriptor of the socket, `create` or `resume`, the path of the log."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    give_way(_NICENESS)
    descriptor, how, path = int(sys.argv[1]), sys.argv[2], Path(sys.argv[3])
    with socket.socket(fileno=descriptor) as link:
        serve(link, McapFile.resume(path) if how == "resume" else McapFile.create(path))


if __name__ == "__main__":
    main()
