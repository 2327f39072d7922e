"""PaVE: frames out of a byte stream, whatever happened to it."""

from __future__ import annotations

import random

import pytest

from flightd.adapters.vehicle.ardrone.pave import MAGIC, PaveFrame, PaveParser, parse_header
from tests.protocol.ardrone import golden

STREAM = golden.pave_68()
FRAMES = PaveParser().feed(STREAM)
PIECES: list[bytes] = []
_at = 0
for _frame in FRAMES:
    PIECES.append(STREAM[_at : _at + _frame.header.frame_size])
    _at += _frame.header.frame_size


def numbers(frames: list[PaveFrame]) -> list[int]:
    return [frame.header.frame_number - FRAMES[0].header.frame_number for frame in frames]


def test_a_frame_comes_out_with_its_last_byte() -> None:
    parser = PaveParser()
    assert parser.feed(PIECES[0][:-1]) == []
    assert numbers(parser.feed(PIECES[0][-1:])) == [0]


def test_garbage_between_frames_is_skipped_and_counted() -> None:
    garbage = [b"", b"noise", MAGIC, MAGIC + bytes(200), b"PaVPaPPa"]
    parser = PaveParser()
    frames = [
        frame for piece, noise in zip(PIECES, garbage, strict=True) for frame in parser.feed(noise + piece)
    ]
    assert numbers(frames) == [0, 1, 2, 3, 4]
    assert parser.skipped_bytes == sum(map(len, garbage))


@pytest.mark.parametrize("lost", [1, 2, 3, 4, 5, 60, 64, 67, 500])
def test_a_frame_that_lost_its_end_never_costs_the_next(lost: int) -> None:
    for chunk in (1, 100, 1 << 20):
        stream = PIECES[0][:-lost] + b"".join(PIECES[1:])
        parser = PaveParser()
        frames = [f for at in range(0, len(stream), chunk) for f in parser.feed(stream[at : at + chunk])]
        assert numbers(frames)[-4:] == [1, 2, 3, 4]
        assert [frame.payload for frame in frames[-4:]] == [frame.payload for frame in FRAMES[1:]]


def test_a_stream_joined_in_the_middle_starts_with_the_next_frame() -> None:
    parser = PaveParser()
    assert numbers(parser.feed(STREAM[5000:])) == [1, 2, 3, 4]
    assert parser.skipped_bytes == len(PIECES[0]) - 5000


def test_a_header_that_lies_about_its_payload_is_dropped_at_the_next_header() -> None:
    liar = bytearray(PIECES[0][:68])
    liar[8:12] = (1 << 20).to_bytes(4, "little")
    parser = PaveParser()
    assert numbers(parser.feed(bytes(liar) + STREAM)) == [0, 1, 2, 3, 4]
    assert parser.skipped_bytes == 68


@pytest.mark.parametrize(
    ("offset", "value"),
    [
        (0, b"PaVX"),
        (5, b"\x05"),
        (6, b"\x3f\x00"),
        (6, b"\xff\xff"),
        (8, b"\xff\xff\xff\x7f"),
        (30, b"\x05"),
        (31, b"\x03"),
    ],
)
def test_headers_no_drone_writes_are_refused(offset: int, value: bytes) -> None:
    header = bytearray(PIECES[0][:68])
    header[offset : offset + len(value)] = value
    assert parse_header(bytes(header)) is None


def test_an_advertisement_has_no_payload() -> None:
    notice = bytearray(PIECES[1][:68])
    notice[31] = 1
    frames = PaveParser().feed(bytes(notice) + PIECES[2])
    assert [len(frame.payload) for frame in frames] == [0, len(FRAMES[2].payload)]


def test_frames_survive_any_chunking_and_garbage_in_between() -> None:
    rng = random.Random(1)
    for _ in range(200):
        parser, sent, got = PaveParser(), [], []
        for _ in range(10):
            n = rng.randrange(5)
            noise = rng.randbytes(rng.randrange(40)) + MAGIC[: rng.randrange(5)]
            sent.append(n)
            data = noise + PIECES[n]
            while data:
                size = rng.randrange(1, 6000)
                got += parser.feed(data[:size])
                data = data[size:]
        assert numbers(got) == sent
