"""Read a flight log back as the messages that were recorded, even one that a kill cut off."""

from __future__ import annotations

import base64
import math
import struct
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any, BinaryIO, TypeAlias, TypeVar

import msgspec
import zstandard
from mcap.exceptions import McapError
from mcap.records import Channel, Chunk, McapRecord, Message, Metadata
from mcap.stream_reader import StreamReader, breakup_chunk

from flightd.core.errors import InputError
from flightd.core.topics import MESSAGE_TYPES, Picture
from flightd.core.types import Event, EventLevel

Decoder: TypeAlias = Callable[[bytes], object]
MessageT = TypeVar("MessageT")

RECORD_LIMIT_BYTES = 256 << 20
"""No record, packed or unpacked, is larger; one that says so is damaged."""

_DAMAGE = (McapError, zstandard.ZstdError, struct.error, ValueError, KeyError, RuntimeError, OverflowError)
"""What the `mcap` package raises on bytes that are not what they should be."""

_MAGIC = b"\x89MCAP0\r\n"
_LEVELS = {2: EventLevel.INFO, 3: EventLevel.WARNING, 4: EventLevel.ERROR}


@dataclass(frozen=True, slots=True)
class Entry:
    """One recorded message, in the order in which it was recorded."""

    topic: str
    stamp_ns: int
    message: object


@dataclass(frozen=True, slots=True)
class FlightLog:
    """A log in memory.  `damage` is "" for a whole file, else what was found wrong with its end."""

    path: Path
    entries: tuple[Entry, ...]
    metadata: dict[str, str] = field(default_factory=dict)
    damage: str = ""

    def messages(self, kind: type[MessageT], topic: str | None = None) -> list[MessageT]:
        """Every message of a type (of one topic, if given), in the order of the file."""
        return [
            entry.message
            for entry in self.entries
            if isinstance(entry.message, kind) and topic in {None, entry.topic}
        ]


def read_log(path: Path, topics: Collection[str] | None = None) -> FlightLog:
    """Everything in the log, or its `topics` only, decoded to the types of `core.topics`.

    A log that ends early is read up to there.  InputError if it cannot be opened, is not an MCAP file,
    or holds a message that does not fit its topic.
    """
    reader = LogReader(path)
    entries = tuple(reader.entries(topics))
    return FlightLog(path, entries, reader.metadata, reader.damage)


class LogReader:
    """Reads a log from front to back without holding it in memory.

    `metadata` and `damage` (see `FlightLog`) are complete when `entries` has come to its end.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._channels: dict[int, str] = {}
        self.metadata: dict[str, str] = {}
        self.damage = ""

    def entries(self, topics: Collection[str] | None = None) -> Iterator[Entry]:
        """The messages of all topics or of `topics`; errors as in `read_log`."""
        with _opened(self._path) as stream:
            messages = self._messages(stream)
            while True:
                try:
                    message = next(messages, None)
                except _DAMAGE as err:
                    self.damage = f"cut off or damaged ({type(err).__name__})"
                    return
                if message is None:
                    return
                topic = self._channels.get(message.channel_id, "")
                if topic and (topics is None or topic in topics):
                    yield Entry(topic, message.log_time, self._decode(topic, message.data))

    def _messages(self, stream: BinaryIO) -> Iterator[Message]:
        reader = StreamReader(stream, emit_chunks=True, record_size_limit=RECORD_LIMIT_BYTES)
        for record in reader.records:
            if isinstance(record, Chunk):
                if record.uncompressed_size > RECORD_LIMIT_BYTES:
                    raise McapError("chunk too large")
                for inner in breakup_chunk(record, validate_crc=True):
                    yield from self._take(inner)
            else:
                yield from self._take(record)

    def _take(self, record: McapRecord) -> Iterator[Message]:
        if isinstance(record, Channel):
            self._channels[record.id] = record.topic if record.message_encoding == "json" else ""
        elif isinstance(record, Metadata) and record.name == "flightd":
            self.metadata.update(record.metadata)
        elif isinstance(record, Message):
            yield record

    def _decode(self, topic: str, payload: bytes) -> object:
        try:
            return _decoder(MESSAGE_TYPES.get(topic, dict))(payload)
        except (msgspec.MsgspecError, KeyError, TypeError, ValueError) as err:
            raise InputError(
                f"{self._path}: a message on {topic} is not what this version records ({err})"
            ) from None


def _opened(path: Path) -> BinaryIO:
    try:
        stream = path.open("rb")
    except OSError as err:
        raise InputError(f"{path}: cannot open the flight log: {err.strerror}") from None
    if not _MAGIC.startswith(stream.read(len(_MAGIC))):
        stream.close()
        raise InputError(f"{path}: not a flight log (an MCAP file was expected)")
    stream.seek(0)
    return stream


@cache
def _decoder(kind: type) -> Decoder:
    if kind is Event:
        return _event
    if kind is Picture:
        return _picture
    strict: msgspec.json.Decoder[object] = msgspec.json.Decoder(kind)

    def decode(payload: bytes) -> object:
        try:
            return strict.decode(payload)
        except msgspec.ValidationError:  # JSON has no NaN: a float that is none was written as null
            return msgspec.convert(_with_nan(msgspec.json.decode(payload)), kind)

    return decode


def _with_nan(value: object) -> object:
    if value is None:
        return math.nan
    if isinstance(value, dict):
        return {key: _with_nan(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_with_nan(item) for item in value]
    return value


def _event(payload: bytes) -> Event:
    fields: dict[str, Any] = msgspec.json.decode(payload, type=dict)
    return Event(_stamp_ns(fields), _LEVELS[fields["level"]], fields["name"], fields["message"])


def _picture(payload: bytes) -> Picture:
    fields: dict[str, Any] = msgspec.json.decode(payload, type=dict)
    jpeg = base64.b64decode(fields["data"], validate=True)
    return Picture(int(fields["seq"]), _stamp_ns(fields), jpeg)


def _stamp_ns(fields: dict[str, Any]) -> int:
    time = fields["timestamp"]
    return int(time["sec"]) * 1_000_000_000 + int(time["nsec"])
