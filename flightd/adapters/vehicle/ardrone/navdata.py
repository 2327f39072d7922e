"""Navdata: what an AR.Drone 2.0 tells about itself on UDP 5554.

A packet is a 16-byte header and a chain of options (tag, size with these four bytes, payload), all
little-endian and never aligned, closed by a checksum option: the plain sum of all bytes before it.
Newer firmware adds tags and lengthens options, so both are skipped by size, never refused.
"""

from __future__ import annotations

import enum
import math
import struct
from collections.abc import Mapping
from dataclasses import dataclass, field

HEADERS = (0x55667788, 0x55667789)
MAX_BYTES = 4096
WAKE_UP = b"\x01\x00\x00\x00"
"""Sent to the drone's navdata port: stream to this address (unicast)."""

_PACKET = struct.Struct("<IIII")
_OPTION = struct.Struct("<HH")
_CHECKSUM_TAG = 0xFFFF
_DEMO = struct.Struct("<HHIfffifff")
_ALTITUDE = struct.Struct("<ifii")
_RAW_BATTERY_OFFSET = 16
_MAX_ANGLE_MDEG = 360_000.0
_MAX_ALTITUDE_MM = 1_000_000
_MAX_SPEED_MMPS = 100_000.0


class NavdataError(ValueError):
    """This datagram is not a whole, sound navdata packet."""


class DroneState(enum.IntFlag):
    """The 32 state bits of the packet header."""

    FLY = 1 << 0
    VIDEO = 1 << 1
    VISION = 1 << 2
    CONTROL = 1 << 3
    ALTITUDE = 1 << 4
    USER_FEEDBACK_START = 1 << 5
    COMMAND_ACK = 1 << 6
    CAMERA_READY = 1 << 7
    TRAVELLING = 1 << 8
    USB = 1 << 9
    NAVDATA_DEMO = 1 << 10
    NAVDATA_BOOTSTRAP = 1 << 11
    MOTORS = 1 << 12
    COM_LOST = 1 << 13
    SOFTWARE_FAULT = 1 << 14
    VBAT_LOW = 1 << 15
    USER_EMERGENCY_LANDING = 1 << 16
    TIMER_ELAPSED = 1 << 17
    MAGNETO_NEEDS_CALIBRATION = 1 << 18
    ANGLES_OUT_OF_RANGE = 1 << 19
    WIND = 1 << 20
    ULTRASOUND = 1 << 21
    CUTOUT = 1 << 22
    PIC_VERSION = 1 << 23
    ATCODEC_THREAD = 1 << 24
    NAVDATA_THREAD = 1 << 25
    VIDEO_THREAD = 1 << 26
    ACQUISITION_THREAD = 1 << 27
    CTRL_WATCHDOG = 1 << 28
    ADC_WATCHDOG = 1 << 29
    COM_WATCHDOG = 1 << 30
    EMERGENCY = 1 << 31


class Option(enum.IntEnum):
    """The option tags this program asks for."""

    DEMO = 0
    TIME = 1
    RAW_MEASURES = 2
    ALTITUDE = 10
    VISION_DETECT = 16


class Major(enum.IntEnum):
    """What the drone's flight control is doing."""

    DEFAULT = 0
    INIT = 1
    LANDED = 2
    FLYING = 3
    HOVERING = 4
    TEST = 5
    TAKE_OFF = 6
    GO_TO_FIX = 7
    LANDING = 8
    LOOPING = 9


@dataclass(frozen=True, slots=True)
class Demo:
    """Option 0.  Attitude as in `core.types.Attitude`, yaw relative to the heading at start-up; speeds of
    the body in the horizontal plane, x forward, y right; height above the floor.  The option's own
    vertical speed is always zero in the field and is left out."""

    major: int
    minor: int
    battery_percent: int
    roll_rad: float
    pitch_rad: float
    yaw_rad: float
    height_m: float
    vx_mps: float
    vy_mps: float


@dataclass(frozen=True, slots=True)
class Navdata:
    """One sound packet; what was not in it is None.  `options` holds every payload by tag."""

    state: DroneState
    sequence: int
    vision: bool
    demo: Demo | None = None
    clock_us: int | None = None
    battery_v: float | None = None
    climb_mps: float | None = None
    options: Mapping[int, bytes] = field(default_factory=dict)


def parse(datagram: bytes) -> Navdata:
    """Read one packet.  Raises `NavdataError` for a foreign header, a broken chain, a wrong or missing
    checksum and for numbers no drone can mean; an option too short for its layout counts as absent."""
    if not _PACKET.size <= len(datagram) <= MAX_BYTES:
        raise NavdataError(f"{len(datagram)} bytes are no navdata packet")
    header, state, sequence, vision = _PACKET.unpack_from(datagram)
    if header not in HEADERS:
        raise NavdataError(f"foreign header 0x{header:08x}")
    options = _options(datagram)
    return Navdata(
        state=DroneState(state),
        sequence=sequence,
        vision=bool(vision),
        demo=_demo(options.get(Option.DEMO, b"")),
        clock_us=_clock_us(options.get(Option.TIME, b"")),
        battery_v=_battery_v(options.get(Option.RAW_MEASURES, b"")),
        climb_mps=_climb_mps(options.get(Option.ALTITUDE, b"")),
        options=options,
    )


def _options(datagram: bytes) -> dict[int, bytes]:
    options: dict[int, bytes] = {}
    at = _PACKET.size
    while at + _OPTION.size <= len(datagram):
        tag, size = _OPTION.unpack_from(datagram, at)
        end = at + size
        if size < _OPTION.size or end > len(datagram):
            raise NavdataError(f"option {tag} of {size} bytes runs out of the packet")
        if tag == _CHECKSUM_TAG:
            if (
                size < 8
                or int.from_bytes(datagram[at + 4 : at + 8], "little") != sum(datagram[:at]) & 0xFFFFFFFF
            ):
                raise NavdataError("wrong checksum")
            return options
        options[tag] = datagram[at + _OPTION.size : end]
        at = end
    raise NavdataError("truncated: no checksum at the end")


def _demo(payload: bytes) -> Demo | None:
    if len(payload) < _DEMO.size:
        return None
    minor, major, battery, *angles_mdeg, altitude_mm, vx_mmps, vy_mmps, _ = _DEMO.unpack_from(payload)
    sound = (
        all(abs(angle) <= _MAX_ANGLE_MDEG for angle in angles_mdeg)
        and abs(altitude_mm) <= _MAX_ALTITUDE_MM
        and all(abs(speed) <= _MAX_SPEED_MMPS for speed in (vx_mmps, vy_mmps))
    )
    if not sound:
        raise NavdataError("demo option holds numbers that no drone can mean")
    theta_mdeg, phi_mdeg, psi_mdeg = angles_mdeg
    return Demo(
        major=major,
        minor=minor,
        battery_percent=min(battery, 100),
        roll_rad=math.radians(phi_mdeg / 1000.0),
        pitch_rad=math.radians(theta_mdeg / 1000.0),
        yaw_rad=math.radians(psi_mdeg / 1000.0),
        height_m=altitude_mm / 1000.0,
        vx_mps=vx_mmps / 1000.0,
        vy_mps=vy_mmps / 1000.0,
    )


def _clock_us(payload: bytes) -> int | None:
    """The drone's clock, microseconds; wraps at 2048 s."""
    if len(payload) < 4:
        return None
    word = int.from_bytes(payload[:4], "little")
    return (word >> 21) * 1_000_000 + (word & 0x1FFFFF)


def _battery_v(payload: bytes) -> float | None:
    if len(payload) < _RAW_BATTERY_OFFSET + 4:
        return None
    return int.from_bytes(payload[_RAW_BATTERY_OFFSET : _RAW_BATTERY_OFFSET + 4], "little") / 1000.0


def _climb_mps(payload: bytes) -> float | None:
    if len(payload) < _ALTITUDE.size:
        return None
    _, vz_mmps, _, _ = _ALTITUDE.unpack_from(payload)
    return vz_mmps / 1000.0 if abs(vz_mmps) <= _MAX_SPEED_MMPS else None


class NavdataOrder:
    """Drops what arrives late, and survives a drone that counts from 1 again.

    A packet is taken when its number is larger than the last one's.  The last number is forgotten after
    a second without a good packet, with every packet that says COM_WATCHDOG, and in bootstrap, where all
    packets have number 1.  A forward leap no radio gap explains is taken for damage.
    """

    SILENCE_NS = 1_000_000_000
    MAX_LEAP = 2000

    def __init__(self) -> None:
        self._last = 0
        self._last_ns: int | None = None

    def accept(self, packet: Navdata, now_ns: int) -> bool:
        forget = DroneState.COM_WATCHDOG | DroneState.NAVDATA_BOOTSTRAP
        ahead = packet.sequence - self._last
        fresh = (
            self._last_ns is None or now_ns - self._last_ns >= self.SILENCE_NS or bool(packet.state & forget)
        )
        if not fresh and not 0 < ahead <= self.MAX_LEAP:
            return False
        self._last, self._last_ns = packet.sequence, now_ns
        return True
