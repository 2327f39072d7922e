"""What the adapter has to know about the drone and how it should be flown."""

from __future__ import annotations

import enum
import math
import zlib
from dataclasses import dataclass
from typing import Any
from urllib.parse import parse_qsl, urlsplit

from flightd.config.control import ControlConfig
from flightd.core.errors import InputError

_TILT_RAD, _CLIMB_MPS, _YAW_RATE_RADPS = (0.0, 0.52), (0.2, 2.0), (0.7, 6.11)
"""The ranges in the maker's guide."""
_HEIGHT_M, _HIGHEST_M = (0.5, 100.0), 6.0
_PORT_NAMES = ("at", "navdata", "video", "control")


class DroneCamera(enum.IntEnum):
    """Values of `video:video_channel`; only one camera is streamed at a time."""

    FRONT = 0
    DOWN = 1


def profile_id(name: str) -> str:
    """Eight hex digits for a session, user or application, made from its name as Parrot's SDK does."""
    return f"{zlib.crc32(name.encode()):08x}"


@dataclass(frozen=True, slots=True)
class ArDroneSettings:
    """Address, limits and times.

    The limits are what the drone's own loops are set to; setpoints travel as fractions of them.  Indoor
    defaults are the drone's own (12 deg, 0.7 m/s, 100 deg/s).  `full_navdata` asks for 200 packets a
    second with all options instead of 15 short ones: fresher attitude for a hundred times the air time.
    A drone found flying is held for `unattended_s`, then landed if nothing has been demanded.
    `standing_height_m` is the sonar above the floor while the drone stands, when it cannot measure.
    """

    host: str = "192.168.1.1"
    at_port: int = 5556
    navdata_port: int = 5554
    video_port: int = 5555
    control_port: int = 5559

    tilt_max_rad: float = math.radians(12.0)
    climb_max_mps: float = 0.7
    yaw_rate_max_radps: float = math.radians(100.0)
    height_max_m: float = _HIGHEST_M
    camera: DroneCamera = DroneCamera.DOWN
    video_bitrate_kbps: int = 4000
    full_navdata: bool = False

    session: str = profile_id("flightd session")
    user: str = profile_id("flightd user")
    application: str = profile_id("flightd application")

    period_s: float = 0.030
    setpoint_timeout_s: float = 0.15
    attitude_latency_s: float = 0.0
    telemetry_stale_s: float = 0.5
    link_lost_s: float = 2.0
    take_off_patience_s: float = 3.0
    unattended_s: float = 10.0
    land_below_m: float = 0.35
    standing_height_m: float = 0.10
    camera_settle_s: float = 0.3

    def __post_init__(self) -> None:
        bounds = {
            "tilt_max_rad": _TILT_RAD,
            "climb_max_mps": _CLIMB_MPS,
            "yaw_rate_max_radps": _YAW_RATE_RADPS,
            "height_max_m": _HEIGHT_M,
            "period_s": (0.005, 0.045),
            "setpoint_timeout_s": (0.02, 1.0),
            "link_lost_s": (0.5, 10.0),
        }
        for name, (low, high) in bounds.items():
            value = getattr(self, name)
            if not low <= value <= high or value == 0.0:
                raise ValueError(f"{name} = {value} outside {low}..{high}")


def settings_of(
    url: str, limits: ControlConfig | None = None, highest_m: float = math.inf
) -> ArDroneSettings:
    """Settings for `ardrone://HOST`, with `?at=5556&navdata=5554&video=5555&control=5559&full=1` where they
    differ from the drone's own ports and short navdata; the drone's limits after `limits` and the greatest
    height that may be flown, as near as its ranges allow.

    Raises `InputError` for anything else.
    """
    parts = urlsplit(url)
    given = dict(parse_qsl(parts.query, keep_blank_values=True))
    unknown = set(given) - {*_PORT_NAMES, "full"}
    ports = [given[name] for name in _PORT_NAMES if name in given]
    sound = all(port.isascii() and port.isdigit() and 0 < int(port) < 65536 for port in ports)
    if parts.scheme != "ardrone" or not parts.hostname or unknown or not sound:
        raise InputError(
            f"vehicle.url {url!r}: expected ardrone://HOST, for example ardrone://192.168.1.1 "
            "(other ports: ?at=5556&navdata=5554&video=5555&control=5559, all navdata: full=1)"
        )
    chosen: dict[str, Any] = {f"{name}_port": int(given[name]) for name in _PORT_NAMES if name in given}
    if limits is not None:
        chosen |= {
            name: min(max(value, least), most)
            for name, value, (least, most) in (
                ("tilt_max_rad", limits.max_tilt_rad, _TILT_RAD),
                ("climb_max_mps", max(limits.max_climb_mps, limits.max_descend_mps), _CLIMB_MPS),
                ("yaw_rate_max_radps", limits.max_yaw_rate_radps, _YAW_RATE_RADPS),
            )
        }
    chosen["height_max_m"] = max(min(highest_m, _HIGHEST_M), _HEIGHT_M[0])
    return ArDroneSettings(host=parts.hostname, full_navdata=given.get("full") == "1", **chosen)
