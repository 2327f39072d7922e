"""The grid pose for the autopilot's own estimator, and the charge pad for its precision landing.

The local frame sent is the map's: x along the aisles, y to the right of x, z down, its yaw arbitrary.  An
autopilot that fuses it must take its yaw from it too (ArduPilot EK3_SRC1_YAW = 6) or have the map's x
axis point north.
"""

from __future__ import annotations

import math
from enum import StrEnum

from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.adapters.vehicle.mavlink.link.codec import Message
from flightd.adapters.vehicle.mavlink.link.connection import Firmware
from flightd.adapters.vehicle.mavlink.setpoint import quaternion
from flightd.core.types import Attitude, GridPose

_VISION = dialect.MAV_ESTIMATOR_TYPE_VISION
_HEIGHT_VARIANCE_M2 = 0.02**2
_TILT_VARIANCE_RAD2 = math.radians(0.5) ** 2
_SPEED_VARIANCE_M2PS2 = 0.05**2
_UNKNOWN_CLIMB_VARIANCE_M2PS2 = 1.0


class PoseForm(StrEnum):
    """The message in which the pose goes out; ODOMETRY is what both firmwares prefer."""

    ODOMETRY = "odometry"
    VISION_POSITION = "vision_position"


class PoseOutput:
    """Poses at no more than `rate_hz`, with the count of jumps that the estimator is to forgive."""

    def __init__(self, form: PoseForm, rate_hz: float = 30.0, jump_m: float = 0.3) -> None:
        self._form = form
        self._period_ns = round(1e9 / rate_hz)
        self._jump_m = jump_m
        self._last: GridPose | None = None
        self._due_ns = 0
        self._resets = 0

    def make(
        self, now_ns: int, pose: GridPose, attitude: Attitude, height_m: float, climb_mps: float
    ) -> Message | None:
        """The message for a pose, or None while none is due or the height is unknown (NaN); an unknown
        climb rate (NaN) goes out as none, with a variance that says so."""
        self._watch(pose)
        if now_ns < self._due_ns or math.isnan(height_m):
            return None
        self._due_ns = max(self._due_ns + self._period_ns, now_ns + self._period_ns // 2)
        if self._form is PoseForm.ODOMETRY:
            return odometry(pose, attitude, height_m, climb_mps, self._resets)
        return vision_position(pose, attitude, height_m, self._resets)

    def _watch(self, pose: GridPose) -> None:
        """A fix that moved further than its own velocity explains is a jump."""
        last, self._last = self._last, pose
        if last is None:
            return
        dt_s = (pose.stamp_ns - last.stamp_ns) * 1e-9
        dx, dy = pose.x_m - last.x_m - last.vx_mps * dt_s, pose.y_m - last.y_m - last.vy_mps * dt_s
        if math.hypot(dx, dy) > self._jump_m:
            self._resets = (self._resets + 1) % 256


def odometry(pose: GridPose, attitude: Attitude, height_m: float, climb_mps: float, resets: int) -> Message:
    """ODOMETRY in LOCAL_FRD with velocities in BODY_FRD: the one pair of frames that ArduPilot takes, and
    PX4 takes it too."""
    q = quaternion(attitude.roll_rad, attitude.pitch_rad, pose.yaw_rad)
    climbs = not math.isnan(climb_mps)
    forward, right, down = _to_body(q, pose.vx_mps, pose.vy_mps, -climb_mps if climbs else 0.0)
    down_variance = _SPEED_VARIANCE_M2PS2 if climbs else _UNKNOWN_CLIMB_VARIANCE_M2PS2
    return dialect.MAVLink_odometry_message(
        pose.stamp_ns // 1000,
        dialect.MAV_FRAME_LOCAL_FRD,
        dialect.MAV_FRAME_BODY_FRD,
        pose.x_m,
        pose.y_m,
        -height_m,
        q,
        forward,
        right,
        down,
        math.nan,
        math.nan,
        math.nan,
        _pose_covariance(pose),
        _upper_triangle([_SPEED_VARIANCE_M2PS2] * 2 + [down_variance] + [math.radians(5.0) ** 2] * 3),
        resets,
        _VISION,
        max(1, round(100 * min(max(pose.integrity, 0.0), 1.0))),
    )


def vision_position(pose: GridPose, attitude: Attitude, height_m: float, resets: int) -> Message:
    """VISION_POSITION_ESTIMATE, for firmware too old for ODOMETRY."""
    return dialect.MAVLink_vision_position_estimate_message(
        pose.stamp_ns // 1000,
        pose.x_m,
        pose.y_m,
        -height_m,
        attitude.roll_rad,
        attitude.pitch_rad,
        pose.yaw_rad,
        _pose_covariance(pose),
        resets,
    )


def landing_target(
    firmware: Firmware, pose: GridPose, attitude: Attitude, pad_m: tuple[float, float], height_m: float
) -> Message:
    """LANDING_TARGET for a pad at map position `pad_m`, in the frame that the firmware wants.

    ArduPilot: the vector in BODY_FRD, which it turns by roll and pitch too, its length above zero.  PX4:
    the pad's place in the local frame, which is the map's when it fuses our poses.
    """
    if firmware is Firmware.PX4:
        frame, place, distance_m = dialect.MAV_FRAME_LOCAL_NED, (*pad_m, 0.0), 0.0
    else:
        q = quaternion(attitude.roll_rad, attitude.pitch_rad, pose.yaw_rad)
        frame = dialect.MAV_FRAME_BODY_FRD
        place = _to_body(q, pad_m[0] - pose.x_m, pad_m[1] - pose.y_m, max(height_m, 0.01))
        distance_m = math.hypot(*place)
    return dialect.MAVLink_landing_target_message(
        pose.stamp_ns // 1000,
        0,
        frame,
        0.0,
        0.0,
        distance_m,
        0.0,
        0.0,
        *place,
        [1.0, 0.0, 0.0, 0.0],
        dialect.LANDING_TARGET_TYPE_VISION_FIDUCIAL,
        1,
    )


def _pose_covariance(pose: GridPose) -> list[float]:
    """Upper triangle over x, y, z, roll, pitch, yaw from that over x, y, yaw."""
    xx, xy, xyaw, _, yy, yyaw, _, _, yawyaw = pose.covariance
    triangle = _upper_triangle(
        [xx, yy, _HEIGHT_VARIANCE_M2, _TILT_VARIANCE_RAD2, _TILT_VARIANCE_RAD2, yawyaw]
    )
    triangle[1], triangle[5], triangle[10] = xy, xyaw, yyaw
    return triangle


def _upper_triangle(diagonal: list[float]) -> list[float]:
    """21 numbers, row by row; variances at 0, 6, 11, 15, 18, 20."""
    triangle = [0.0] * 21
    for place, variance in zip((0, 6, 11, 15, 18, 20), diagonal, strict=True):
        triangle[place] = variance
    return triangle


def _to_body(q: list[float], x: float, y: float, z: float) -> tuple[float, float, float]:
    """A vector of the local frame in body axes: rotated by the inverse of q."""
    w, i, j, k = q
    return (
        (1 - 2 * (j * j + k * k)) * x + 2 * (i * j + w * k) * y + 2 * (i * k - w * j) * z,
        2 * (i * j - w * k) * x + (1 - 2 * (i * i + k * k)) * y + 2 * (j * k + w * i) * z,
        2 * (i * k + w * j) * x + 2 * (j * k - w * i) * y + (1 - 2 * (i * i + j * j)) * z,
    )
