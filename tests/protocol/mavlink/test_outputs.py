"""What the autopilot's estimator is told and the pad for its landing: frames, signs, covariance, rate."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flightd.adapters.vehicle.mavlink.link.codec import Codec, FrameParser
from flightd.adapters.vehicle.mavlink.link.connection import Firmware
from flightd.adapters.vehicle.mavlink.pose_output import (
    PoseForm,
    PoseOutput,
    landing_target,
    odometry,
)
from flightd.core.geometry import heading_rotation, level_from_body
from flightd.core.shared_pose import SharedPose
from flightd.core.types import Attitude

FRAME_NS = 33_000_000
POSE = SharedPose(
    stamp_ns=7_000_000_000,
    attitude=Attitude(7_000_000_000, 0.0, 0.0, 2.2),
    yaw_rad=0.5,
    x_m=12.0,
    y_m=3.0,
    vx_mps=0.4,
    vy_mps=-0.2,
    height_m=1.5,
    position_variances=(0.01, 0.02),
    speed_variances=(0.001, 0.002),
    height_variance=0.0001,
    integrity=0.93,
)
angle = st.floats(-1.0, 1.0)
heading = st.floats(-3.1, 3.1)


def output(firmware: Firmware = Firmware.PX4, form: PoseForm = PoseForm.ODOMETRY) -> PoseOutput:
    return PoseOutput(form, firmware)


def at(pose: SharedPose, step: int, x_m: float, y_m: float) -> SharedPose:
    return replace(pose, stamp_ns=pose.stamp_ns + step * FRAME_NS, x_m=x_m, y_m=y_m)


def test_odometry_has_the_frames_that_arducopter_takes_the_exposures_time_and_its_own_heading() -> None:
    message = odometry(POSE, (4.0, 5.0), 0.0, 3)
    assert (message.frame_id, message.child_frame_id) == (20, 12)
    assert (message.x, message.y, message.z) == (4.0, 5.0, -1.5)
    assert message.time_usec == 7_000_000
    assert message.reset_counter == 3
    assert message.quality == 93
    yaw = 2 * math.atan2(message.q[3], message.q[0])
    assert yaw == pytest.approx(2.2)  # the compass's, not the map's


@given(angle, angle, heading, heading, angle)
def test_velocities_are_in_body_axes_whatever_the_heading_is_taken_for(
    roll: float, pitch: float, yaw: float, told_yaw: float, climb: float
) -> None:
    pose = replace(POSE, yaw_rad=yaw, attitude=Attitude(0, roll, pitch, told_yaw))
    message = odometry(pose, (0.0, 0.0), climb, 0)
    local_from_body = heading_rotation(yaw) @ level_from_body(roll, pitch)
    expected = local_from_body.T @ [POSE.vx_mps, POSE.vy_mps, -climb]
    assert (message.vx, message.vy, message.vz) == pytest.approx(tuple(expected), abs=1e-9)


def test_what_no_line_told_and_what_the_autopilot_told_itself_are_no_evidence() -> None:
    sure = odometry(replace(POSE, yaw_rad=0.0), (0.0, 0.0), 0.3, 0).velocity_covariance
    lone = replace(POSE, yaw_rad=0.0, speed_variances=(0.001, math.nan))
    unsure = odometry(lone, (0.0, 0.0), 0.3, 0).velocity_covariance
    turned = odometry(replace(lone, yaw_rad=math.pi / 2), (0.0, 0.0), 0.3, 0).velocity_covariance
    assert unsure[0] == pytest.approx(sure[0]) == pytest.approx(turned[6])
    assert unsure[6] > 100 * sure[6]
    assert turned[0] > 100 * sure[0]  # nose along y: it is the speed ahead that is not known
    assert sure[11] > 100 * sure[0]


def test_a_speed_is_told_as_less_sure_than_one_frame_makes_it() -> None:
    """The frames of a third of a second err alike, an estimator takes each as new evidence."""
    variance = odometry(replace(POSE, yaw_rad=0.0), (0.0, 0.0), 0.0, 0).velocity_covariance[6]
    assert 5 * POSE.speed_variances[1] < variance < 20 * POSE.speed_variances[1]


@pytest.mark.parametrize("form", list(PoseForm))
def test_the_covariance_is_the_upper_triangle_turned_as_the_frame_is(form: PoseForm) -> None:
    pose = replace(POSE, yaw_rad=0.0, attitude=Attitude(0, 0.0, 0.0, math.pi / 2))
    message = output(form=form).make(0, pose, 0.0)
    assert message is not None
    triangle = message.pose_covariance if form is PoseForm.ODOMETRY else message.covariance
    assert len(triangle) == 21
    assert (triangle[0], triangle[6]) == pytest.approx((0.02, 0.01))
    assert all(triangle[i] > 0 for i in (11, 15, 18, 20))
    (heard,) = FrameParser(Codec(1)).datagram(Codec(1).pack(message))
    assert heard.get_type() == message.get_type()


def test_poses_go_out_at_thirty_hertz() -> None:
    out = output()
    sent = [now for now in range(0, 2_000_000_000, 20_000_000) if out.make(now, POSE, 0.0) is not None]
    assert len(sent) == pytest.approx(60, abs=2)


def test_arducopter_weighs_all_speeds_alike_and_hears_none_where_one_is_not_known() -> None:
    lone = replace(POSE, speed_variances=(0.001, math.nan))
    assert output(Firmware.PX4).make(0, lone, 0.0) is not None
    assert output(Firmware.ARDUPILOT).make(0, lone, 0.0) is None
    assert output(Firmware.ARDUPILOT).make(0, POSE, 0.0) is not None


def test_the_way_is_sent_in_the_autopilots_own_heading() -> None:
    out, pose = output(), replace(POSE, yaw_rad=0.0, attitude=Attitude(0, 0.0, 0.0, math.pi / 2), vx_mps=2.0)
    for step in range(50):
        out.make(step * FRAME_NS, at(pose, step, 12.0 + step * 0.066, 3.0), 0.0)
    assert out.place_m == pytest.approx((0.0, 49 * 0.066), abs=1e-9)  # its y is the map's x
    assert out.resets == 0


def test_a_correction_on_the_map_is_no_way_flown_but_is_counted() -> None:
    out, pose = output(), replace(POSE, vx_mps=0.0, vy_mps=0.0)
    out.make(0, pose, 0.0)
    out.make(2 * FRAME_NS, at(pose, 1, 14.0, 3.0), 0.0)  # the jump by itself
    message = out.make(4 * FRAME_NS, replace(at(pose, 2, 14.0, 3.1), corrections=1), 0.0)
    assert message is not None
    assert message.reset_counter == out.resets == 2
    assert (message.x, message.y) == (0.0, 0.0)


def test_a_gap_in_what_goes_out_is_counted_though_poses_came() -> None:
    """ArduPilot hears nothing of a frame that tells one axis alone."""
    out = output(Firmware.ARDUPILOT)
    out.make(0, POSE, 0.0)
    for frame in range(1, 40):
        half = replace(at(POSE, frame, 12.0, 3.0), speed_variances=(0.01, math.nan))
        assert out.make(frame * FRAME_NS, half, 0.0) is None
    message = out.make(41 * FRAME_NS, at(POSE, 41, 12.0, 3.0), 0.0)
    assert message is not None
    assert message.reset_counter == 1


def test_a_gap_is_counted_and_so_is_the_end_of_a_flight() -> None:
    out = output()
    out.make(0, POSE, 0.0)
    out.make(FRAME_NS, at(POSE, 1, 12.0, 3.0), 0.0)
    assert out.resets == 0
    out.make(60 * FRAME_NS, at(POSE, 60, 12.3, 3.0), 0.0)
    assert out.resets == 1
    standing = out.make_standing(99 * FRAME_NS, Attitude(POSE.stamp_ns + 99 * FRAME_NS, 0.0, 0.0, 2.0), 0.1)
    assert standing is not None
    assert standing.reset_counter == 2
    assert (standing.vx, standing.vy, standing.vz) == pytest.approx((0.0, 0.0, 0.0))
    assert out.make_standing(120 * FRAME_NS, Attitude(0, 0.0, 0.0, 2.0), math.nan) is not None
    assert out.resets == 2


def test_the_pad_is_told_in_the_frame_that_each_firmware_wants() -> None:
    pose = replace(POSE, x_m=10.0, y_m=2.0, yaw_rad=math.pi / 2, height_m=2.0)
    ours = landing_target(Firmware.ARDUPILOT, pose, (11.0, 2.0), (0.0, 0.0))
    assert ours.frame == 12
    assert (ours.x, ours.y, ours.z) == pytest.approx((0.0, -1.0, 2.0), abs=1e-9)  # to the left
    assert ours.distance == pytest.approx(math.sqrt(5.0))
    theirs = landing_target(Firmware.PX4, pose, (11.0, 2.0), (4.0, 5.0))
    assert theirs.frame == 1
    assert (theirs.x, theirs.y, theirs.z) == (4.0, 5.0, 0.0)
    assert ours.position_valid == theirs.position_valid == 1
    on_the_pad = landing_target(Firmware.ARDUPILOT, replace(pose, height_m=0.0), (10.0, 2.0), (0.0, 0.0))
    assert on_the_pad.distance > 0.0  # ArduPilot divides by it


@given(heading, heading)
def test_the_pad_has_its_place_in_the_frame_that_is_sent(yaw: float, told_yaw: float) -> None:
    out = output()
    pose = replace(POSE, yaw_rad=yaw, attitude=Attitude(0, 0.0, 0.0, told_yaw))
    out.make(0, pose, 0.0)
    x_m, y_m = out.at_place(pose, (12.3, 2.6))
    turn = told_yaw - yaw
    expected = 0.3 * math.cos(turn) + 0.4 * math.sin(turn), 0.3 * math.sin(turn) - 0.4 * math.cos(turn)
    assert (x_m, y_m) == pytest.approx(expected, abs=1e-9)


@given(angle, angle)
def test_the_pad_stays_where_it_is_however_the_vehicle_tilts(roll: float, pitch: float) -> None:
    """ArduPilot turns a vector in BODY_FRD by the whole attitude."""
    pose = replace(POSE, attitude=Attitude(0, roll, pitch, 0.0))
    message = landing_target(Firmware.ARDUPILOT, pose, (12.3, 2.6), (0.0, 0.0))
    local_from_body = heading_rotation(POSE.yaw_rad) @ level_from_body(roll, pitch)
    assert tuple(local_from_body @ [message.x, message.y, message.z]) == pytest.approx((0.3, -0.4, 1.5))
