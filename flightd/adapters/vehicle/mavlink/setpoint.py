"""Our setpoint as SET_ATTITUDE_TARGET: quaternion, integrated heading, climb rate as thrust."""

from __future__ import annotations

import math

from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.adapters.vehicle.mavlink.link.codec import Message
from flightd.core.geometry import wrap_pi
from flightd.core.types import AttitudeSetpoint

ALL_RATES_MASK = 0
"""Attitude and all three rates: the one mask with a yaw rate that ArduCopter >= 4.2 and PX4 both obey."""

_LEAD_MAX_RAD = math.radians(20.0)
_GAP_MAX_S = 0.1


def quaternion(roll_rad: float, pitch_rad: float, yaw_rad: float) -> list[float]:
    """Unit quaternion (w, x, y, z) that takes NED earth axes to FRD body axes, normalised in double."""
    cr, sr = math.cos(roll_rad / 2), math.sin(roll_rad / 2)
    cp, sp = math.cos(pitch_rad / 2), math.sin(pitch_rad / 2)
    cy, sy = math.cos(yaw_rad / 2), math.sin(yaw_rad / 2)
    q = [
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    ]
    norm = math.hypot(*q)
    return [part / norm for part in q]


class HeadingIntegrator:
    """The heading in our setpoints, which always carry one: the integral of the commanded yaw rate.

    It starts at the vehicle's measured yaw and never leads it by more than 20 degrees, so a vehicle that
    is held or pushed round does not whip back.
    """

    def __init__(self) -> None:
        self._heading_rad: float | None = None
        self._stamp_ns = 0

    def release(self) -> None:
        """Start at the measured yaw next time."""
        self._heading_rad = None

    def step(self, now_ns: int, yaw_rate_radps: float, measured_rad: float) -> float:
        """The heading for a setpoint sent now; a gap in the stream counts as at most 0.1 s."""
        if self._heading_rad is None:
            self._heading_rad = measured_rad
        else:
            dt_s = min(max(now_ns - self._stamp_ns, 0) * 1e-9, _GAP_MAX_S)
            lead = wrap_pi(self._heading_rad + yaw_rate_radps * dt_s - measured_rad)
            lead = min(max(lead, -_LEAD_MAX_RAD), _LEAD_MAX_RAD)
            self._heading_rad = wrap_pi(measured_rad + lead)
        self._stamp_ns = now_ns
        return self._heading_rad


def climb_thrust(climb_mps: float, up_mps: float, down_mps: float) -> float:
    """ArduCopter's thrust for a climb rate: 0.5 holds, 1 climbs at `up_mps`, 0 sinks at `down_mps`."""
    part = climb_mps / (up_mps if climb_mps > 0.0 else down_mps)
    return 0.5 + 0.5 * min(max(part, -1.0), 1.0)


def attitude_target(
    now_ns: int, system_id: int, setpoint: AttitudeSetpoint, heading_rad: float, thrust: float
) -> Message:
    """SET_ATTITUDE_TARGET with mask 0: roll and pitch rate 0, the yaw rate fed forward."""
    return dialect.MAVLink_set_attitude_target_message(
        now_ns // 1_000_000 % 2**32,
        system_id,
        dialect.MAV_COMP_ID_AUTOPILOT1,
        ALL_RATES_MASK,
        quaternion(setpoint.roll_rad, setpoint.pitch_rad, heading_rad),
        0.0,
        0.0,
        setpoint.yaw_rate_radps,
        thrust,
    )
