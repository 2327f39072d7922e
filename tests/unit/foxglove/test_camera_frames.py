"""Frames and calibrations: through them a viewer sees each point where the camera's picture shows it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from flightd.adapters.foxglove.cameras import calibration, cameras_on_drone
from flightd.adapters.foxglove.frames import Frames, drone_on_map
from flightd.adapters.ground_link.camera_optics import camera_optics
from flightd.adapters.ground_link.messages.floor import CameraOptics
from flightd.config.schema import Config, load_config
from flightd.core.camera_view import AnyMount, CameraView, ForwardMount, Viewpoint
from flightd.core.geometry import Lens, Matrix, Mount, quaternion_of
from flightd.core.preview import CameraName
from tests.unit.foxglove.test_warehouse_scene import CONFIGS

FRAMES = Frames("hall/map", "north/drone", "north/")
FITTED = load_config(CONFIGS / "sim.toml").with_values(
    camera={
        "mount_yaw_deg": 90.0, "mount_roll_deg": 3.0, "mount_pitch_deg": -5.0,
        "mount_offset_m": (0.05, -0.02, 0.1), "cx_px": 310.0,
    },
    front_camera={
        "url": "device:/dev/video1", "mount_yaw_deg": 90.0, "mount_pitch_deg": 12.0,
        "mount_offset_m": (0.1, 0.03, -0.04),
    },
)  # fmt: skip


def matrix(transform: dict[str, Any]) -> Matrix:
    """(4, 4) from the child's to the parent's coordinates, as Foxglove documents the message."""
    q, t = transform["rotation"], transform["translation"]
    x, y, z, w = q["x"], q["y"], q["z"], q["w"]
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y), t["x"]],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x), t["y"]],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y), t["z"]],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )


def optics_of(config: Config) -> dict[CameraName, CameraOptics]:
    return {optics.camera: optics for optics in camera_optics(config)}


@pytest.mark.parametrize("camera", list(CameraName))
@pytest.mark.parametrize("pose", [(0.0, 0.0, 0.0), (0.1, -0.2, 1.1), (-0.05, 0.08, -2.9)])
def test_a_viewer_projects_a_point_to_the_pixel_that_shows_it(
    camera: CameraName, pose: tuple[float, float, float]
) -> None:
    section = FITTED.camera if camera is CameraName.DOWN else FITTED.front_camera
    lens: Lens = section.lens()
    mount: Mount | ForwardMount = section.mount()
    at = (4.0, -2.5, 1.7)
    view = CameraView(lens, Viewpoint.at(*at, *pose, mount))
    pixels = np.array([[100.0, 80.0], [lens.cx_px, lens.cy_px], [500.0, 300.0]])
    points = np.array(view.rays(pixels)) * 1.5 * (1.0, 1.0, -1.0) + (
        view.viewpoint.x_m,
        view.viewpoint.y_m,
        view.viewpoint.height_m,
    )  # 1.5 m away along the optical axis
    (moved,) = drone_on_map(7, at, pose, FRAMES)["transforms"]
    optics = optics_of(FITTED)
    mounted = {
        found["child_frame_id"]: found for found in cameras_on_drone(optics.values(), 7, FRAMES)["transforms"]
    }
    told = mounted[FRAMES.camera(camera)]
    assert (moved["parent_frame_id"], moved["child_frame_id"]) == ("hall/map", "north/drone")
    assert told["parent_frame_id"] == "north/drone"
    map_from_camera = matrix(moved) @ matrix(told)
    turned_over = np.column_stack([points * (1.0, -1.0, 1.0), np.ones(3)])
    in_camera = np.linalg.inv(map_from_camera) @ turned_over.T
    assert in_camera[2] == pytest.approx(1.5, abs=1e-3), "the optical axis is z"
    projection = np.array(calibration(optics[camera], 7, FRAMES)["P"]).reshape(3, 4)
    u, v, w = projection @ in_camera
    assert np.column_stack([u / w, v / w]) == pytest.approx(pixels, abs=0.3)


def test_the_calibration_is_that_of_the_picture_shown() -> None:
    bent = FITTED.with_values(camera={"distortion": (-0.1, 0.02, 0.001, -0.002, 0.0)})
    optics = optics_of(bent)[CameraName.DOWN]
    whole, half = calibration(optics, 5, FRAMES), calibration(optics, 5, FRAMES, (320, 180))
    assert (whole["width"], whole["height"], whole["frame_id"]) == (640, 360, "north/down_camera")
    assert whole["D"] == [-0.1, 0.02, 0.001, -0.002, 0.0]
    assert whole["K"][:6] == [FITTED.camera.fx_px, 0.0, 310.0, 0.0, FITTED.camera.fy_px, 179.5]
    assert (half["width"], half["height"]) == (320, 180)
    assert half["K"][0] == pytest.approx(whole["K"][0] / 2)
    assert half["K"][2] == pytest.approx((310.0 + 0.5) / 2 - 0.5)
    assert half["P"][:3] == half["K"][:3]


def test_a_camera_that_is_not_fitted_is_not_told() -> None:
    alone = FITTED.with_values(front_camera={"url": ""})
    assert list(optics_of(alone)) == [CameraName.DOWN]


@pytest.mark.parametrize("mount", [Mount(), Mount(math.pi), ForwardMount(2.0, -0.4), ForwardMount(math.pi)])
def test_a_rotation_comes_back_from_its_quaternion(mount: AnyMount) -> None:
    rotation = mount.body_from_image()
    x, y, z, w = quaternion_of(rotation)
    fields = {"rotation": {"x": x, "y": y, "z": z, "w": w}, "translation": {"x": 0.0, "y": 0.0, "z": 0.0}}
    assert matrix(fields)[:3, :3] == pytest.approx(rotation, abs=1e-12)
