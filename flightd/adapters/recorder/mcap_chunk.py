"""The chunks of an MCAP file and the indexes that go with them."""

from __future__ import annotations

import struct
from typing import TypeAlias

from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import Chunk, ChunkIndex, McapRecord, MessageIndex

_RECORD_HEAD = struct.Struct("<BQ")
MESSAGE_HEAD = struct.Struct("<HIQQ")
"""Channel, sequence, log time, publish time; then the payload."""

Entries: TypeAlias = dict[int, list[tuple[int, int]]]
"""Channel to the (stamp, offset in the chunk) of its messages."""


class OpenChunk:
    """The messages of the chunk that is being filled."""

    def __init__(self) -> None:
        self._parts: list[bytes] = []
        self.size = 0
        self.messages = 0
        self.index: Entries = {}
        self.first_ns = 0
        self.last_ns = 0

    def add(self, channel_id: int, stamp_ns: int, payload: bytes) -> None:
        head = _RECORD_HEAD.pack(Opcode.MESSAGE, MESSAGE_HEAD.size + len(payload))
        head += MESSAGE_HEAD.pack(channel_id, 0, stamp_ns, stamp_ns)
        self.index.setdefault(channel_id, []).append((stamp_ns, self.size))
        self._parts += (head, payload)
        self.size += len(head) + len(payload)
        self.first_ns = min(self.first_ns, stamp_ns) if self.messages else stamp_ns
        self.last_ns = max(self.last_ns, stamp_ns)
        self.messages += 1

    def content(self) -> bytes:
        return b"".join(self._parts)


def indexes_of(chunk: Chunk, entries: Entries, offset: int, length: int) -> tuple[bytes, ChunkIndex]:
    """The message index records that follow the chunk of `length` bytes at `offset`, and its own index."""
    builder = RecordBuilder()
    positions = {}
    for channel_id, found in entries.items():
        positions[channel_id] = offset + length + builder.count
        MessageIndex(channel_id=channel_id, records=found).write(builder)
    packed: bytes = builder.end()
    index = ChunkIndex(
        chunk_length=length,
        chunk_start_offset=offset,
        compression=chunk.compression,
        compressed_size=len(chunk.data),
        message_end_time=chunk.message_end_time,
        message_index_length=len(packed),
        message_index_offsets=positions,
        message_start_time=chunk.message_start_time,
        uncompressed_size=chunk.uncompressed_size,
    )
    return packed, index


def pack(*records: McapRecord) -> bytes:
    """Records as they stand in a file, one after the other."""
    builder = RecordBuilder()
    for record in records:
        record.write(builder)
    packed: bytes = builder.end()
    return packed
