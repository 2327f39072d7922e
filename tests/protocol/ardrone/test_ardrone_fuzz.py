"""Random, truncated and mutated input: nothing escapes, nothing is corrupted, good traffic is not lost.

`FLIGHTD_FUZZ=1000000` raises the number of cases per parser from 20,000 to a million.
"""

from __future__ import annotations

import os
import random
from collections.abc import Iterator

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flightd.adapters.vehicle.ardrone import at, navdata
from flightd.adapters.vehicle.ardrone.configurator import parse_text
from flightd.adapters.vehicle.ardrone.navdata import NavdataError, NavdataOrder
from flightd.adapters.vehicle.ardrone.pave import PaveFrame, PaveParser
from flightd.adapters.vehicle.ardrone.settings import ArDroneSettings
from flightd.adapters.vehicle.ardrone.telemetry import NavdataTelemetry
from flightd.sim.ardrone.at_commands import parse
from flightd.sim.ardrone.navdata_writer import ALL_OPTIONS, OPTION_BYTES, NavdataReport, packet
from flightd.sim.ardrone.states import DroneOptions
from tests.protocol.ardrone import golden
from tests.rigs.ardrone import make_drone

CASES = int(os.environ.get("FLIGHTD_FUZZ", "20000"))
MS = 1_000_000


def damaged(rng: random.Random, corpus: list[bytes], longest: int = 2200) -> bytes:
    """Something like the corpus and yet not of it, or plain noise."""
    kind = rng.randrange(6)
    if kind == 0:
        return rng.randbytes(rng.randrange(longest))
    data = bytearray(rng.choice(corpus))
    if kind == 1:
        return bytes(data[: rng.randrange(len(data))])
    if kind == 2:
        at = rng.randrange(len(data))
        data[at:at] = rng.randbytes(rng.randrange(1, 40))
    elif kind == 3:
        at = rng.randrange(len(data))
        del data[at : at + rng.randrange(1, 40)]
    else:
        for _ in range(rng.randrange(1, 8)):
            data[rng.randrange(len(data))] = rng.randrange(256)
    return bytes(data)


def resealed(data: bytes) -> bytes:
    """The same with a checksum that is right, so that what lies behind the checksum is reached."""
    body = data[:-8]
    return body + b"\xff\xff\x08\x00" + (sum(body) & 0xFFFFFFFF).to_bytes(4, "little")


def good_packets() -> Iterator[bytes]:
    """What one drone sends, numbered on."""
    sequence = 1
    while True:
        sequence += 1
        report = NavdataReport(
            state=0x0F800490,
            sequence=sequence,
            major=4,
            battery_percent=80,
            theta_mdeg=float(sequence % 7),
            altitude_mm=1000,
            time_us=5000 * sequence,
        )
        yield packet(report, (0, 1, 10))


def test_navdata_survives_anything_and_loses_nothing() -> None:
    rng = random.Random(20)
    corpus = [bytes.fromhex(p["hex"]) for p in golden.recorded()["navdata"]]
    corpus.append(
        packet(NavdataReport(state=0x0F800490, sequence=9, major=4, battery_percent=70), ALL_OPTIONS)
    )
    order, telemetry = NavdataOrder(), NavdataTelemetry(0)
    good = good_packets()
    refused = taken = sent = now_ns = 0
    for case in range(CASES):
        now_ns += MS
        data = damaged(rng, corpus)
        data = resealed(data) if rng.randrange(3) == 0 and len(data) > 24 else data
        try:
            read = navdata.parse(data)
        except NavdataError:
            refused += 1
        else:
            assert data[:4] in (b"\x88\x77\x66\x55", b"\x89\x77\x66\x55")
            NavdataTelemetry(0).observe(read, now_ns)
        if case % 10 == 0:
            sent += 1
            read = navdata.parse(next(good))
            if order.accept(read, now_ns):
                taken += 1
                telemetry.observe(read, now_ns)
    assert taken == sent
    assert refused > CASES / 2
    assert len(telemetry.drain()) == min(sent, 1000)
    assert telemetry.height_m == 1.0


@given(
    st.lists(st.tuples(st.integers(0, 40), st.binary(max_size=60)), max_size=12),
    st.integers(0, 0xFFFFFFFF),
    st.integers(0, 0xFFFFFFFF),
)
def test_any_chain_of_options_under_a_right_checksum_is_read_or_refused(
    options: list[tuple[int, bytes]], state: int, sequence: int
) -> None:
    body = b"".join(
        tag.to_bytes(2, "little") + (len(payload) + 4).to_bytes(2, "little") + payload
        for tag, payload in options
    )
    head = b"".join(n.to_bytes(4, "little") for n in (0x55667788, state, sequence, 1))
    data = resealed(head + body + bytes(8))
    try:
        read = navdata.parse(data)
    except NavdataError:
        assert 0 in dict(options), "only the demo option can be refused for what it says"
        return
    assert read.sequence == sequence
    assert read.state == state
    assert dict(read.options) == dict(options)
    telemetry = NavdataTelemetry(0)
    telemetry.observe(read, 0)
    assert telemetry.battery_percent <= 100


def test_one_parser_per_stream_finds_every_whole_frame_again() -> None:
    rng = random.Random(21)
    stream = golden.pave_68()
    whole = PaveParser().feed(stream)
    pieces: list[bytes] = []
    at_ = 0
    for frame in whole:
        pieces.append(stream[at_ : at_ + frame.header.frame_size])
        at_ += frame.header.frame_size
    short = [_short(piece, 60 + n) for n, piece in enumerate(pieces)]
    expected = {bytes(piece[piece[6] + 256 * piece[7] :]) for piece in short}
    parser = PaveParser()
    cases = sent = found = 0
    while cases < CASES:
        run = b""
        for _ in range(20):
            cases += 1
            run += damaged(rng, short, 300)
        # Damage may claim what follows it, so two sound frames follow: the second must always come out.
        sent += 1
        last = rng.choice(short)
        run += rng.choice(short) + last
        frames: list[PaveFrame] = []
        while run:
            size = rng.randrange(1, 900)
            frames += parser.feed(run[:size])
            run = run[size:]
        found += bool(frames) and frames[-1].payload == bytes(last[last[6] + 256 * last[7] :])
        assert parser.waiting_bytes <= 1 << 21
    assert found == sent
    assert len(expected) == len(short)


def _short(piece: bytes, length: int) -> bytes:
    """The same frame with a payload of `length` bytes."""
    header_size = piece[6] + 256 * piece[7]
    header = bytearray(piece[:header_size])
    header[8:12] = length.to_bytes(4, "little")
    return bytes(header) + piece[header_size : header_size + length]


@given(st.lists(st.binary(max_size=300), max_size=20))
def test_any_bytes_go_through_the_video_parser(chunks: list[bytes]) -> None:
    parser = PaveParser()
    for chunk in chunks:
        parser.feed(chunk)
    assert parser.waiting_bytes + parser.skipped_bytes <= sum(map(len, chunks))


def test_the_at_port_survives_anything_and_good_commands_count() -> None:
    rng = random.Random(22)
    recorded = golden.recorded()
    corpus = [text.encode() for vector in recorded["at"] for text in vector["datagrams"]]
    corpus += [b"\r".join(line.encode() for _, line in recorded["client_transcripts"]["ack"][:8]) + b"\r"]
    drone = make_drone(DroneOptions(profile_switch_s=0.0))  # damage may spell a switch of profiles
    drone.wake()
    encoder = at.AtEncoder()
    now_ns = 0
    for case in range(CASES):
        now_ns += MS
        data = damaged(rng, corpus, 1200)
        for command in parse(data):
            assert command.sequence >= 0
            assert command.name.isascii()
        drone.command(data, now_ns)
        if case % 50 == 0:
            drone.step(now_ns, 0.005)
            drone.navdata(now_ns)
        if case % 10 == 0:
            # A damaged number may stand above ours: that is the protocol's own weakness, so start at 1.
            encoder.restart()
            height = str(2000 + case % 1000)
            (datagram,) = encoder.datagrams([[at.ctrl(5), at.config("control:altitude_max", height)]])
            drone.command(datagram, now_ns)
            assert drone.last_sequence == 2
            assert drone.configuration.text("control:altitude_max") == height
    assert drone.configuration.dump().endswith(b"\0")


@given(st.binary(max_size=1200))
def test_any_datagram_goes_through_the_at_port(data: bytes) -> None:
    drone = make_drone()
    drone.command(data, 0)
    drone.step(5 * MS, 0.005)
    drone.command(b"AT*COMWDG=1\r", 10 * MS)
    assert drone.last_sequence == 1, "it still obeys"


@given(st.binary(max_size=2000))
def test_any_configuration_dump_is_read(data: bytes) -> None:
    for key, value in parse_text(data).items():
        assert ":" in key
        assert "\0" not in key + value


@given(st.sampled_from(sorted(OPTION_BYTES)), st.binary(max_size=400))
def test_every_known_option_may_hold_anything(tag: int, payload: bytes) -> None:
    head = b"".join(n.to_bytes(4, "little") for n in (0x55667788, 0, 5, 1))
    option = tag.to_bytes(2, "little") + (len(payload) + 4).to_bytes(2, "little") + payload
    try:
        read = navdata.parse(resealed(head + option + bytes(8)))
    except NavdataError:
        assert tag == 0
        return
    telemetry = NavdataTelemetry(0)
    telemetry.observe(read, 0)


def test_settings_have_defaults_that_hold() -> None:
    assert ArDroneSettings().session != ArDroneSettings().user
    with pytest.raises(ValueError, match="outside"):
        ArDroneSettings(height_max_m=0.0)
