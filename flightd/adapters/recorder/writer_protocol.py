"""The frames between the daemon and the process that writes its log.

Each frame is a header and a payload.  DEFINE introduces a channel (payload: JSON of `Definition`),
MESSAGE carries one JSON message of a channel, PICTURE a sequence number and a JPEG, METADATA a JSON
list of a name and an object of strings.  The writer answers with lines of JSON, one `WriterTally` each.
"""

from __future__ import annotations

import enum
import struct
from collections.abc import Iterator
from typing import NamedTuple

import msgspec

HEADER = struct.Struct("<IBHQ")
"""Payload length in bytes, kind, channel, stamp in ns."""

PICTURE_SEQ = struct.Struct("<Q")


class Kind(enum.IntEnum):
    DEFINE = 1
    MESSAGE = 2
    PICTURE = 3
    METADATA = 4


MESSAGES = frozenset({Kind.MESSAGE, Kind.PICTURE})
"""What is counted."""


class Definition(msgspec.Struct, frozen=True):
    """A channel: its topic, and the name and JSON schema of its messages."""

    topic: str
    schema_name: str
    schema: str


class WriterTally(msgspec.Struct, frozen=True):
    """What the writer has done.

    `found` messages were in the file when it began, `written` are in it now, `lost` were taken but
    refused by the disk; `error` is the disk's newest refusal, "" if there was none."""

    found: int
    written: int
    lost: int
    error: str


class WireFrame(NamedTuple):
    kind: int
    channel: int
    stamp_ns: int
    payload: bytes


def frames_within(buffer: bytearray, upto: int) -> Iterator[tuple[int, int]]:
    """Kind and end of each frame that lies wholly within the first bytes of `buffer`."""
    end = 0
    while upto - end >= HEADER.size:
        length, kind, _, _ = HEADER.unpack_from(buffer, end)
        end += HEADER.size + length
        if end > upto:
            return
        yield kind, end


def take_frames(buffer: bytearray) -> Iterator[WireFrame]:
    """Each whole frame at the front of `buffer`; what they took is removed when the iteration ends."""
    offset, end = 0, len(buffer)
    view = memoryview(buffer)
    try:
        while end - offset >= HEADER.size:
            length, kind, channel, stamp_ns = HEADER.unpack_from(view, offset)
            start = offset + HEADER.size
            if end - start < length:
                break
            offset = start + length
            yield WireFrame(kind, channel, stamp_ns, bytes(view[start:offset]))
    finally:
        view.release()
        del buffer[:offset]
