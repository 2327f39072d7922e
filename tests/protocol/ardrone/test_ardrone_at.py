"""AT encoding: numbering, packing, and arguments that must never leave."""

from __future__ import annotations

import math
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flightd.adapters.vehicle.ardrone import at
from flightd.adapters.vehicle.ardrone.at import AtCommand, AtEncoder
from flightd.sim.ardrone import at_commands as commands


def test_the_first_command_is_number_one_and_the_counter_only_grows() -> None:
    encoder = AtEncoder()
    assert encoder.datagrams([[at.comwdg()]]) == [b"AT*COMWDG=1\r"]
    assert encoder.datagrams([[at.comwdg(), at.ftrim()]]) == [b"AT*COMWDG=2\rAT*FTRIM=3\r"]
    encoder.restart()
    assert encoder.datagrams([[at.comwdg()]]) == [b"AT*COMWDG=1\r"]


def test_ref_always_carries_the_fixed_bits() -> None:
    for fly in (False, True):
        for emergency in (False, True):
            (bits,) = at.ref(fly=fly, emergency=emergency).arguments
            assert isinstance(bits, int)
            assert bits & 0x11540000 == 0x11540000
            assert bits & ~0x11540000 == fly << 9 | emergency << 8


def test_a_full_datagram_is_followed_by_another_and_groups_stay_whole() -> None:
    group = [at.config_ids("00000001", "00000002", "00000003"), at.config("a:b", "x" * 100)]
    datagrams = AtEncoder().datagrams([group] * 20)
    assert all(len(datagram) <= at.MAX_DATAGRAM_BYTES for datagram in datagrams)
    assert len(datagrams) > 1
    for datagram in datagrams:
        names = [command.name for command in commands.parse(datagram)]
        assert names == ["CONFIG_IDS", "CONFIG"] * (len(names) // 2)
    numbers = [command.sequence for datagram in datagrams for command in commands.parse(datagram)]
    assert numbers == list(range(1, 41))


def test_a_group_too_long_for_one_datagram_is_refused() -> None:
    with pytest.raises(ValueError, match="do not fit"):
        AtEncoder().datagrams([[at.config("a:b", "x" * 128)] * 8])


@pytest.mark.parametrize("text", ['with "quotes"', "carriage\rreturn", "snowman ☃", "x" * 129, "nul\0"])
def test_strings_that_would_break_the_command_are_refused(text: str) -> None:
    with pytest.raises(ValueError, match="not a string the drone can read"):
        at.config("general:ssid", text).encode(1)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_a_number_that_is_none_never_leaves(value: float) -> None:
    with pytest.raises(ValueError, match="finite"):
        AtCommand("PCMD", (1, value)).encode(1)


@pytest.mark.parametrize("name", ["", "ABCDEF01", "0123456", "0123456g"])
def test_profile_ids_are_eight_lower_case_hex_digits(name: str) -> None:
    with pytest.raises(ValueError, match="eight lower-case hex digits"):
        at.config_ids("00000000", name, "00000000")


@given(st.floats(width=32, allow_nan=False, allow_infinity=False))
def test_float_arguments_keep_their_bits(value: float) -> None:
    assert struct.unpack("<f", struct.pack("<i", at.float_bits(value)))[0] == value


@given(*[st.floats(-5, 5)] * 4)
def test_the_drone_reads_what_pcmd_means(roll: float, pitch: float, gaz: float, yaw: float) -> None:
    (command,) = commands.parse(at.pcmd(roll=roll, pitch=pitch, gaz=gaz, yaw=yaw).encode(7))
    assert (command.name, command.sequence, command.integer(0)) == ("PCMD", 7, 1)
    for n, value in enumerate((roll, pitch, gaz, yaw), 1):
        assert command.fraction(n) == pytest.approx(min(1.0, max(-1.0, value)), abs=1.1e-6)
        assert command.integer(n) != -(1 << 31), "minus zero"
