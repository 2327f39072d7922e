"""The drone's flight states, the bits by which it tells of itself, and what is not documented of it."""

from __future__ import annotations

import enum
from dataclasses import dataclass

REF_FLY = 1 << 9
REF_EMERGENCY = 1 << 8
PCMD_PROGRESSIVE = 1

BIT_FLY = 1 << 0
BIT_ALTITUDE = 1 << 4
BIT_COMMAND_ACK = 1 << 6
BIT_CAMERA = 1 << 7
BIT_DEMO = 1 << 10
BIT_BOOTSTRAP = 1 << 11
BIT_COM_LOST = 1 << 13
BIT_VBAT_LOW = 1 << 15
BIT_CUTOUT = 1 << 22
BITS_THREADS = 0b11111 << 23
BIT_COM_WATCHDOG = 1 << 30
BIT_EMERGENCY = 1 << 31


class MajorState(enum.IntEnum):
    DEFAULT = 0
    INIT = 1
    LANDED = 2
    FLYING = 3
    HOVERING = 4
    TAKE_OFF = 6
    GO_TO_FIX = 7
    LANDING = 8


AIRBORNE = frozenset(
    {MajorState.FLYING, MajorState.HOVERING, MajorState.TAKE_OFF, MajorState.GO_TO_FIX, MajorState.LANDING}
)


@dataclass(frozen=True, slots=True)
class DroneOptions:
    """Choices where nothing is documented, and what differs from drone to drone."""

    take_off_height_m: float = 0.9
    spin_up_s: float = 0.8
    take_off_climb_mps: float = 0.5
    land_sink_mps: float = 0.4
    low_battery_frac: float = 0.20
    forced_landing_frac: float = 0.05
    config_needs_clear_ack: bool = True
    config_needs_navdata: bool = False
    profile_switch_s: float = 0.3


@dataclass(slots=True)
class Stick:
    """The newest PCMD."""

    flag: int = 0
    roll: float = 0.0
    pitch: float = 0.0
    gaz: float = 0.0
    yaw: float = 0.0
