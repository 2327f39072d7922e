"""Ways to spoil an input: bytes for binary formats, lines and values for TOML, both for JSON."""

from __future__ import annotations

import random
import re
from collections.abc import Callable, Sequence
from typing import TypeAlias

Mutate: TypeAlias = Callable[[random.Random, Sequence[bytes]], bytes]

_NASTY = (
    b"nan", b"-inf", b"0", b"-0.0", b"-1", b"1e308", b"1e-320", b"9223372036854775808", b"1" + b"0" * 400,
    b"true", b"null", b'""', b'"\\u0000"', b'"' + b"x" * 5000 + b'"', b'"\\ud800"', b'"\xf0\x9f\x9a\x81"',
    b"[]", b"[[]]", b"{}", b"[1, 2]", b'["a", "a"]', b"[1e9, 1e9]", b"1979-05-27T07:32:00Z", b"0x7f", b"'..'",
    b'"/dev/null"', b'"../../etc"', b'"udp://127.0.0.1:99999999"', b'"A1"', b'"{aisle.__class__}"',
    b'"{bay:999999}"', b"[" * 300 + b"]" * 300,
)  # fmt: skip
_VALUE = re.compile(rb"(?<=[=:,\[])\s*(\"[^\"\n]*\"|[-+\w.]+)")
_NUMBER = re.compile(rb"\d{1,12}(\.\d{1,12})?")
_LENGTHS = (0, 1, 0x7F, 0xFF, 0xFFFF, 0x7FFFFFFF, 0xFFFFFFFF, 0x7FFFFFFFFFFFFFFF, 0xFFFFFFFFFFFFFFFF)


def spoil_bytes(rng: random.Random, corpus: Sequence[bytes]) -> bytes:
    """Flip, cut, insert, repeat, join; and write lengths that lie."""
    data = bytearray(rng.choice(corpus))
    for _ in range(1 + rng.randrange(4)):
        at = rng.randrange(len(data) + 1)
        match rng.randrange(8):
            case 0:
                data[at:at] = rng.randbytes(rng.randrange(1, 20))
            case 1:
                del data[at : at + rng.randrange(1, 40)]
            case 2:
                del data[at:]
            case 3:
                other = rng.choice(corpus)
                data[at:] = other[rng.randrange(len(other) + 1) :]
            case 4:
                width = rng.choice((1, 2, 4, 8))
                data[at : at + width] = (rng.choice(_LENGTHS) & (256**width - 1)).to_bytes(width, "little")
            case 5:
                data[at:at] = data[at : at + rng.randrange(1, 200)]
            case _ if at < len(data):
                data[at] = rng.randrange(256)
    return bytes(data)


def spoil_text(rng: random.Random, corpus: Sequence[bytes]) -> bytes:
    """Replace values and lines of a text; now and then bytes anywhere."""
    if rng.randrange(6) == 0:
        return spoil_bytes(rng, corpus)
    data = rng.choice(corpus)
    for _ in range(1 + rng.randrange(3)):
        kind = rng.randrange(6)
        if kind < 3:
            data = _other_value(rng, data)
        else:
            lines = data.split(b"\n")
            at = rng.randrange(len(lines))
            if kind == 3:
                del lines[at]
            elif kind == 4:
                lines.insert(at, rng.choice(rng.choice(corpus).split(b"\n")))
            else:
                lines[at] = lines[at][::-1] if rng.randrange(4) == 0 else _other_key(rng, lines[at])
            data = b"\n".join(lines)
    return data


def _other_value(rng: random.Random, data: bytes) -> bytes:
    places = [match.span(1) for match in _VALUE.finditer(data)]
    if not places:
        return data
    start, end = rng.choice(places)
    old = data[start:end]
    new = rng.choice(_NASTY)
    if rng.randrange(3) == 0 and _NUMBER.fullmatch(old):
        new = repr(float(old) * rng.choice((-1, 0, 0.1, 0.99, 1.01, 10, 1e6))).encode()
    elif rng.randrange(4) == 0:
        other = rng.choice(places)
        new = data[other[0] : other[1]]
    return data[:start] + new + data[end:]


def _other_key(rng: random.Random, line: bytes) -> bytes:
    at = rng.randrange(len(line) + 1)
    return line[:at] + rng.choice((b"_", b".", b"[", b"]", b'"', b"=", b"#", b"\x00", b"\xff")) + line[at:]
