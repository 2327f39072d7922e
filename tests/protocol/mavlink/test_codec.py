"""MAVLink frames: recorded bytes, damage, foreign traffic, signing."""

from __future__ import annotations

import contextlib
import random
import shutil
import threading
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.adapters.vehicle.mavlink.link.codec import Codec, FrameParser
from flightd.adapters.vehicle.mavlink.link.signing import Signing, read_key
from flightd.adapters.vehicle.mavlink.services.clock_offset import ClockSync
from flightd.adapters.vehicle.mavlink.telemetry import MavlinkTelemetry
from flightd.core.errors import InputError
from tests.protocol.mavlink.damaged_traffic import GOLDEN, frames, hammer

KEY = bytes(range(32))
GOLDEN_STAMP = 10**12
GOLDEN_UNIX_S = GOLDEN_STAMP / 1e5 + 1_420_070_400


class StoppedClock:
    def __init__(self) -> None:
        self.ns = 5_000_000_000

    def now_ns(self) -> int:
        return self.ns

    def hold(self) -> AbstractContextManager[None]:
        return contextlib.nullcontext()


def build(fields: dict[str, Any]) -> Any:
    kind = dialect.mavlink_map[getattr(dialect, f"MAVLINK_MSG_ID_{fields['mavpackettype']}")]
    values = []
    for name in kind.fieldnames:
        value = fields.get(name, 0)
        values.append(value.encode() if isinstance(value, str) else value)
    return kind(*values)


def make_codec(vector: dict[str, Any]) -> Codec:
    signing = None
    if vector["name"] == "heartbeat_signed":
        signing = Signing(KEY, StoppedClock(), GOLDEN_UNIX_S, link_id=3)
    return Codec(vector["src_system"], vector["src_component"], signing)


def by_name(vector: dict[str, Any]) -> str:
    return str(vector["name"])


@pytest.mark.parametrize("vector", [v for v in GOLDEN if v["name"] != "heartbeat_v1"], ids=by_name)
def test_recorded_frames_are_packed_byte_for_byte(vector: dict[str, Any]) -> None:
    assert make_codec(vector).pack(build(vector["fields"])).hex() == vector["hex"]


@pytest.mark.parametrize("vector", GOLDEN, ids=by_name)
def test_recorded_frames_are_read_with_their_fields(vector: dict[str, Any]) -> None:
    for read in (FrameParser.datagram, FrameParser.stream):
        parser = FrameParser(make_codec(vector))
        (message,) = read(parser, bytes.fromhex(vector["hex"]))
        for name, value in vector["fields"].items():
            if name != "mavpackettype":
                assert getattr(message, name) == pytest.approx(value), name
        assert message.get_srcComponent() == vector["src_component"]


def test_sequence_numbers_count_modulo_256() -> None:
    codec = Codec(1)
    beat = build(GOLDEN[0]["fields"])
    assert [codec.pack(beat)[4] for _ in range(600)] == [i % 256 for i in range(600)]


def test_a_disabled_checksum_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MAV_IGNORE_CRC", "1")
    with pytest.raises(InputError, match="MAV_IGNORE_CRC"):
        Codec(1)


def times(messages: list[Any]) -> list[int]:
    return [m.time_boot_ms for m in messages]


@given(data=st.data())
def test_a_stream_cut_anywhere_gives_the_same_frames(data: st.DataObject) -> None:
    stream = b"".join(frames(20))
    cuts = sorted(data.draw(st.lists(st.integers(0, len(stream)), max_size=30)))
    parser, heard = FrameParser(Codec(1)), []
    for start, end in zip([0, *cuts], [*cuts, len(stream)], strict=True):
        heard += parser.stream(stream[start:end])
    assert times(heard) == list(range(20))


@given(garbage=st.lists(st.binary(max_size=80), min_size=11, max_size=11))
@settings(max_examples=300)
def test_no_good_frame_is_lost_among_garbage_in_a_stream(garbage: list[bytes]) -> None:
    good = frames(10)
    parser, heard = FrameParser(Codec(1)), []
    for noise, frame in zip(garbage, [*good, b""], strict=True):
        heard += parser.stream(noise + frame)
    heard += parser.stream(bytes(600))  # what comes later pushes out what a false start marker held back
    assert times(heard) == list(range(10))


@given(before=st.binary(max_size=300), after=st.binary(max_size=300))
@settings(max_examples=300)
def test_no_good_frame_is_lost_among_garbage_in_a_datagram(before: bytes, after: bytes) -> None:
    (frame,) = frames(1)
    parser = FrameParser(Codec(1))
    assert times(parser.datagram(before + frame + after)) == [0]
    assert times(parser.datagram(frame[:-3])) == []
    assert times(parser.datagram(frame)) == [0]


@given(st.binary(max_size=600))
@settings(max_examples=500)
def test_random_bytes_are_no_message(data: bytes) -> None:
    parser = FrameParser(Codec(1))
    assert parser.datagram(data) == []
    assert parser.stream(data) == []


def test_false_start_markers_hold_back_no_more_than_one_frame_length() -> None:
    parser = FrameParser(Codec(1))
    good = frames(30)
    heard = parser.stream(b"\xfd\xff\x00\x00\x00\x01\x01\x1e\x00\x00")  # claims an ATTITUDE of 255 bytes
    for frame in good:
        heard += parser.stream(frame)
    assert times(heard) == list(range(30))


def test_unknown_ids_and_flags_are_no_messages() -> None:
    (frame,) = frames(1)
    unknown = bytearray(frame)
    unknown[7:10] = b"\xb4\x01\x00"  # 436 CURRENT_MODE, not in the dialect
    flagged = bytearray(frame)
    flagged[2] |= 0x02
    for bad in (unknown, flagged):
        assert FrameParser(Codec(1)).datagram(bytes(bad)) == []


def signing_pair(tmp_path: Path) -> tuple[Codec, Codec, Signing]:
    clock = StoppedClock()
    receiver = Signing(KEY, clock, GOLDEN_UNIX_S, tmp_path / "stamp")
    return Codec(1, 1, Signing(KEY, clock, GOLDEN_UNIX_S)), Codec(1, 191, receiver), receiver


def test_signed_frames_pass_once_and_unsigned_or_wrongly_signed_ones_do_not(tmp_path: Path) -> None:
    sender, receiver, signing = signing_pair(tmp_path)
    parser = FrameParser(receiver)
    frame = sender.pack(build(GOLDEN[0]["fields"]))
    assert len(parser.datagram(frame)) == 1
    assert parser.datagram(frame) == []  # replayed
    assert parser.datagram(bytes.fromhex(GOLDEN[0]["hex"])) == []
    assert parser.datagram(bytes.fromhex(GOLDEN[-1]["hex"])) == []  # MAVLink 1 cannot be signed
    other = Codec(1, 1, Signing(bytes(32), StoppedClock(), GOLDEN_UNIX_S + 60))
    assert parser.datagram(other.pack(build(GOLDEN[0]["fields"]))) == []
    assert signing.refused >= 4
    radio = dialect.MAVLink_radio_status_message(1, 1, 1, 1, 1, 1, 1)
    assert len(parser.datagram(Codec(51, 68).pack(radio))) == 1


def test_a_forged_stamp_from_the_future_does_not_lock_the_sender_out(tmp_path: Path) -> None:
    sender, receiver, _ = signing_pair(tmp_path)
    parser = FrameParser(receiver)
    beat = build(GOLDEN[0]["fields"])
    assert len(parser.datagram(sender.pack(beat))) == 1
    forged = bytearray(sender.pack(beat))
    forged[-12:-6] = b"\xff" * 6
    assert parser.datagram(bytes(forged)) == []
    assert len(parser.datagram(sender.pack(beat))) == 1
    unheard = bytearray(Codec(1, 7, Signing(KEY, StoppedClock(), GOLDEN_UNIX_S)).pack(beat))
    unheard[-1] ^= 1  # forged for a stream that has not spoken yet
    assert parser.datagram(bytes(unheard)) == []
    radio = dialect.MAVLink_radio_status_message(1, 1, 1, 1, 1, 1, 1)
    modem = bytearray(Codec(1, 1, Signing(bytes(32), StoppedClock(), GOLDEN_UNIX_S + 9e5)).pack(radio))
    assert len(parser.datagram(bytes(modem))) == 1  # needs no signature, so it must not leave a trace either
    assert len(parser.datagram(sender.pack(beat))) == 1


def test_the_signing_stamp_follows_the_clock_and_outlives_a_restart(tmp_path: Path) -> None:
    clock, state = StoppedClock(), tmp_path / "stamp"
    beat = build(GOLDEN[0]["fields"])

    def stamp(frame: bytes) -> int:
        return int.from_bytes(frame[-12:-6], "little")

    codec = Codec(1, 191, Signing(KEY, clock, GOLDEN_UNIX_S, state))
    first = stamp(codec.pack(beat))
    assert first == GOLDEN_STAMP
    clock.ns += 10**9
    last = stamp(codec.pack(beat))
    assert last == first + 100_000
    restarted = Codec(1, 191, Signing(KEY, clock, GOLDEN_UNIX_S - 3600, state))  # its clock was lost
    assert stamp(restarted.pack(beat)) > last
    state.write_text("rubbish")
    with pytest.raises(InputError, match="stamp"):
        Signing(KEY, clock, 0.0, state)


def test_time_stamps_are_claimed_on_the_disk_before_they_are_used(tmp_path: Path) -> None:
    clock, state = StoppedClock(), tmp_path / "stamp"
    beat = build(GOLDEN[0]["fields"])
    codec = Codec(1, 191, Signing(KEY, clock, GOLDEN_UNIX_S, state))
    for _ in range(90):
        frame = codec.pack(beat)
        assert int.from_bytes(frame[-12:-6], "little") < int(state.read_text())
        clock.ns += 10**9
        for thread in threading.enumerate():
            if thread.name == "signing time stamp":
                thread.join()
    claimed = int(state.read_text()) - GOLDEN_STAMP
    assert 90 * 10**5 <= claimed <= 121 * 10**5, "a restart begins there: not far ahead of the clock"
    assert [path.name for path in tmp_path.iterdir()] == ["stamp"]


def test_a_time_stamp_that_cannot_be_written_is_told_once(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    clock, state = StoppedClock(), tmp_path / "folder" / "stamp"
    beat = build(GOLDEN[0]["fields"])

    def pack_for(seconds: int) -> None:
        for _ in range(seconds):
            clock.ns += 10**9
            codec.pack(beat)
            for thread in threading.enumerate():
                if thread.name == "signing time stamp":
                    thread.join()

    codec = Codec(1, 191, Signing(KEY, clock, GOLDEN_UNIX_S, state))
    pack_for(60)
    (told,) = caplog.messages
    assert told.startswith(f"vehicle.signing_stamp {state} cannot be written: No such file or directory; ")
    state.parent.mkdir()
    pack_for(30)
    assert state.exists()
    shutil.rmtree(state.parent)
    pack_for(60)
    assert len(caplog.messages) == 2, "it failed anew"


def test_the_key_file_must_be_private_and_whole(tmp_path: Path) -> None:
    path = tmp_path / "key"
    with pytest.raises(InputError, match="flightd keygen"):
        read_key(path)
    path.write_text(KEY.hex() + "\n")
    path.chmod(0o644)
    with pytest.raises(InputError, match="chmod 600"):
        read_key(path)
    path.chmod(0o600)
    assert read_key(path) == KEY
    path.write_bytes(KEY)
    assert read_key(path) == KEY
    path.write_text("abc")
    with pytest.raises(InputError, match="64 hex digits"):
        read_key(path)


def test_twenty_thousand_damaged_datagrams_lose_no_good_one() -> None:
    hammer(20_000)


def test_nothing_in_a_damaged_stream_escapes_the_vehicle() -> None:
    """Sound frames with absurd values reach the telemetry: none may raise, none may be believed."""
    rng = random.Random(3)
    telemetry = MavlinkTelemetry(ClockSync())
    kinds = [dialect.mavlink_map[i] for i in (0, 1, 30, 33, 132, 147, 245)]
    for i in range(20_000):
        kind = rng.choice(kinds)
        payload = rng.randbytes(kind.unpacker.size)
        frame = bytearray(
            b"\xfd" + bytes([len(payload), 0, 0, 0, 1, 1]) + kind.id.to_bytes(3, "little") + payload
        )
        crc = dialect.x25crc(frame[1:])
        crc.accumulate(bytes([kind.crc_extra]))
        (message,) = FrameParser(Codec(1)).datagram(bytes(frame) + crc.crc.to_bytes(2, "little"))
        telemetry.take(message, i * 1_000_000)
        state = telemetry.state(i * 1_000_000, "", in_control=False, refusal=None)
        if state is not None:
            angles = (state.attitude.roll_rad, state.attitude.pitch_rad, state.attitude.yaw_rad)
            assert all(abs(angle) < 10.0 for angle in angles)
            assert not state.height_m < 0.0
            assert not state.battery_frac > 1.0
            assert state.attitude.stamp_ns <= i * 1_000_000
