"""Every recorded AT command, navdata packet and video frame, byte for byte."""

from __future__ import annotations

import hashlib
import math
import re
from dataclasses import asdict
from typing import Any

import pytest

from flightd.adapters.vehicle.ardrone import at, navdata, pave
from flightd.adapters.vehicle.ardrone.at import AtCommand
from tests.protocol.ardrone import golden

GOLDEN = golden.recorded()

ZERO = {"roll": 0.0, "pitch": 0.0, "gaz": 0.0, "yaw": 0.0}

OURS: dict[str, AtCommand] = {
    'udpControl.raw("REF", 290717696)': at.ref(fly=False),
    'udpControl.raw("REF", 290718208)': at.ref(fly=True),
    'udpControl.raw("REF", 290717952)': at.ref(fly=False, emergency=True),
    "udpControl.pcmd()": at.hover(),
    "udpControl.pcmd({})": at.hover(),
    'udpControl.pcmd({"left":0.8})': at.pcmd(**ZERO | {"roll": -0.8}),
    'udpControl.pcmd({"front":0.5})': at.pcmd(**ZERO | {"pitch": -0.5}),
    'udpControl.pcmd({"back":0.5})': at.pcmd(**ZERO | {"pitch": 0.5}),
    'udpControl.pcmd({"up":0.3})': at.pcmd(**ZERO | {"gaz": 0.3}),
    'udpControl.pcmd({"clockwise":0.25})': at.pcmd(**ZERO | {"yaw": 0.25}),
    'udpControl.pcmd({"counterClockwise":0.25})': at.pcmd(**ZERO | {"yaw": -0.25}),
    'udpControl.pcmd({"front":1,"right":1,"up":1,"clockwise":1})': at.pcmd(roll=1, pitch=-1, gaz=1, yaw=1),
    'udpControl.pcmd({"right":0})': at.pcmd(**ZERO),
    'udpControl.pcmd({"front":0.05,"left":0.05,"up":0.01,"clockwise":0.001})': at.pcmd(
        roll=-0.05, pitch=-0.05, gaz=0.01, yaw=0.001
    ),
    "udpControl.ftrim()": at.ftrim(),
    'udpControl.raw("COMWDG")': at.comwdg(),
    "udpControl.ctrl(4, 0)": at.ctrl(at.CTRL_SEND_CONFIG),
    'udpControl.config("general:navdata_demo", "TRUE")': at.config("general:navdata_demo", "TRUE"),
    'udpControl.config("video:video_channel", 1)': at.config("video:video_channel", "1"),
    'udpControl.raw("CONFIG_IDS", ["\\"66443ff6\\"","\\"a07a12ac\\"","\\"dc8a5834\\""])': at.config_ids(
        "66443ff6", "a07a12ac", "dc8a5834"
    ),
}


def command_of(text: str) -> tuple[int, AtCommand]:
    """Read a recorded line back: the sequence number and the command with its arguments' bit patterns."""
    match = re.fullmatch(r"AT\*(\w+)=(\d+)((?:,.*)?)\r", text)
    assert match is not None
    arguments = re.findall(r',(?:"([^"]*)"|(-?\d+))', match[3])
    return int(match[2]), AtCommand(match[1], tuple(word or int(number) for word, number in arguments))


@pytest.mark.parametrize("vector", GOLDEN["at"], ids=lambda vector: vector["call"][:60])
def test_recorded_commands_are_written_byte_for_byte(vector: dict[str, Any]) -> None:
    for text, hexadecimal in zip(vector["datagrams"], vector["hex"], strict=True):
        commands = [command_of(part) for part in text.splitlines(keepends=True)]
        assert b"".join(command.encode(n) for n, command in commands).hex() == hexadecimal


@pytest.mark.parametrize("call", OURS)
def test_named_commands_are_the_recorded_bytes(call: str) -> None:
    (vector,) = (vector for vector in GOLDEN["at"] if vector["call"] == call)
    assert [datagram.hex() for datagram in at.AtEncoder().datagrams([[OURS[call]]])] == vector["hex"]


def test_floats_travel_as_the_recorded_integers() -> None:
    for text, bits in GOLDEN["float_as_int32"].items():
        assert at.float_bits(float(text)) == bits


def broken(packet: dict[str, Any]) -> bool:
    return "error" in packet


@pytest.mark.parametrize(
    "packet", [p for p in GOLDEN["navdata"] if not broken(p)], ids=lambda packet: packet["name"]
)
def test_recorded_navdata_is_read(packet: dict[str, Any]) -> None:
    raw = packet["raw"]
    read = navdata.parse(bytes.fromhex(packet["hex"]))
    assert read.state == raw["state"]
    assert [bit for bit in range(32) if read.state >> bit & 1] == raw["state_bits"]
    assert read.sequence == raw["sequence"]
    assert read.vision == bool(raw["vision_flag"])
    sizes = [[tag, len(payload) + 4] for tag, payload in read.options.items()]
    assert [*sizes, [0xFFFF, 8]] == raw["options_tag_size"]
    if (demo := raw.get("demo")) is None:
        assert read.demo is None
        return
    assert read.demo is not None
    assert read.demo.major == demo["major"]
    assert read.demo.minor == demo["minor"]
    assert read.demo.battery_percent == demo["battery_percent"]
    assert math.degrees(read.demo.pitch_rad) * 1000 == pytest.approx(demo["theta_mdeg"])
    assert math.degrees(read.demo.roll_rad) * 1000 == pytest.approx(demo["phi_mdeg"])
    assert math.degrees(read.demo.yaw_rad) * 1000 == pytest.approx(demo["psi_mdeg"])
    assert read.demo.height_m * 1000 == pytest.approx(demo["altitude_mm"])
    assert read.demo.vx_mps * 1000 == pytest.approx(demo["vx_mm_s"])
    assert read.demo.vy_mps * 1000 == pytest.approx(demo["vy_mm_s"])


def test_options_that_lie_unaligned_are_read() -> None:
    (packet,) = (p for p in GOLDEN["navdata"] if p["name"] == "full_selected_options")
    read = navdata.parse(bytes.fromhex(packet["hex"]))
    assert read.clock_us == round(packet["parsed"]["time"] * 1000)
    assert read.climb_mps == packet["parsed"]["altitude"]["velocity"] / 1000


@pytest.mark.parametrize(
    "packet", [p for p in GOLDEN["navdata"] if broken(p)], ids=lambda packet: packet["name"]
)
def test_recorded_broken_navdata_is_refused(packet: dict[str, Any]) -> None:
    with pytest.raises(navdata.NavdataError):
        navdata.parse(bytes.fromhex(packet["hex"]))


@pytest.mark.parametrize("chunk", [1, 7, 64, 1448, 1 << 20])
def test_recorded_video_is_cut_into_its_frames(chunk: int) -> None:
    stream = golden.pave_68()
    expected = GOLDEN["pave"][1]["frames"]
    parser = pave.PaveParser()
    frames = [f for at_ in range(0, len(stream), chunk) for f in parser.feed(stream[at_ : at_ + chunk])]
    assert parser.skipped_bytes == 0
    for frame, wanted in zip(frames, expected, strict=True):
        assert asdict(frame.header) == {k: wanted[k] for k in asdict(frame.header)}
        assert hashlib.sha256(frame.payload).hexdigest() == wanted["payload_sha256"]


@pytest.mark.parametrize("recording", GOLDEN["pave"], ids=lambda recording: recording["fixture"][-12:])
def test_recorded_headers_of_both_sizes_are_read(recording: dict[str, Any]) -> None:
    for wanted in recording["frames"]:
        header = pave.parse_header(bytes.fromhex(wanted["header_hex"]))
        assert header is not None
        assert asdict(header) == {k: wanted[k] for k in asdict(header)}
        assert len(bytes.fromhex(wanted["header_hex"])) == header.header_size
