"""An MCAP file that is whole on disk after every flush and can be taken up again after a kill.

The records are those of the `mcap` package; its own writer cannot close a chunk on request, which is
what keeps the loss after `kill -9` to the last second.  Schemas and channels are written outside the
chunks: a damaged chunk takes no channel with it.
"""

from __future__ import annotations

import fcntl
import os
import zlib
from collections import Counter, deque
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO, Self

import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)

from flightd.adapters.recorder.mcap_chunk import MESSAGE_HEAD, Entries, OpenChunk, indexes_of, pack
from flightd.core.errors import InputError
from flightd.runtime.mcap_scan import (
    MAGIC,
    DamagedRecordError,
    RawRecord,
    inner_records,
    parse,
    raw_records,
    unpacked,
)

CHUNK_BYTES = 1 << 20
"""A chunk is closed when it holds this much, or sooner by `flush`."""

KEPT_BYTES = 8 << 20
"""What waits at most, in closed chunks, for a disk that refuses; beyond that the oldest is given up."""

_LIBRARY = "flightd"


class McapFile:
    """One log file open for writing; `create` a new one or `resume` one that was cut off.

    Every method that writes raises OSError when the disk refuses; the file then still ends with the
    last chunk that was written whole, and the next `flush` tries the failed ones again, oldest first.
    """

    def __init__(self, stream: BinaryIO) -> None:
        self._stream = stream
        self._end = 0
        self._schemas: dict[int, Schema] = {}
        self._channels: dict[int, Channel] = {}
        self._chunks: list[ChunkIndex] = []
        self._metadata: list[MetadataIndex] = []
        self._counts: Counter[int] = Counter()
        self._undeclared: list[McapRecord] = []
        self._open_chunk = OpenChunk()
        self._closed: deque[OpenChunk] = deque()
        self._compressor = zstandard.ZstdCompressor(level=1)

    @classmethod
    def create(cls, path: Path) -> Self:
        """A new file at `path`; what was there is replaced.  Errors as in `resume`."""
        with _claimed(path, os.O_CREAT) as stream:
            stream.truncate(0)
            file = cls(stream)
            file._begin()
            return file

    @classmethod
    def resume(cls, path: Path) -> Self:
        """Open `path` to write on behind its last whole record.

        InputError if it cannot be opened, is not one of flightd's logs, or is being written."""
        with _claimed(path) as stream:
            start = stream.read(len(MAGIC))
            if not MAGIC.startswith(start):
                raise InputError(f"{path}: not a flight log (no MCAP header)")
            file = cls(stream)
            if len(start) < len(MAGIC):
                file._begin()
            else:
                file._recover()
            return file

    @property
    def size(self) -> int:
        """Bytes on disk."""
        return self._end

    @property
    def messages(self) -> int:
        """Messages on disk."""
        return self._counts.total()

    @property
    def pending(self) -> int:
        """Messages taken but not yet on disk."""
        return self._open_chunk.messages + sum(chunk.messages for chunk in self._closed)

    def add_channel(self, channel_id: int, topic: str, schema_name: str, schema: str) -> None:
        """Introduce a channel (id > 0) of JSON messages; nothing happens if the file has it already.

        It is written by the next flush, ahead of the messages."""
        if channel_id in self._channels:
            return
        described = Schema(id=channel_id, data=schema.encode(), encoding="jsonschema", name=schema_name)
        channel = Channel(
            id=channel_id, topic=topic, message_encoding="json", metadata={}, schema_id=channel_id
        )
        self._schemas[channel_id], self._channels[channel_id] = described, channel
        self._undeclared += [described, channel]

    def add_metadata(self, name: str, metadata: Mapping[str, str]) -> None:
        record = pack(Metadata(name=name, metadata=dict(metadata)))
        self._metadata.append(MetadataIndex(offset=self._end, length=len(record), name=name))
        try:
            self._append(record)
        except OSError:
            self._metadata.pop()
            raise

    def add_message(self, channel_id: int, stamp_ns: int, payload: bytes) -> None:
        """Take one message into the open chunk."""
        self._open_chunk.add(channel_id, stamp_ns, payload)
        if self._open_chunk.size >= CHUNK_BYTES:
            self.flush()

    def flush(self) -> None:
        """Close the open chunk and write all that waits."""
        if self._open_chunk.messages:
            self._closed.append(self._open_chunk)
            self._open_chunk = OpenChunk()
        while len(self._closed) > 1 and sum(chunk.size for chunk in self._closed) > KEPT_BYTES:
            self._closed.popleft()
        if self._undeclared:
            self._append(pack(*self._undeclared))
            self._undeclared.clear()
        while self._closed:
            self._write(self._closed[0])
            self._closed.popleft()

    def sync(self) -> None:
        """Make what was flushed survive a loss of power."""
        os.fdatasync(self._stream.fileno())

    def close(self) -> None:
        """Flush, write the index that makes the file quick to search, close; what the disk still refuses
        is given up."""
        try:
            self.flush()
            self._append(self._summary())
        finally:
            self._closed.clear()
            self._stream.close()

    def _write(self, taken: OpenChunk) -> None:
        content = taken.content()
        chunk = Chunk(
            compression="zstd",
            data=self._compressor.compress(content),
            message_start_time=taken.first_ns,
            message_end_time=taken.last_ns,
            uncompressed_crc=zlib.crc32(content),
            uncompressed_size=len(content),
        )
        packed = pack(chunk)
        indexes, index = indexes_of(chunk, taken.index, self._end, len(packed))
        self._append(packed + indexes)
        self._chunks.append(index)
        self._counts.update({channel: len(entries) for channel, entries in taken.index.items()})

    def _begin(self) -> None:
        self._append(MAGIC + pack(Header(profile="", library=_LIBRARY)))

    def _append(self, data: bytes) -> None:
        """Write at the end, wholly or not at all."""
        view = memoryview(data)
        try:
            self._stream.seek(self._end)
            while view:
                view = view[self._stream.write(view) :]
        except OSError:
            self._stream.truncate(self._end)
            raise
        self._end += len(data)

    def _summary(self) -> bytes:
        builder = RecordBuilder()
        DataEnd(data_section_crc=0).write(builder)
        data_end: bytes = builder.end()
        start = self._end + len(data_end)
        groups: dict[Opcode, Sequence[McapRecord]] = {
            Opcode.SCHEMA: list(self._schemas.values()),
            Opcode.CHANNEL: list(self._channels.values()),
            Opcode.STATISTICS: [self._statistics()],
            Opcode.CHUNK_INDEX: self._chunks,
            Opcode.METADATA_INDEX: self._metadata,
        }
        offsets: list[SummaryOffset] = []
        for opcode, records in groups.items():
            before = builder.count
            for record in records:
                record.write(builder)
            if builder.count > before:
                offsets.append(SummaryOffset(opcode, start + before, builder.count - before))
        offsets_start = start + builder.count
        for offset in offsets:
            offset.write(builder)
        summary: bytes = builder.end()
        Footer(summary_start=start, summary_offset_start=offsets_start, summary_crc=0).write(builder)
        footer: bytes = builder.end()
        crc = zlib.crc32(footer[:-4], zlib.crc32(summary))
        return data_end + summary + footer[:-4] + crc.to_bytes(4, "little") + MAGIC

    def _statistics(self) -> Statistics:
        return Statistics(
            attachment_count=0,
            channel_count=len(self._channels),
            channel_message_counts=dict(self._counts),
            chunk_count=len(self._chunks),
            message_count=self._counts.total(),
            message_start_time=min((chunk.message_start_time for chunk in self._chunks), default=0),
            message_end_time=max((chunk.message_end_time for chunk in self._chunks), default=0),
            metadata_count=len(self._metadata),
            schema_count=len(self._schemas),
        )

    def _recover(self) -> None:
        """Rebuild the index from the records on disk and drop what is not whole."""
        descriptor = self._stream.fileno()
        size = os.fstat(descriptor).st_size
        records = raw_records(lambda offset, length: os.pread(descriptor, length, offset), len(MAGIC), size)
        self._check_origin(next(records, None))
        for record in records:
            if record.opcode == Opcode.DATA_END:
                break
            self._end = record.end
            with suppress(DamagedRecordError):  # it stays in the file but not in the index
                self._recover_record(record)
        self._stream.truncate(self._end)

    def _check_origin(self, first: RawRecord | None) -> None:
        if first is None:
            self._begin()
            return
        with suppress(DamagedRecordError):
            if first.opcode == Opcode.HEADER and parse(Header, first.content).library == _LIBRARY:
                self._end = first.end
                return
        raise InputError(f"{self._stream.name}: written by another program; only flightd's logs are mended")

    def _recover_record(self, record: RawRecord) -> None:
        if record.opcode == Opcode.SCHEMA:
            schema = parse(Schema, record.content)
            self._schemas[schema.id] = schema
        elif record.opcode == Opcode.CHANNEL:
            channel = parse(Channel, record.content)
            self._channels[channel.id] = channel
        elif record.opcode == Opcode.METADATA:
            name = parse(Metadata, record.content).name
            self._metadata.append(MetadataIndex(record.offset, record.end - record.offset, name))
        elif record.opcode == Opcode.CHUNK:
            self._recover_chunk(record)

    def _recover_chunk(self, record: RawRecord) -> None:
        """Index a chunk anew, for its message indexes may be cut off."""
        chunk = parse(Chunk, record.content)
        entries: Entries = {}
        for inner in inner_records(unpacked(chunk)):
            if inner.opcode == Opcode.MESSAGE:
                if len(inner.content) < MESSAGE_HEAD.size:
                    raise DamagedRecordError("a message is shorter than its head")
                channel_id, _, stamp_ns, _ = MESSAGE_HEAD.unpack_from(inner.content)
                entries.setdefault(channel_id, []).append((stamp_ns, inner.offset))
        indexes, index = indexes_of(chunk, entries, record.offset, record.end - record.offset)
        if os.pread(self._stream.fileno(), len(indexes), self._end) == indexes:
            self._end += len(indexes)
        else:
            self._append(indexes)
        self._chunks.append(index)
        self._counts.update({channel: len(found) for channel, found in entries.items()})


@contextmanager
def _claimed(path: Path, flags: int = 0) -> Iterator[BinaryIO]:
    """The file open for reading and writing and locked against other writers; closed again on errors."""
    try:
        stream = open(path, "rb+", buffering=0, opener=lambda name, mode: os.open(name, mode | flags, 0o644))  # noqa: SIM115
    except OSError as err:
        raise InputError(f"{path}: cannot open the log: {err.strerror}") from None
    try:
        fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
        yield stream
    except BlockingIOError:
        stream.close()
        raise InputError(f"{path}: is being written by another process; wait until it is done") from None
    except BaseException:
        stream.close()
        raise
