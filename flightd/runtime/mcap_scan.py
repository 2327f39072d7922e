"""Walk through an MCAP file that may be cut off, damaged or hostile.

Only whole records are seen, nothing is read or unpacked that is larger than the file can hold or the
limit allows, and whatever the record parsers make of wrong bytes becomes a `DamagedRecordError`.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable, Iterator
from io import BytesIO
from typing import NamedTuple, Protocol, TypeAlias, TypeVar

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.records import Chunk

MAGIC = b"\x89MCAP0\r\n"
RECORD_HEAD = 9
"""Bytes ahead of a record's content: opcode and length."""

LIMIT_BYTES = 256 << 20
"""No record, packed or unpacked, is larger; one that says so is damaged."""

ReadAt: TypeAlias = Callable[[int, int], bytes]
"""Offset and length to bytes."""

RecordT_co = TypeVar("RecordT_co", covariant=True)


class RawRecord(NamedTuple):
    """One record as it lies in the file; `end` is the offset behind it."""

    offset: int
    end: int
    opcode: int
    content: bytes


class RecordSpan(NamedTuple):
    """Where one whole record lies in the file; its content begins `RECORD_HEAD` behind `offset`."""

    offset: int
    end: int
    opcode: int


class DamagedRecordError(Exception):
    """A record that is not what its opcode says."""


class RecordType(Protocol[RecordT_co]):
    """A record class of the `mcap` package."""

    @staticmethod
    def read(stream: ReadDataStream) -> RecordT_co: ...


def record_spans(read_at: ReadAt, start: int, size: int) -> Iterator[RecordSpan]:
    """Where the whole records from `start` on lie, up to the first that does not fit into `size` bytes;
    only their heads are read."""
    offset = start
    while offset + RECORD_HEAD <= size:
        head = read_at(offset, RECORD_HEAD)
        if len(head) < RECORD_HEAD:
            return
        content_at = offset + RECORD_HEAD
        end = content_at + int.from_bytes(head[1:], "little")
        if end > size or end - content_at > LIMIT_BYTES:
            return
        yield RecordSpan(offset, end, head[0])
        offset = end


def raw_records(read_at: ReadAt, start: int, size: int) -> Iterator[RawRecord]:
    """The whole records from `start` on, up to the first that does not fit into `size` bytes."""
    for offset, end, opcode in record_spans(read_at, start, size):
        content_at = offset + RECORD_HEAD
        content = read_at(content_at, end - content_at)
        if len(content) < end - content_at:
            return
        yield RawRecord(offset, end, opcode, content)


def parse(kind: RecordType[RecordT_co], content: bytes) -> RecordT_co:
    """A record's content as a record of that class; DamagedRecordError if it is none."""
    try:
        return kind.read(ReadDataStream(BytesIO(content)))
    except (McapError, struct.error, ValueError, OverflowError, MemoryError) as err:
        raise DamagedRecordError(f"{type(err).__name__} in a record") from None


def unpacked(chunk: Chunk) -> bytes:
    """The records inside a chunk; DamagedRecordError if they cannot be had whole and unchanged."""
    if chunk.uncompressed_size > LIMIT_BYTES:
        raise DamagedRecordError("a chunk says that it is too large")
    try:
        content = _decompress(chunk)
    except (zstandard.ZstdError, ValueError, MemoryError) as err:
        raise DamagedRecordError(f"{type(err).__name__} in a chunk") from None
    if len(content) != chunk.uncompressed_size:
        raise DamagedRecordError("a chunk is not as long as it says")
    if chunk.uncompressed_crc and zlib.crc32(content) != chunk.uncompressed_crc:
        raise DamagedRecordError("a chunk's checksum is wrong")
    return content


def _decompress(chunk: Chunk) -> bytes:
    if chunk.compression == "zstd":
        # the frame's own word on its size decides what is allocated
        if zstandard.frame_content_size(chunk.data) not in {-1, chunk.uncompressed_size}:
            raise DamagedRecordError("a chunk contradicts itself about its size")
        return zstandard.ZstdDecompressor().decompress(chunk.data, chunk.uncompressed_size)
    if chunk.compression == "":
        return chunk.data
    raise DamagedRecordError(f"a chunk is packed by {chunk.compression!r}")


def inner_records(content: bytes) -> Iterator[RawRecord]:
    """The records inside an unpacked chunk, as `raw_records` but without a call for each: they are many."""
    offset, size = 0, len(content)
    while (content_at := offset + RECORD_HEAD) <= size:
        end = content_at + int.from_bytes(content[offset + 1 : content_at], "little")
        if end > size or end - content_at > LIMIT_BYTES:
            return
        yield RawRecord(offset, end, content[offset], content[content_at:end])
        offset = end
