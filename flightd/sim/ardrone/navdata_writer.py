"""Writes navdata packets."""

from __future__ import annotations

import struct
from collections.abc import Iterable
from dataclasses import dataclass

HEADER = 0x55667788

TAG_DEMO = 0
TAG_TIME = 1
TAG_RAW_MEASURES = 2
TAG_ALTITUDE = 10
TAG_VISION_DETECT = 16
TAG_CHECKSUM = 0xFFFF

# fmt: off
OPTION_BYTES = {
    0: 148, 1: 8, 2: 52, 3: 46, 4: 16, 5: 12, 6: 88, 7: 16, 8: 24, 9: 76, 10: 56, 11: 16, 12: 44, 13: 92,
    14: 108, 15: 364, 16: 328, 17: 8, 18: 40, 19: 65, 20: 12, 21: 18, 22: 75, 23: 56, 24: 72, 25: 32, 26: 8,
    27: 216,
}
# fmt: on
"""Sizes of firmware 2.4.8's options with their 4-byte headers; what the emulator does not model is zero."""

ALL_OPTIONS = tuple(OPTION_BYTES)

_IDENTITY = struct.pack("<9f3f", 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0)
_DEMO = struct.Struct("<IIfffifffI")
_NO_DETECTION = 3
_NOTHING_DETECTED = bytes(OPTION_BYTES[TAG_VISION_DETECT] - 4)


@dataclass(frozen=True, slots=True)
class NavdataReport:
    """What the drone tells of itself, in the units of the wire: millidegrees, millimetres, percent."""

    state: int
    sequence: int
    major: int = 0
    minor: int = 0
    battery_percent: int = 0
    battery_mv: int = 0
    theta_mdeg: float = 0.0
    phi_mdeg: float = 0.0
    psi_mdeg: float = 0.0
    altitude_mm: int = 0
    sonar_mm: int = 0
    vx_mmps: float = 0.0
    vy_mmps: float = 0.0
    vz_mmps: float = 0.0
    time_us: int = 0
    vision: bool = True


def packet(report: NavdataReport, tags: Iterable[int]) -> bytes:
    """A whole packet with these options, in this order."""
    body = struct.pack("<IIII", HEADER, report.state, report.sequence, int(report.vision))
    body += b"".join(_option(tag, _payload(report, tag)) for tag in tags)
    return body + _option(TAG_CHECKSUM, struct.pack("<I", sum(body) & 0xFFFFFFFF))


def bootstrap(state: int) -> bytes:
    """The 24 bytes sent until the client has configured its navdata; their number stays 1."""
    return packet(NavdataReport(state, 1, vision=False), ())


def _option(tag: int, payload: bytes) -> bytes:
    return struct.pack("<HH", tag, len(payload) + 4) + payload


def _payload(report: NavdataReport, tag: int) -> bytes:
    size = OPTION_BYTES[tag] - 4
    if tag == TAG_DEMO:
        head = _DEMO.pack(
            report.major << 16 | report.minor,
            report.battery_percent,
            report.theta_mdeg,
            report.phi_mdeg,
            report.psi_mdeg,
            report.altitude_mm,
            report.vx_mmps,
            report.vy_mmps,
            0.0,  # the real drone never fills its vertical speed
            0,
        )
        return head + _IDENTITY + struct.pack("<II", 0, _NO_DETECTION) + _IDENTITY
    if tag == TAG_TIME:
        seconds, micros = divmod(report.time_us, 1_000_000)
        return struct.pack("<I", (seconds & 0x7FF) << 21 | micros)
    if tag == TAG_RAW_MEASURES:
        return struct.pack("<16xI", report.battery_mv).ljust(size, b"\0")
    if tag == TAG_ALTITUDE:
        head = struct.pack("<ifii", report.altitude_mm, report.vz_mmps, report.altitude_mm, report.sonar_mm)
        return head.ljust(size, b"\0")
    if tag == TAG_VISION_DETECT:
        return _NOTHING_DETECTED
    return bytes(size)
