"""The pose for the autopilot's estimator and the pad for its landing: frames, signs, covariance, rate."""

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
from flightd.core.types import Attitude, GridPose

COVARIANCE = (0.01, 0.002, 0.0003, 0.002, 0.02, 0.0004, 0.0003, 0.0004, 0.003)
POSE = GridPose(7_000_000_000, "A1", 0.1, 0.0, 0.5, 12.0, 3.0, 0.4, -0.2, 1.5, COVARIANCE, 0.93)
LEVEL = Attitude(7_000_000_000, 0.0, 0.0, 2.2)
angle = st.floats(-1.0, 1.0)


def test_odometry_has_the_frames_that_arducopter_takes_and_the_maps_axes() -> None:
    message = odometry(POSE, LEVEL, 1.5, 0.0, 3)
    assert (message.frame_id, message.child_frame_id) == (20, 12)
    assert (message.x, message.y, message.z) == (12.0, 3.0, -1.5)
    assert message.time_usec == 7_000_000
    assert message.reset_counter == 3
    assert message.quality == 93
    yaw = 2 * math.atan2(message.q[3], message.q[0])
    assert yaw == pytest.approx(0.5)  # the grid's heading, not the compass's


@given(angle, angle, st.floats(-3.1, 3.1), angle)
def test_velocities_are_in_body_axes(roll: float, pitch: float, yaw: float, climb: float) -> None:
    message = odometry(replace(POSE, yaw_rad=yaw), Attitude(0, roll, pitch, 0.0), 1.5, climb, 0)
    local_from_body = heading_rotation(yaw) @ level_from_body(roll, pitch)
    expected = local_from_body.T @ [POSE.vx_mps, POSE.vy_mps, -climb]
    assert (message.vx, message.vy, message.vz) == pytest.approx(tuple(expected), abs=1e-9)


def test_an_unknown_climb_rate_is_not_passed_off_as_none() -> None:
    sure, unsure = odometry(POSE, LEVEL, 1.5, 0.0, 0), odometry(POSE, LEVEL, 1.5, math.nan, 0)
    assert unsure.vz == pytest.approx(0.0, abs=1e-9)
    assert unsure.velocity_covariance[11] > 100 * sure.velocity_covariance[11]
    assert unsure.velocity_covariance[:11] == sure.velocity_covariance[:11]


@pytest.mark.parametrize("form", list(PoseForm))
def test_the_covariance_is_the_upper_triangle_with_yaw_last(form: PoseForm) -> None:
    message = PoseOutput(form).make(0, POSE, LEVEL, 1.5, 0.0)
    assert message is not None
    triangle = message.pose_covariance if form is PoseForm.ODOMETRY else message.covariance
    assert len(triangle) == 21
    assert (triangle[0], triangle[6], triangle[20]) == (0.01, 0.02, 0.003)
    assert (triangle[1], triangle[5], triangle[10]) == (0.002, 0.0003, 0.0004)
    assert all(triangle[i] > 0 for i in (11, 15, 18))
    (heard,) = FrameParser(Codec(1)).datagram(Codec(1).pack(message))
    assert heard.get_type() == message.get_type()


def test_poses_go_out_at_thirty_hertz_and_not_without_a_height() -> None:
    output = PoseOutput(PoseForm.ODOMETRY)
    sent = [
        now
        for now in range(0, 2_000_000_000, 20_000_000)
        if output.make(now, POSE, LEVEL, 1.5, 0.0) is not None
    ]
    assert len(sent) == pytest.approx(60, abs=2)
    assert output.make(9_000_000_000, POSE, LEVEL, math.nan, 0.0) is None


def test_a_jump_of_the_fix_is_counted_and_flight_is_not() -> None:
    output = PoseOutput(PoseForm.VISION_POSITION)
    for i in range(50):  # two metres a second
        moved = replace(POSE, stamp_ns=i * 20_000_000, x_m=0.04 * i, vx_mps=2.0, y_m=0.0, vy_mps=0.0)
        output.make(i * 20_000_000, moved, LEVEL, 1.5, 0.0)
    message = output.make(2_000_000_000, moved, LEVEL, 1.5, 0.0)
    assert message is not None
    assert message.reset_counter == 0
    message = output.make(3_000_000_000, replace(moved, x_m=moved.x_m + 2.0), LEVEL, 1.5, 0.0)
    assert message is not None
    assert message.reset_counter == 1


def test_the_pad_is_told_in_the_frame_that_each_firmware_wants() -> None:
    pose = replace(POSE, x_m=10.0, y_m=2.0, yaw_rad=math.pi / 2)
    ours = landing_target(Firmware.ARDUPILOT, pose, LEVEL, (11.0, 2.0), 2.0)
    assert ours.frame == 12
    assert (ours.x, ours.y, ours.z) == pytest.approx((0.0, -1.0, 2.0), abs=1e-9)  # to the left
    assert ours.distance == pytest.approx(math.sqrt(5.0))
    theirs = landing_target(Firmware.PX4, pose, LEVEL, (11.0, 2.0), 2.0)
    assert theirs.frame == 1
    assert (theirs.x, theirs.y, theirs.z) == (11.0, 2.0, 0.0)
    assert ours.position_valid == theirs.position_valid == 1
    on_the_pad = landing_target(Firmware.ARDUPILOT, pose, LEVEL, (10.0, 2.0), 0.0)
    assert on_the_pad.distance > 0.0  # ArduPilot divides by it


@given(angle, angle)
def test_the_pad_stays_where_it_is_however_the_vehicle_tilts(roll: float, pitch: float) -> None:
    """ArduPilot turns a vector in BODY_FRD by the whole attitude."""
    message = landing_target(Firmware.ARDUPILOT, POSE, Attitude(0, roll, pitch, 0.0), (12.3, 2.6), 1.5)
    local_from_body = heading_rotation(POSE.yaw_rad) @ level_from_body(roll, pitch)
    assert tuple(local_from_body @ [message.x, message.y, message.z]) == pytest.approx((0.3, -0.4, 1.5))
