"""The front camera's geometry: signs as DESIGN section 4 has them, and projections that invert."""

import math

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flightd.config.front_camera import FrontCameraConfig
from flightd.core.camera_view import CameraView, ForwardMount, Viewpoint
from flightd.core.geometry import Lens, Mount

LENS = FrontCameraConfig().lens()
BENT = Lens(1280, 800, 1000.0, 1000.0, 630.0, 405.0, (-0.12, 0.03, 0.001, -0.0005, -0.002))
CX, CY = LENS.centre_px


def seen(
    point: tuple[float, float, float],
    *,
    at: tuple[float, float, float] = (0.0, 0.0, 1.0),
    roll: float = 0.0,
    pitch: float = 0.0,
    yaw: float = 0.0,
    mount: ForwardMount = ForwardMount(),  # noqa: B008 - frozen
    lens: Lens = LENS,
) -> tuple[float, float]:
    view = CameraView(lens, Viewpoint.at(*at, roll, pitch, yaw, mount))
    ((u, v),) = view.project(np.array([point]))
    return float(u), float(v)


def test_the_camera_looks_along_the_nose() -> None:
    assert seen((2.0, 0.0, 1.0)) == pytest.approx((CX, CY))
    assert seen((0.0, 2.0, 1.0), yaw=math.pi / 2) == pytest.approx((CX, CY))
    assert all(math.isnan(pixel) for pixel in seen((-2.0, 0.0, 1.0)))


def test_right_of_the_nose_is_right_in_the_picture_and_higher_is_up() -> None:
    assert seen((2.0, 0.1, 1.0)) == pytest.approx((CX + 50.0, CY))
    assert seen((2.0, 0.0, 1.1)) == pytest.approx((CX, CY - 50.0))


def test_facing_the_right_shelf_along_the_aisle_is_to_the_left() -> None:
    # nose to +y: the map's +x is on the left hand
    u, _ = seen((0.1, 1.2, 1.0), yaw=math.pi / 2)
    assert u == pytest.approx(CX - 1000.0 * 0.1 / 1.2)


def test_a_side_camera_looks_to_the_right_of_the_nose() -> None:
    assert seen((0.0, 2.0, 1.0), mount=ForwardMount(math.pi / 2)) == pytest.approx((CX, CY))


def test_nose_up_and_a_raised_mount_lower_the_picture() -> None:
    angle = math.radians(5.0)
    by_nose = seen((2.0, 0.0, 1.0), pitch=angle)
    assert by_nose == pytest.approx((CX, CY + 1000.0 * math.tan(angle)))
    assert seen((2.0, 0.0, 1.0), mount=ForwardMount(pitch_rad=angle)) == pytest.approx(by_nose)


def test_roll_to_the_right_turns_the_picture_to_the_left() -> None:
    u, v = seen((2.0, 0.2, 1.0), roll=math.radians(10.0))
    assert u > CX
    assert v < CY  # what is level on the right rises when the right side goes down


def test_the_mount_stands_off_the_body_in_body_axes() -> None:
    mount = ForwardMount(offset_m=(0.1, 0.05, 0.02))
    assert seen((2.1, 0.05, 0.98), mount=mount) == pytest.approx((CX, CY))
    # turned to +y, forward is y and right is -x
    assert seen((-0.05, 2.1, 0.98), yaw=math.pi / 2, mount=mount) == pytest.approx((CX, CY))


def test_a_down_camera_has_the_same_kind_of_viewpoint() -> None:
    view = CameraView(LENS, Viewpoint.at(1.0, 2.0, 1.5, 0.0, 0.0, 0.0, Mount()))
    ((u, v),) = view.project(np.array([(1.15, 2.0, 0.0)]))
    assert (u, v) == pytest.approx((CX, CY - 100.0))  # ahead is up in the picture


def test_distortion_is_opencvs() -> None:
    points = np.array([(2.0, y, h) for y in (-0.9, 0.0, 0.7) for h in (0.5, 1.0, 1.6)])
    view = CameraView(BENT, Viewpoint.at(0.0, 0.0, 1.0, 0.0, 0.0, 0.0, ForwardMount()))
    camera_axes = np.stack([points[:, 1], 1.0 - points[:, 2], points[:, 0]], axis=-1)
    expected, _ = cv2.projectPoints(
        camera_axes, np.zeros(3), np.zeros(3), BENT.matrix(), np.array(BENT.distortion)
    )
    assert view.project(points) == pytest.approx(expected.reshape(-1, 2), abs=1e-9)


def test_a_point_beyond_the_fold_of_the_lens_is_not_seen() -> None:
    folding = Lens(1280, 800, 1000.0, 1000.0, 639.5, 399.5, (-0.4, 0.0, 0.0, 0.0, 0.0))
    assert math.isnan(seen((1.0, 1.5, 1.0), lens=folding)[0])


small = st.floats(-0.25, 0.25)


@given(
    x=st.floats(-0.5, 0.5),
    up=st.floats(-0.35, 0.35),
    roll=small,
    pitch=small,
    yaw_error=small,
    lens=st.sampled_from([LENS, BENT]),
    side=st.sampled_from([-1.0, 1.0]),
    mount_yaw=st.sampled_from([0.0, math.pi / 2, -math.pi / 2]),
    distance=st.floats(0.6, 3.0),
)
def test_a_point_of_the_shelf_is_found_again_from_its_pixel(
    x: float,
    up: float,
    roll: float,
    pitch: float,
    yaw_error: float,
    lens: Lens,
    side: float,
    mount_yaw: float,
    distance: float,
) -> None:
    mount = ForwardMount(mount_yaw, 0.05, (0.1, -0.02, 0.03))
    yaw = side * math.pi / 2 + yaw_error - mount_yaw
    view = CameraView(lens, Viewpoint.at(4.0, 7.0, 1.5, roll, pitch, yaw, mount))
    shelf_y_m = 7.0 + side * distance
    pixels = view.project(np.array([(4.0 + x, shelf_y_m, 1.5 + up)]))
    ((found_x, found_height),) = view.onto_shelf(pixels, shelf_y_m)
    assert (found_x, found_height) == pytest.approx((4.0 + x, 1.5 + up), abs=1e-6)


@given(yaw=st.floats(-math.pi, math.pi))
def test_a_shelf_behind_the_camera_is_met_by_no_pixel(yaw: float) -> None:
    view = CameraView(LENS, Viewpoint.at(0.0, 0.0, 1.5, 0.0, 0.0, yaw, ForwardMount()))
    ahead = math.copysign(1.2, math.sin(yaw))
    there = view.onto_shelf(np.array([(CX, CY)]), -ahead)
    assert np.isnan(there).all()


def test_the_section_gives_a_lens_with_its_middle_and_a_mount_in_radians() -> None:
    config = FrontCameraConfig.model_validate({"width_px": 640, "height_px": 400, "mount_yaw_deg": 90})
    assert config.lens().centre_px == (config.lens().cx_px, config.lens().cy_px)
    assert config.mount() == ForwardMount(math.pi / 2)
    assert not config.is_fitted
