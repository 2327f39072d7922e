"""Our framing against pymavlink's own, over every kind of message in the dialect."""

from __future__ import annotations

import math
import random
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.adapters.vehicle.mavlink.link.codec import Codec, FrameParser
from flightd.adapters.vehicle.mavlink.link.wire import layout
from flightd.adapters.vehicle.mavlink.setpoint import attitude_target
from flightd.core.types import AttitudeSetpoint

PLAIN = [kind for kind in dialect.mavlink_map.values() if layout(kind.id) is not None]


def theirs(message: Any, sequence: int) -> bytes:
    mav = dialect.MAVLink(None, srcSystem=7, srcComponent=191)
    mav.seq = sequence
    frame: bytes = message.pack(mav)
    return frame


def fields(message: Any) -> dict[str, Any]:
    header = message.get_header()
    place = (header.msgId, header.mlen, header.seq, header.srcSystem, header.srcComponent)
    return {name: getattr(message, name) for name in message.fieldnames} | {"header": place}


def same(ours: Any, other: Any) -> bool:
    """Equal, a NaN being equal to a NaN."""
    if isinstance(ours, list):
        return len(ours) == len(other) and all(map(same, ours, other))
    if isinstance(ours, float) and math.isnan(ours):
        return bool(math.isnan(other))
    return bool(ours == other)


def test_each_kind_is_packed_byte_for_byte_and_read_field_for_field_as_by_pymavlink() -> None:
    rng = random.Random(1)
    codec, reader = Codec(7), dialect.MAVLink(None)
    sequence = 0
    assert len(PLAIN) > 250
    for kind in PLAIN:
        size = kind.unpacker.size
        for length, zeros in (
            (size, 0),
            (size, 0),
            (size, rng.randrange(size)),
            (size, size),
            (rng.randint(1, size), 0),  # cut on the way, as zeros are
            (rng.randint(size, 255), 0),  # of a newer dialect, with more fields
        ):
            payload = rng.randbytes(length - zeros) + bytes(zeros)
            head = bytes([len(payload), 0, 0, sequence, 7, 191]) + kind.id.to_bytes(3, "little")
            checksum = dialect.x25crc(head + payload + bytes([kind.crc_extra])).crc
            frame = bytearray(b"\xfd" + head + payload + checksum.to_bytes(2, "little"))
            message, expected = codec.decode(frame), fields(reader.decode(frame))
            assert message is not None
            assert all(same(value, expected[name]) for name, value in fields(message).items()), kind.msgname
            assert codec.pack(message) == theirs(message, sequence), kind.msgname
            sequence = (sequence + 1) % 256


def test_every_bit_of_a_frame_is_guarded() -> None:
    codec = Codec(1)
    frame = codec.pack(attitude_target(5, 1, AttitudeSetpoint(0, 0.1, -0.1), 1.0, 0.5))
    assert len(FrameParser(codec).datagram(frame)) == 1
    for bit in range(8 * len(frame)):
        damaged = bytearray(frame)
        damaged[bit // 8] ^= 1 << bit % 8
        assert not FrameParser(codec).datagram(bytes(damaged))


def test_a_field_that_does_not_fit_is_refused() -> None:
    with pytest.raises(dialect.struct.error):
        Codec(1).pack(dialect.MAVLink_distance_sensor_message(0, 5, 70_000, 150, 0, 0, 25, 0))
    with pytest.raises(dialect.struct.error):
        Codec(1).pack(dialect.MAVLink_set_attitude_target_message(0, 1, 1, 0, [1.0], 0.0, 0.0, 0.0, 0.5))


def test_messages_with_text_are_left_to_pymavlink() -> None:
    text = dialect.MAVLink_statustext_message(4, b"Flying home", 0, 0)
    assert layout(text.get_msgId()) is None
    assert Codec(7).pack(text) == theirs(text, 0)
