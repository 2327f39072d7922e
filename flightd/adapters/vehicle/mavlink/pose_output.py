"""What the autopilot's own estimator is told of our motion, and the charge pad for its precision landing.

The local frame sent is the autopilot's own: z down, turned as it believes to be turned itself (its compass or
gyro), and begun where the first pose was sent.  So it can take speed and way of us, which show it what is
level, and nothing of its heading: a doubted heading of ours cannot turn it, and its heading does not leap
when poses begin, end or are corrected.  Its yaw must therefore not come from us (EK3_SRC1_YAW, EKF2_EV_CTRL
bit 3).
"""

from __future__ import annotations

import math
from enum import StrEnum

from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.adapters.vehicle.mavlink.link.codec import Message
from flightd.adapters.vehicle.mavlink.link.connection import Firmware
from flightd.adapters.vehicle.mavlink.setpoint import quaternion
from flightd.core.geometry import wrap_pi
from flightd.core.shared_pose import SharedPose
from flightd.core.types import Attitude

_VISION = dialect.MAV_ESTIMATOR_TYPE_VISION
_SHARED_READINGS = 10.0
"""What a frame's motion errs by (the told attitude, the mount, a gust) lasts for about so many of them, and
an estimator counts each as new evidence: so much larger are the variances that it is told."""
_LEAST_SPEED_VARIANCE_M2PS2 = 0.03**2
_UNKNOWN_SPEED_VARIANCE_M2PS2 = 5.0**2
"""Also of the climb: what we know of it the autopilot has told."""
_LEAST_HEIGHT_VARIANCE_M2 = 0.02**2
_TILT_VARIANCE_RAD2 = math.radians(5.0) ** 2
_YAW_VARIANCE_RAD2 = math.radians(30.0) ** 2
"""Roll, pitch and yaw that are sent are the autopilot's own: no evidence."""
_STANDING_PLACE_VARIANCE_M2 = 0.02**2
_STANDING_AGE_NS = 200_000_000
"""Older than any frame when it is told: ArduPilot reckons by the youngest message of late."""
_GAP_NS = 500_000_000


class PoseForm(StrEnum):
    """The message in which the pose goes out; ODOMETRY is what both firmwares prefer."""

    ODOMETRY = "odometry"
    VISION_POSITION = "vision_position"


class PoseOutput:
    """Poses at no more than `rate_hz`, with the count of what the estimator is to forgive: each gap in them,
    and each correction of the place on the map."""

    def __init__(
        self, form: PoseForm, firmware: Firmware, rate_hz: float = 30.0, jump_m: float = 0.3
    ) -> None:
        self._form, self._firmware = form, firmware
        self._period_ns = round(1e9 / rate_hz)
        self._jump_m = jump_m
        self._last: SharedPose | None = None
        self._sent_ns: int | None = None
        self._jumped = False
        """What is sent next does not go on from what was sent before."""
        self._due_ns = 0
        self.resets = 0
        self.place_m = 0.0, 0.0
        """In the frame that is sent."""

    def make(self, now_ns: int, pose: SharedPose, climb_mps: float) -> Message | None:
        """The message for a pose in flight, None while none is due; `climb_mps` is what the autopilot told
        itself.  ArduPilot weighs all speeds alike, so it is told nothing where one of them is unknown."""
        self._follow(pose)
        if self._firmware is Firmware.ARDUPILOT and not pose.tells_both:
            return None
        return self._message(now_ns, pose, 0.0 if math.isnan(climb_mps) else climb_mps)

    def make_standing(self, now_ns: int, attitude: Attitude, height_m: float) -> Message | None:
        """The message for a vehicle that stands on the floor, None while none is due: it does not move."""
        self._jumped |= self._last is not None
        self._last, self._sent_ns = None, now_ns
        age_ns = _STANDING_AGE_NS if self._firmware is Firmware.ARDUPILOT else 0
        pose = SharedPose(
            stamp_ns=attitude.stamp_ns - age_ns,
            attitude=attitude,
            yaw_rad=attitude.yaw_rad,
            x_m=0.0,
            y_m=0.0,
            vx_mps=0.0,
            vy_mps=0.0,
            height_m=0.0 if math.isnan(height_m) else height_m,
            position_variances=(_STANDING_PLACE_VARIANCE_M2, _STANDING_PLACE_VARIANCE_M2),
            speed_variances=(0.0, 0.0),
            height_variance=0.0,
            integrity=1.0,
        )
        return self._message(now_ns, pose, 0.0)

    def at_place(self, pose: SharedPose, place_m: tuple[float, float]) -> tuple[float, float]:
        """A place on the map in the frame that is sent, by the newest pose."""
        x_m, y_m = turned(place_m[0] - pose.x_m, place_m[1] - pose.y_m, _turn(pose))
        return self.place_m[0] + x_m, self.place_m[1] + y_m

    def _message(self, now_ns: int, pose: SharedPose, climb_mps: float) -> Message | None:
        if now_ns < self._due_ns:
            return None
        self._due_ns = max(self._due_ns + self._period_ns, now_ns + self._period_ns // 2)
        gap = self._sent_ns is not None and now_ns - self._sent_ns > _GAP_NS
        if gap or self._jumped:
            self.resets = (self.resets + 1) % 256
        self._sent_ns, self._jumped = now_ns, False
        if self._form is PoseForm.ODOMETRY:
            return odometry(pose, self.place_m, climb_mps, self.resets)
        return vision_position(pose, self.place_m, self.resets)

    def _follow(self, pose: SharedPose) -> None:
        """Go on by the way since the last pose.  A correction of the place on the map is no way that was
        flown."""
        last, self._last = self._last, pose
        if last is None:
            return
        dt_s = (pose.stamp_ns - last.stamp_ns) * 1e-9
        flown = 0.5 * (pose.vx_mps + last.vx_mps) * dt_s, 0.5 * (pose.vy_mps + last.vy_mps) * dt_s
        way = pose.x_m - last.x_m, pose.y_m - last.y_m
        jumped = math.dist(way, flown) > self._jump_m or pose.corrections != last.corrections
        self._jumped |= jumped
        x_m, y_m = turned(*(flown if jumped else way), _turn(pose))
        self.place_m = self.place_m[0] + x_m, self.place_m[1] + y_m


def turned(x: float, y: float, angle_rad: float) -> tuple[float, float]:
    """A vector of the level plane, turned clockwise as seen from above."""
    cos, sin = math.cos(angle_rad), math.sin(angle_rad)
    return cos * x - sin * y, sin * x + cos * y


def _turn(pose: SharedPose) -> float:
    """From the map's axes to those that the autopilot believes in."""
    return wrap_pi(pose.attitude.yaw_rad - pose.yaw_rad)


def _orientation(pose: SharedPose) -> list[float]:
    told = pose.attitude
    return quaternion(told.roll_rad, told.pitch_rad, told.yaw_rad)


def odometry(pose: SharedPose, place_m: tuple[float, float], climb_mps: float, resets: int) -> Message:
    """ODOMETRY in LOCAL_FRD with velocities in BODY_FRD: the one pair of frames that ArduPilot takes, and
    PX4 takes it too."""
    q = _orientation(pose)
    vx, vy = turned(pose.vx_mps, pose.vy_mps, _turn(pose))
    forward, right, down = _to_body(q, vx, vy, -climb_mps)
    return dialect.MAVLink_odometry_message(
        pose.stamp_ns // 1000,
        dialect.MAV_FRAME_LOCAL_FRD,
        dialect.MAV_FRAME_BODY_FRD,
        *place_m,
        -pose.height_m,
        q,
        forward,
        right,
        down,
        math.nan,
        math.nan,
        math.nan,
        _pose_covariance(pose),
        _speed_covariance(pose),
        resets,
        _VISION,
        max(1, round(100 * min(max(pose.integrity, 0.0), 1.0))),
    )


def vision_position(pose: SharedPose, place_m: tuple[float, float], resets: int) -> Message:
    """VISION_POSITION_ESTIMATE, for firmware too old for ODOMETRY."""
    told = pose.attitude
    return dialect.MAVLink_vision_position_estimate_message(
        pose.stamp_ns // 1000,
        *place_m,
        -pose.height_m,
        told.roll_rad,
        told.pitch_rad,
        told.yaw_rad,
        _pose_covariance(pose),
        resets,
    )


def landing_target(
    firmware: Firmware, pose: SharedPose, pad_m: tuple[float, float], local_m: tuple[float, float]
) -> Message:
    """LANDING_TARGET for a pad at map position `pad_m`, in the frame that the firmware wants; `local_m` is
    its place in the frame of the poses that are sent.

    ArduPilot: the vector in BODY_FRD, which it turns by roll and pitch too, its length above zero.  PX4:
    the pad's place in the local frame, which is that of our poses when it fuses them.
    """
    if firmware is Firmware.PX4:
        frame, place, distance_m = dialect.MAV_FRAME_LOCAL_NED, (*local_m, 0.0), 0.0
    else:
        told = pose.attitude
        q = quaternion(told.roll_rad, told.pitch_rad, pose.yaw_rad)
        frame = dialect.MAV_FRAME_BODY_FRD
        place = _to_body(q, pad_m[0] - pose.x_m, pad_m[1] - pose.y_m, max(pose.height_m, 0.01))
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


def _pose_covariance(pose: SharedPose) -> list[float]:
    """Upper triangle over x, y, z, roll, pitch, yaw: of the place in the frame that is sent."""
    xx, xy, yy = _turned_variances(pose.position_variances, _turn(pose))
    height = max(pose.height_variance, _LEAST_HEIGHT_VARIANCE_M2)
    triangle = _upper_triangle([xx, yy, height, _TILT_VARIANCE_RAD2, _TILT_VARIANCE_RAD2, _YAW_VARIANCE_RAD2])
    triangle[1] = xy
    return triangle


def _speed_covariance(pose: SharedPose) -> list[float]:
    """Upper triangle over the speeds in body axes and the turn rates, which are not told."""
    x, y = (
        _UNKNOWN_SPEED_VARIANCE_M2PS2
        if math.isnan(variance)
        else max(variance, _LEAST_SPEED_VARIANCE_M2PS2) * _SHARED_READINGS
        for variance in pose.speed_variances
    )
    forward, cross, right = _turned_variances((x, y), -pose.yaw_rad)
    triangle = _upper_triangle([forward, right, _UNKNOWN_SPEED_VARIANCE_M2PS2] + [math.radians(5.0) ** 2] * 3)
    triangle[1] = cross
    return triangle


def _turned_variances(variances: tuple[float, float], angle_rad: float) -> tuple[float, float, float]:
    """(xx, xy, yy) of a vector with these variances along its axes, once it is turned."""
    x, y = variances
    cos, sin = math.cos(angle_rad), math.sin(angle_rad)
    return cos * cos * x + sin * sin * y, cos * sin * (x - y), sin * sin * x + cos * cos * y


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
