"""What the drone makes of the datagrams on its AT port.

Anyone may send anything here: what is not a well-formed command is passed over in silence, as the real
firmware does, and never costs the sound commands beside it.
"""

from __future__ import annotations

import math
import re
import struct
from dataclasses import dataclass
from typing import TypeAlias

MAX_DATAGRAM_BYTES = 1024
_MAX_SEQUENCE = 0x7FFFFFFF

_COMMAND = re.compile(rb"AT\*([A-Z_]{1,16})=(-?[0-9]{1,10})((?:,(?:\"[^\"\r]{0,128}\"|-?[0-9]{1,10}))*)")
_ARGUMENT = re.compile(rb",(?:\"([^\"\r]*)\"|(-?[0-9]+))")

Argument: TypeAlias = int | str


@dataclass(frozen=True, slots=True)
class DroneCommand:
    """One command; strings without their quotes, floats still as the integers they travel as."""

    name: str
    sequence: int
    arguments: tuple[Argument, ...]

    def integer(self, at: int) -> int | None:
        """The argument at `at` if it is there and a number."""
        value = self.arguments[at] if at < len(self.arguments) else None
        return value if isinstance(value, int) else None

    def text(self, at: int) -> str | None:
        """The argument at `at` if it is there and a string."""
        value = self.arguments[at] if at < len(self.arguments) else None
        return value if isinstance(value, str) else None

    def fraction(self, at: int) -> float | None:
        """The float argument at `at`, clamped to -1..1; None when absent or not a number at all."""
        bits = self.integer(at)
        if bits is None or not -(1 << 31) <= bits < 1 << 31:
            return None
        value: float = struct.unpack("<f", struct.pack("<i", bits))[0]
        return None if math.isnan(value) else min(1.0, max(-1.0, value)) + 0.0


def parse(datagram: bytes) -> list[DroneCommand]:
    """The well-formed commands of a datagram, in order; a datagram over 1024 bytes is refused whole."""
    if len(datagram) > MAX_DATAGRAM_BYTES:
        return []
    *lines, _unterminated = datagram.split(b"\r")
    return [command for line in lines if (command := _command(line)) is not None]


def _command(line: bytes) -> DroneCommand | None:
    match = _COMMAND.fullmatch(line)
    if match is None or not match[3].isascii():
        return None
    sequence = int(match[2])
    if not 0 <= sequence <= _MAX_SEQUENCE:
        return None
    arguments = tuple(
        word.decode("ascii") if not number else int(number) for word, number in _ARGUMENT.findall(match[3])
    )
    return DroneCommand(match[1].decode("ascii"), sequence, arguments)


class SequenceRule:
    """Obeys only numbers above the last one; 1 starts afresh, and so does a lost link (`reset`)."""

    def __init__(self) -> None:
        self.last = 0

    def accept(self, sequence: int) -> bool:
        if sequence == 1 or sequence > self.last:
            self.last = sequence
            return True
        return False

    def reset(self) -> None:
        self.last = 0
