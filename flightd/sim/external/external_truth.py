"""What an external simulator tells of its vehicle, as true motion on our map."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, TypeAlias

from flightd.core.geometry import wrap_pi
from flightd.sim.autopilot.guided import euler
from flightd.sim.plant.kinematics import Kinematics

Message: TypeAlias = Any

_METRES_PER_DEGREE = 111_319.49
_GPS_BLEND = 0.1
"""Share of each position sample that is believed against the integrated velocity: latitude and longitude
come in steps of a centimetre."""


@dataclass(frozen=True, slots=True)
class Placement:
    """Where on the map the external vehicle stands at the start."""

    x_m: float
    y_m: float
    yaw_rad: float
    rest_height_m: float = 0.10


@dataclass(frozen=True, slots=True)
class _Motion:
    """Pose and motion in north, east, up and heading of the external simulator."""

    north_m: float
    east_m: float
    up_m: float
    north_mps: float
    east_mps: float
    up_mps: float
    roll_rad: float
    pitch_rad: float
    heading_rad: float
    rates_radps: tuple[float, float, float]


class TruthReader:
    """Folds a simulator's messages into the true motion on the map.

    SIM_STATE (ArduPilot) and HIL_STATE_QUATERNION (PX4) are truth; LOCAL_POSITION_NED with ATTITUDE, the
    autopilot's own estimate, serves until one of them is heard.  SIMSTATE (older ArduPilot) is true of
    attitude and place but tells neither height nor velocity: those stay LOCAL_POSITION_NED's.
    """

    def __init__(self, placement: Placement) -> None:
        self._placement = placement
        self._origin: tuple[float, float, float] | None = None
        self._start: _Motion | None = None
        self._has_truth = False
        self._attitude: Message | None = None
        self._simstate: Message | None = None
        self._blend: tuple[int, float, float] | None = None

    def take(self, message: Message, now_ns: int) -> Kinematics | None:
        """The motion that a message tells, stamped with its arrival; None when it tells none."""
        motion = self._motion(message, now_ns)
        if motion is None or not all(map(math.isfinite, (motion.north_m, motion.up_m, motion.heading_rad))):
            return None
        if self._start is None:
            self._start = motion
        return self._on_map(motion, self._start, now_ns)

    def _motion(self, message: Message, now_ns: int) -> _Motion | None:
        match message.get_type():
            case "SIM_STATE":
                if not self._has_truth:
                    self._start_anew()
                north, east, up = self._place(message.lat_int, message.lon_int, message.alt)
                north, east = self._smooth(now_ns, north, east, message.vn, message.ve)
                attitude = (message.roll, message.pitch, message.yaw)
                rates = (message.xgyro, message.ygyro, message.zgyro)
                return _Motion(north, east, up, message.vn, message.ve, -message.vd, *attitude, rates)
            case "HIL_STATE_QUATERNION":
                if not self._has_truth:
                    self._start_anew()
                vn, ve, vd = message.vx / 100.0, message.vy / 100.0, message.vz / 100.0
                north, east, up = self._place(message.lat, message.lon, message.alt / 1000.0)
                north, east = self._smooth(now_ns, north, east, vn, ve)
                attitude = euler(*message.attitude_quaternion)
                rates = (message.rollspeed, message.pitchspeed, message.yawspeed)
                return _Motion(north, east, up, vn, ve, -vd, *attitude, rates)
            case "SIMSTATE":
                if self._simstate is None and not self._has_truth:
                    self._start = None  # as estimated, it was another place
                self._simstate = message
            case "ATTITUDE":
                self._attitude = message
            case "LOCAL_POSITION_NED" if not self._has_truth and self._simstate is not None:
                s = self._simstate
                north, east, _ = self._place(s.lat, s.lng, 0.0)
                north, east = self._smooth(now_ns, north, east, message.vx, message.vy)
                motion = (north, east, -message.z, message.vx, message.vy, -message.vz)
                return _Motion(*motion, s.roll, s.pitch, s.yaw, (s.xgyro, s.ygyro, s.zgyro))
            case "LOCAL_POSITION_NED" if not self._has_truth and self._attitude is not None:
                a = self._attitude
                rates = (a.rollspeed, a.pitchspeed, a.yawspeed)
                place = (message.x, message.y, -message.z, message.vx, message.vy, -message.vz)
                return _Motion(*place, a.roll, a.pitch, a.yaw, rates)
            case _:
                pass
        return None

    def _start_anew(self) -> None:
        """Truth is heard for the first time: what was estimated before is forgotten."""
        self._has_truth = True
        self._start = None

    def _place(self, lat_e7: int, lon_e7: int, alt_m: float) -> tuple[float, float, float]:
        lat, lon = lat_e7 * 1e-7, lon_e7 * 1e-7
        if self._origin is None:
            self._origin = (lat, lon, alt_m)
        lat0, lon0, alt0 = self._origin
        east_scale = _METRES_PER_DEGREE * math.cos(math.radians(lat0))
        return (lat - lat0) * _METRES_PER_DEGREE, (lon - lon0) * east_scale, alt_m - alt0

    def _smooth(self, now_ns: int, north: float, east: float, vn: float, ve: float) -> tuple[float, float]:
        if self._blend is not None:
            then_ns, north_then, east_then = self._blend
            dt_s = (now_ns - then_ns) * 1e-9
            carried_north, carried_east = north_then + vn * dt_s, east_then + ve * dt_s
            if math.hypot(north - carried_north, east - carried_east) < 1.0:  # else it was moved by hand
                north = carried_north + _GPS_BLEND * (north - carried_north)
                east = carried_east + _GPS_BLEND * (east - carried_east)
        self._blend = (now_ns, north, east)
        return north, east

    def _on_map(self, motion: _Motion, start: _Motion, now_ns: int) -> Kinematics:
        placement = self._placement
        turn = placement.yaw_rad - start.heading_rad
        cos, sin = math.cos(turn), math.sin(turn)
        north, east = motion.north_m - start.north_m, motion.east_m - start.east_m
        return Kinematics(
            now_ns,
            placement.x_m + north * cos - east * sin,
            placement.y_m + north * sin + east * cos,
            placement.rest_height_m + motion.up_m - start.up_m,
            motion.north_mps * cos - motion.east_mps * sin,
            motion.north_mps * sin + motion.east_mps * cos,
            motion.up_mps,
            motion.roll_rad,
            motion.pitch_rad,
            wrap_pi(motion.heading_rad + turn),
            *motion.rates_radps,
        )
