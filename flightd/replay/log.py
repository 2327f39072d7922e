"""Read a flight log back as the messages that were recorded, even one that a kill cut off."""

from __future__ import annotations

import base64
import os
import struct
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any, BinaryIO, TypeAlias, TypeVar

import msgspec
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Metadata

from flightd.core.errors import InputError
from flightd.core.refusal import RecordedRefusal, Refusal
from flightd.core.tick import TickInput
from flightd.core.topics import MESSAGE_TYPES, RecordedFrame, Topic
from flightd.core.types import Event, EventLevel
from flightd.replay.nan_values import with_nan
from flightd.runtime.mcap_scan import (
    MAGIC,
    DamagedRecordError,
    RawRecord,
    inner_records,
    parse,
    raw_records,
    unpacked,
)

Decoder: TypeAlias = Callable[[bytes], object]
MessageT = TypeVar("MessageT")

_MESSAGE = int(Opcode.MESSAGE)
_MESSAGE_HEAD = struct.Struct("<HIQQ")
"""Channel, sequence, log time, publish time; then the payload."""

_Message: TypeAlias = tuple[int, int, bytes]
_CUT = "cut off before its end"
_REASONS = frozenset({"refusal", "unfit"})
_LEVELS = {2: EventLevel.INFO, 3: EventLevel.WARNING, 4: EventLevel.ERROR}


@dataclass(frozen=True, slots=True)
class Entry:
    """One recorded message, in the order in which it was recorded."""

    topic: str
    stamp_ns: int
    message: object


@dataclass(frozen=True, slots=True)
class FlightLog:
    """A log in memory.  `damage` is "" for a whole file, else what was found wrong with it."""

    path: Path
    entries: tuple[Entry, ...]
    metadata: dict[str, str] = field(default_factory=dict)
    damage: str = ""

    @property
    def is_cut(self) -> bool:
        """It ends early: what wrote it was killed, or the file is not all that it wrote."""
        return self.damage.endswith(_CUT)

    def messages(self, kind: type[MessageT], topic: str | None = None) -> list[MessageT]:
        """Every message of a type (of one topic, if given), in the order of the file."""
        return [
            entry.message
            for entry in self.entries
            if isinstance(entry.message, kind) and topic in {None, entry.topic}
        ]


def read_log(path: Path, topics: Collection[str] | None = None) -> FlightLog:
    """Everything in the log, or its `topics` only, decoded to the types of `core.topics`.

    A log that ends early is read up to there, and a damaged chunk is passed over.  InputError if the
    file cannot be opened, is not MCAP, or holds a message that does not fit its topic.
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
            for channel_id, stamp_ns, payload in self._messages(stream):
                topic = self._channels.get(channel_id)
                if topic is not None and (topics is None or topic in topics):
                    yield Entry(topic, stamp_ns, decoded_message(self._path, topic, payload))

    def _messages(self, stream: BinaryIO) -> Iterator[_Message]:
        """Channel, stamp and payload of each message; what is damaged is passed over and noted."""
        damage: list[str] = []
        self.damage = _CUT
        descriptor = stream.fileno()
        size = os.fstat(descriptor).st_size

        def read_at(offset: int, length: int) -> bytes:
            return os.pread(descriptor, length, offset)

        for record in raw_records(read_at, len(MAGIC), size):
            if record.opcode == Opcode.DATA_END:
                self.damage = ", ".join(damage)
                return
            try:
                is_chunk = record.opcode == Opcode.CHUNK
                within = inner_records(unpacked(parse(Chunk, record.content))) if is_chunk else (record,)
                for one in within:
                    if (message := self._taken(one)) is not None:
                        yield message
            except DamagedRecordError as err:
                damage.append(str(err))
                self.damage = ", ".join([*damage, _CUT])

    def _taken(self, record: RawRecord) -> _Message | None:
        """The message that a record is; None for any other, of which what is needed is kept."""
        if record.opcode == _MESSAGE and len(record.content) >= _MESSAGE_HEAD.size:
            channel_id, _, stamp_ns, _ = _MESSAGE_HEAD.unpack_from(record.content)
            return channel_id, stamp_ns, record.content[_MESSAGE_HEAD.size :]
        if record.opcode == Opcode.CHANNEL:
            channel = parse(Channel, record.content)
            if channel.message_encoding == "json":
                self._channels[channel.id] = channel.topic
        elif record.opcode == Opcode.METADATA:
            metadata = parse(Metadata, record.content)
            if metadata.name == "flightd":
                self.metadata.update(metadata.metadata)
        return None


def decoded_message(path: Path, topic: str, payload: bytes) -> object:
    """A payload as the message that was recorded on `topic` of the log at `path`.  InputError if it does not
    fit."""
    try:
        return _decoder(MESSAGE_TYPES.get(topic, dict))(payload)
    except (msgspec.MsgspecError, KeyError, NotImplementedError, TypeError, ValueError) as err:
        raise InputError(
            f"is not what this version records ({err})", file=path, key=f"a message on {topic}"
        ) from None


def check_is_log(path: Path) -> None:
    """InputError for a file that is not there, is empty, or is no MCAP file."""
    _opened(path).close()


def _opened(path: Path) -> BinaryIO:
    try:
        stream = path.open("rb")
    except OSError as err:
        raise InputError(f"cannot open the flight log: {err.strerror}", file=path) from None
    start = stream.read(len(MAGIC))
    if start and MAGIC.startswith(start):
        return stream
    stream.close()
    if not start:
        raise InputError("the file is empty: nothing was recorded in it", file=path)
    raise InputError("not a flight log (an MCAP file was expected)", file=path)


@cache
def _decoder(kind: type) -> Decoder:
    if kind is Event:
        return _event
    if kind is RecordedFrame:
        return _picture
    strict: msgspec.json.Decoder[object] = msgspec.json.Decoder(kind)

    def decode(payload: bytes) -> object:
        try:
            return strict.decode(payload)
        except msgspec.ValidationError:
            return converted(msgspec.json.decode(payload), kind)

    return decode


def converted(value: object, kind: type[MessageT]) -> MessageT:
    """JSON values as the message that they were recorded of; msgspec.ValidationError if they are none."""
    told = _with_counted_places(_without_empty_reasons(with_nan(value, kind)))
    return msgspec.convert(told, kind, dec_hook=_recorded_reason)


def recorded_tick(path: Path, message: object) -> TickInput:
    """A message on TICK as the pilot was given it.  InputError if this version records no such."""
    try:
        return converted(message, TickInput)
    except msgspec.ValidationError as err:
        told = f"a message on {Topic.TICK} is not what this version records ({err})"
        raise InputError(f"{path}: {told}") from None


def _without_empty_reasons(value: object) -> object:
    """A reason is recorded in words, and as an empty text where there was none."""
    if not isinstance(value, dict):
        return value
    told = {key: item for key, item in value.items() if item != "" or key not in _REASONS}
    return told | {"vehicle": _without_empty_reasons(told["vehicle"])} if "vehicle" in told else told


def _with_counted_places(value: object) -> object:
    """Earlier versions told of a place that was counted before its name alone."""
    if not isinstance(value, dict) or not isinstance(value.get("counted"), list):
        return value
    places = [{"location": place} if isinstance(place, str) else place for place in value["counted"]]
    return value | {"counted": places}


def _recorded_reason(kind: type, value: object) -> object:
    if kind is Refusal and isinstance(value, str):
        return RecordedRefusal(value)
    raise NotImplementedError(f"a {kind.__name__} is not read from a log")


def _event(payload: bytes) -> Event:
    fields: dict[str, Any] = msgspec.json.decode(payload, type=dict)
    return Event(_stamp_ns(fields), _LEVELS[fields["level"]], fields["name"], fields["message"])


def _picture(payload: bytes) -> RecordedFrame:
    fields: dict[str, Any] = msgspec.json.decode(payload, type=dict)
    jpeg = base64.b64decode(fields["data"], validate=True)
    return RecordedFrame(int(fields["seq"]), _stamp_ns(fields), jpeg)


def _stamp_ns(fields: dict[str, Any]) -> int:
    time = fields["timestamp"]
    return int(time["sec"]) * 1_000_000_000 + int(time["nsec"])
