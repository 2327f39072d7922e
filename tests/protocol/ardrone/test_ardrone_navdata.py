"""Navdata: what is refused, what is tolerated, and which packet is the newest."""

from __future__ import annotations

import math
import struct
from dataclasses import replace

import pytest

from flightd.adapters.vehicle.ardrone.navdata import (
    DroneState,
    Navdata,
    NavdataError,
    NavdataOrder,
    parse,
)
from flightd.adapters.vehicle.ardrone.telemetry import NavdataTelemetry
from flightd.sim.ardrone.navdata_writer import ALL_OPTIONS, OPTION_BYTES, NavdataReport, bootstrap, packet

REPORT = NavdataReport(
    state=0x0F800490, sequence=7, major=4, battery_percent=80, theta_mdeg=1500.0, altitude_mm=990
)
MS = 1_000_000


def sealed(body: bytes) -> bytes:
    """A packet of these bytes with the right checksum."""
    return body + struct.pack("<HHI", 0xFFFF, 8, sum(body) & 0xFFFFFFFF)


def test_a_full_packet_has_the_size_of_the_real_one() -> None:
    whole = packet(REPORT, ALL_OPTIONS)
    assert len(whole) == 2120
    assert {tag: len(payload) + 4 for tag, payload in parse(whole).options.items()} == OPTION_BYTES


@pytest.mark.parametrize("whole", [packet(REPORT, ALL_OPTIONS), bootstrap(0x4F800C10)])
def test_a_packet_cut_anywhere_is_refused(whole: bytes) -> None:
    parse(whole)
    for length in range(len(whole)):
        with pytest.raises(NavdataError):
            parse(whole[:length])


def test_any_flipped_bit_outside_the_padding_is_refused() -> None:
    whole = packet(REPORT, (0,))
    for at in range(len(whole)):
        for bit in range(8):
            damaged = bytearray(whole)
            damaged[at] ^= 1 << bit
            if at < 4 and bytes(damaged[:4]) == bytes.fromhex("89776655"):
                continue
            with pytest.raises(NavdataError):
                parse(bytes(damaged))


def test_longer_and_unknown_options_are_passed_over_by_size() -> None:
    body = packet(REPORT, (0,))[:-8]
    longer = bytearray(body + b"extra")
    longer[18:20] = struct.pack("<H", 148 + 5)
    unknown = bytes(longer) + struct.pack("<HH", 99, 7) + b"abc"
    read = parse(sealed(unknown))
    assert read.demo is not None
    assert read.demo.height_m == 0.99
    assert read.options[99] == b"abc"


def test_an_option_too_short_for_its_layout_is_absent() -> None:
    body = packet(REPORT, ())[:-8] + struct.pack("<HH", 0, 20) + bytes(16)
    assert parse(sealed(body)).demo is None


@pytest.mark.parametrize("size", [0, 1, 3])
def test_an_option_smaller_than_its_own_header_is_refused(size: int) -> None:
    body = packet(REPORT, ())[:-8] + struct.pack("<HH", 5, size) + bytes(16)
    with pytest.raises(NavdataError, match="runs out"):
        parse(sealed(body))


@pytest.mark.parametrize("value", [float("nan"), float("inf"), -1e30])
def test_numbers_no_drone_can_mean_are_refused_even_under_a_right_checksum(value: float) -> None:
    for field in ("theta_mdeg", "phi_mdeg", "psi_mdeg", "vx_mmps", "vy_mmps"):
        with pytest.raises(NavdataError, match="no drone can mean"):
            parse(packet(replace(REPORT, **{field: value}), (0,)))  # type: ignore[arg-type]


def test_a_datagram_longer_than_any_packet_is_refused() -> None:
    with pytest.raises(NavdataError):
        parse(packet(REPORT, (0,)) + bytes(4096))


def numbered(sequence: int, state: int = 0) -> Navdata:
    return Navdata(DroneState(state), sequence, vision=True)


def test_only_newer_packets_are_taken() -> None:
    order = NavdataOrder()
    taken = [order.accept(numbered(n), 0) for n in (10, 11, 11, 9, 12, 14, 13)]
    assert taken == [True, True, False, False, True, True, False]


def test_a_rebooted_drone_is_heard_again_after_a_second_of_silence() -> None:
    order = NavdataOrder()
    assert order.accept(numbered(5000), 0)
    assert not order.accept(numbered(2), 999 * MS)
    assert order.accept(numbered(3), 1000 * MS)
    assert order.accept(numbered(4), 1001 * MS)


def test_the_number_is_forgotten_while_the_drone_misses_commands_or_boots() -> None:
    for state in (DroneState.COM_WATCHDOG, DroneState.NAVDATA_BOOTSTRAP):
        order = NavdataOrder()
        assert order.accept(numbered(5000), 0)
        assert order.accept(numbered(1, state), 10 * MS)
        assert order.accept(numbered(1, state), 20 * MS)
        assert order.accept(numbered(2), 30 * MS)


def test_one_absurd_number_does_not_silence_the_drone() -> None:
    order = NavdataOrder()
    assert order.accept(numbered(100), 0)
    assert not order.accept(numbered(0xFFFF0000), 5 * MS)
    assert order.accept(numbered(101), 10 * MS)


def test_volts_that_are_told_no_longer_are_not_known() -> None:
    """They stayed for ever what they were told last, whatever else the drone told."""
    telemetry = NavdataTelemetry(0)
    telemetry.observe(Navdata(DroneState(0), 1, False, battery_v=11.1), 1_000_000_000)
    assert telemetry.battery_v(1_900_000_000) == 11.1
    telemetry.observe(Navdata(DroneState(0), 2, False), 2_100_000_000)
    assert math.isnan(telemetry.battery_v(2_100_000_000))
