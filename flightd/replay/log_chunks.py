"""A flight log chunk by chunk: where each lies, and the messages of some of them, not yet decoded."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterable, Iterator
from pathlib import Path
from types import TracebackType
from typing import NamedTuple, Self

from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Metadata

from flightd.core.errors import InputError
from flightd.replay.log import check_is_log
from flightd.runtime.mcap_scan import (
    MAGIC,
    RECORD_HEAD,
    DamagedRecordError,
    RecordSpan,
    inner_records,
    parse,
    record_spans,
    unpacked,
)

_MESSAGE_HEAD = 22
"""Channel (2 bytes), sequence (4), log time (8), publish time (8)."""
_SMALL_BYTES = 1 << 16
"""Channel and metadata records are no longer; one that says so is passed over."""


class ChunkMessage(NamedTuple):
    """One message as it was recorded; `chunk_at` is its chunk's offset in the file, `inner_at` its own
    in the unpacked chunk."""

    topic: str
    stamp_ns: int
    chunk_at: int
    inner_at: int
    payload: bytes


class LogChunks:
    """A context manager.  `chunks` are in the order of the file; `whole`: it was closed as it should be.

    What is damaged is passed over.  InputError if it cannot be opened or is not MCAP."""

    def __init__(self, path: Path) -> None:
        check_is_log(path)
        try:
            self._stream = path.open("rb")
        except OSError as err:
            raise InputError(f"cannot open the flight log: {err.strerror}", file=path) from None
        self.chunks: list[RecordSpan] = []
        self.metadata: dict[str, str] = {}
        self.whole = False
        self._channels: dict[int, str] = {}
        self._size = os.fstat(self._stream.fileno()).st_size
        self._scan()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stream.close()

    def messages(
        self, chunks: Iterable[RecordSpan], topics: Collection[str] | None = None
    ) -> Iterator[ChunkMessage]:
        """The messages in these chunks, of all topics or of `topics`."""
        for span in chunks:
            for record in inner_records(self._unpacked(span)):
                if record.opcode == Opcode.MESSAGE and len(record.content) >= _MESSAGE_HEAD:
                    topic = self._channels.get(int.from_bytes(record.content[:2], "little"))
                    if topic is not None and (topics is None or topic in topics):
                        stamp_ns = int.from_bytes(record.content[6:14], "little")
                        payload = record.content[_MESSAGE_HEAD:]
                        yield ChunkMessage(topic, stamp_ns, span.offset, record.offset, payload)
                elif record.opcode in {Opcode.CHANNEL, Opcode.METADATA}:
                    self._take(record.opcode, record.content)

    def chunks_with(self, topic: str) -> list[RecordSpan]:
        """The chunks in which messages of a topic stand, as their indexes say; none is unpacked."""
        channels = {channel for channel, name in self._channels.items() if name == topic}
        found: dict[int, RecordSpan] = {}
        chunk: RecordSpan | None = None
        for span in record_spans(self._read_at, len(MAGIC), self._size) if channels else ():
            if span.opcode == Opcode.CHUNK:
                chunk = span
            elif span.opcode == Opcode.MESSAGE_INDEX and chunk is not None:
                if int.from_bytes(self._read_at(span.offset + RECORD_HEAD, 2), "little") in channels:
                    found[chunk.offset] = chunk
            elif span.opcode == Opcode.DATA_END:
                break
        return list(found.values())

    def payload_at(self, chunk_at: int, inner_at: int) -> bytes:
        """The payload of a message that was found before, empty where it is there no more."""
        span = next((span for span in self.chunks if span.offset == chunk_at), None)
        if span is None:
            return b""
        for record in inner_records(self._unpacked(span)):
            if record.offset == inner_at and record.opcode == Opcode.MESSAGE:
                return record.content[_MESSAGE_HEAD:]
        return b""

    def _scan(self) -> None:
        for span in record_spans(self._read_at, len(MAGIC), self._size):
            if span.opcode == Opcode.DATA_END:
                self.whole = True
                return
            if span.opcode == Opcode.CHUNK:
                self.chunks.append(span)
            elif span.opcode in {Opcode.CHANNEL, Opcode.METADATA} and span.end - span.offset < _SMALL_BYTES:
                self._take(span.opcode, self._content(span))

    def _take(self, opcode: int, content: bytes) -> None:
        try:
            if opcode == Opcode.CHANNEL:
                channel = parse(Channel, content)
                if channel.message_encoding == "json":
                    self._channels[channel.id] = channel.topic
            else:
                metadata = parse(Metadata, content)
                if metadata.name == "flightd":
                    self.metadata.update(metadata.metadata)
        except DamagedRecordError:
            return

    def _unpacked(self, span: RecordSpan) -> bytes:
        try:
            return unpacked(parse(Chunk, self._content(span)))
        except DamagedRecordError:
            return b""

    def _content(self, span: RecordSpan) -> bytes:
        at = span.offset + RECORD_HEAD
        return self._read_at(at, span.end - at)

    def _read_at(self, offset: int, length: int) -> bytes:
        return os.pread(self._stream.fileno(), length, offset)
