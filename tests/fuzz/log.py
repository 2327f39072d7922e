"""Fuzz the reading and mending of flight logs (MCAP): `python -m tests.fuzz.log COUNT`."""

from __future__ import annotations

import io
from pathlib import Path

from mcap.opcode import Opcode
from mcap.records import Chunk

from flightd.adapters.recorder.mcap_chunk import pack
from flightd.adapters.recorder.mcap_file import McapFile
from flightd.adapters.recorder.mcap_repair import is_whole, repair
from flightd.adapters.recorder.schemas import encode, picture_schema, schema_of
from flightd.core.errors import InputError
from flightd.core.topics import Document, Topic
from flightd.core.types import AttitudeSetpoint, Event, EventLevel
from flightd.replay.log import read_log
from flightd.runtime.mcap_scan import MAGIC, parse, raw_records, unpacked
from tests.fuzz.drive import Target, main
from tests.fuzz.mutate import spoil_bytes


def target(folder: Path) -> Target:
    path = folder / "flight.mcap"

    def attempt(data: bytes) -> bool:
        path.write_bytes(data)
        is_whole(path)
        readable = _reads(path)
        try:
            repair(path)
        except InputError:
            return True
        assert is_whole(path), "a log that was mended is whole"
        _reads(path)
        return not readable

    whole = _small_log(folder / "seed.mcap")
    return Target("log", (whole, _unpacked_log(whole), whole[: len(whole) // 2]), spoil_bytes, attempt)


def _reads(path: Path) -> bool:
    try:
        read_log(path)
    except InputError:
        return False
    return True


def _small_log(path: Path) -> bytes:
    """A log with a message of each kind that is read in its own way."""
    messages = (
        (Topic.CONFIG, Document("a = 1")),
        (Topic.EVENT, Event(5, EventLevel.INFO, "phase", "hover")),
        (Topic.SETPOINT, AttitudeSetpoint(6, 0.1)),
        (Topic.TICK, {"now_ns": 7, "vehicle": None}),
    )
    file = McapFile.create(path)
    file.add_metadata("flightd", {"version": "1"})
    for channel, (topic, message) in enumerate(messages, start=1):
        name, schema = schema_of(message)
        file.add_channel(channel, topic, name, encode(schema).decode())
        file.add_message(channel, channel, encode(message))
        file.flush()
    name, schema = picture_schema()
    file.add_channel(9, Topic.FRAME, name, encode(schema).decode())
    file.add_message(9, 9, b'{"timestamp": {"sec": 1, "nsec": 2}, "data": "AAAA", "seq": 3}')
    file.close()
    return path.read_bytes()


def _unpacked_log(data: bytes) -> bytes:
    """The same with chunks that are neither compressed nor summed: damage reaches what is inside."""
    out = io.BytesIO()
    out.write(MAGIC)
    for record in raw_records(lambda at, length: data[at : at + length], len(MAGIC), len(data)):
        if record.opcode == Opcode.CHUNK:
            chunk = parse(Chunk, record.content)
            chunk.data, chunk.compression, chunk.uncompressed_crc = unpacked(chunk), "", 0
            out.write(pack(chunk))
        else:
            out.write(data[record.offset : record.end])
        if record.opcode == Opcode.DATA_END:
            break
    return out.getvalue()


if __name__ == "__main__":
    main(target)
