"""AT commands as an AR.Drone 2.0 reads them on UDP 5556.

One command is ``AT*NAME=sequence[,argument]*`` and a carriage return, 8-bit ASCII.  Whole numbers are
decimal, strings stand in double quotes, and a float is the decimal of its IEEE-754 single read as a
signed 32-bit integer.  All commands of a client share one counter; the drone obeys only numbers larger
than the last it took, and takes 1 as "a client starts anew".
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

MAX_DATAGRAM_BYTES = 1024
"""The drone's command buffer; it rejects a longer datagram whole."""

MAX_STRING = 128
"""Longest string argument, characters."""

REF_FIXED_BITS = 0x11540000
"""Bits 18, 20, 22, 24 and 28 of REF: five neutral trims.  Zeros there change the trims that an AR.Drone 1
stores."""

REF_FLY = 1 << 9
REF_EMERGENCY = 1 << 8

PCMD_PROGRESSIVE = 1

_LEAST_FRACTION = 1e-6

CTRL_SEND_CONFIG = 4
CTRL_CLEAR_ACK = 5

Argument: TypeAlias = int | float | str


def float_bits(value: float) -> int:
    """The signed 32-bit integer with the bits of `value` as an IEEE-754 single."""
    if not math.isfinite(value):
        raise ValueError(f"an AT argument must be finite, not {value}")
    bits: int = struct.unpack("<i", struct.pack("<f", value))[0]
    return bits


@dataclass(frozen=True, slots=True)
class AtCommand:
    """One command without its number.  The type of an argument chooses its notation."""

    name: str
    arguments: tuple[Argument, ...] = ()

    def encode(self, sequence: int) -> bytes:
        text = ",".join([str(sequence), *(_notation(argument) for argument in self.arguments)])
        return f"AT*{self.name}={text}\r".encode("ascii")


def _notation(argument: Argument) -> str:
    if isinstance(argument, str):
        if (
            len(argument) > MAX_STRING
            or not argument.isascii()
            or not argument.isprintable()
            or '"' in argument
        ):
            raise ValueError(f"not a string the drone can read: {argument!r}")
        return f'"{argument}"'
    if isinstance(argument, float):
        return str(float_bits(argument))
    return str(argument)


def ref(*, fly: bool, emergency: bool = False) -> AtCommand:
    """Take-off and landing.  `fly` is a level: each REF without it lands a flying drone.  `emergency` acts
    on its rising edge and toggles: it cuts the motors, or clears an emergency that is over."""
    bits = REF_FIXED_BITS | (REF_FLY if fly else 0) | (REF_EMERGENCY if emergency else 0)
    return AtCommand("REF", (bits,))


def hover() -> AtCommand:
    """Brake and hold the position by the bottom camera (the progressive flag is zero)."""
    return AtCommand("PCMD", (0, 0, 0, 0, 0))


def pcmd(*, roll: float, pitch: float, gaz: float, yaw: float) -> AtCommand:
    """Fly by fractions -1..1 of the configured limits, clamped here.

    roll + right side down and pitch + nose up are tilts, fractions of `control:euler_angle_max`; gaz + up
    is a climb rate, of `control:control_vz_max`; yaw + clockwise from above a turn rate, of
    `control:control_yaw`.  What would be minus zero on the wire goes out as zero.
    """
    clamped = (min(1.0, max(-1.0, value)) for value in (roll, pitch, gaz, yaw))
    fractions = (value if abs(value) >= _LEAST_FRACTION else 0.0 for value in clamped)
    return AtCommand("PCMD", (PCMD_PROGRESSIVE, *fractions))


def ftrim() -> AtCommand:
    """Take the present attitude as level.  Only on flat ground with the motors off."""
    return AtCommand("FTRIM")


def comwdg() -> AtCommand:
    """Reset the drone's communication watchdog."""
    return AtCommand("COMWDG")


def ctrl(mode: int) -> AtCommand:
    """`CTRL_SEND_CONFIG` or `CTRL_CLEAR_ACK`."""
    return AtCommand("CTRL", (mode, 0))


def config(key: str, value: str) -> AtCommand:
    """Write one `section:key`; every value travels as text."""
    return AtCommand("CONFIG", (key, value))


def config_ids(session: str, user: str, application: str) -> AtCommand:
    """Names the profile that the CONFIG right behind it means; three times eight lower-case hex digits."""
    for name in (session, user, application):
        if len(name) != 8 or not set(name) <= set("0123456789abcdef"):
            raise ValueError(f"a profile id has eight lower-case hex digits, not {name!r}")
    return AtCommand("CONFIG_IDS", (session, user, application))


class AtEncoder:
    """Numbers commands and packs them into datagrams.

    The first command of a client has number 1, which resets the drone's counter.  The counter then only
    grows, also over a lost link or a rebooted drone: any larger number is good there.  `restart` is for
    the one other case, a second client that had left the drone's counter above ours.
    """

    def __init__(self) -> None:
        self._last = 0

    def restart(self) -> None:
        """The next command is number 1 again."""
        self._last = 0

    def datagrams(self, groups: Iterable[Sequence[AtCommand]]) -> list[bytes]:
        """Number the commands in order and fill datagrams of at most `MAX_DATAGRAM_BYTES`; a group is
        never spread over two (CONFIG_IDS has to stand right before its CONFIG)."""
        done: list[bytes] = []
        current = b""
        for group in groups:
            piece = b"".join(command.encode(self._last + n) for n, command in enumerate(group, 1))
            if len(piece) > MAX_DATAGRAM_BYTES:
                raise ValueError(f"{len(piece)} bytes of commands do not fit one datagram")
            self._last += len(group)
            if len(current) + len(piece) > MAX_DATAGRAM_BYTES:
                done.append(current)
                current = b""
            current += piece
        return [*done, current] if current else done
