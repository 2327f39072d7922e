"""The rendered picture: geometry to a fraction of a pixel, repeatable, and fit for any pose."""

from dataclasses import fields, replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from flightd.core.geometry import Lens, Mount, ground_homography, heading_rotation, level_from_body
from flightd.sim.appearance import CLEAN, DEFAULT, HARSH, Appearance
from flightd.sim.floor.renderer import Renderer
from flightd.sim.plant.kinematics import Kinematics
from flightd.sim.sensors.optics import SimCamera, moved, wide_lens
from flightd.site.layout import lay_out
from flightd.site.site import Aisle, LineColour, Pad, Site
from flightd.site.site_file import load_site

CONFIGS = Path(__file__).parents[3] / "configs"
DEMO = load_site(CONFIGS / "site-demo.toml")


def hover(x_m: float = 0.0, y_m: float = 0.0, height_m: float = 1.2, **motion: float) -> Kinematics:
    rest = {field.name: 0.0 for field in fields(Kinematics)}
    return Kinematics(**(rest | {"stamp_ns": 0, "x_m": x_m, "y_m": y_m, "height_m": height_m} | motion))  # type: ignore[arg-type]


def project(points_m: NDArray[np.float64], camera: SimCamera, kinematics: Kinematics) -> NDArray[np.float64]:
    """Pixels of map points by `ground_homography`, with the lens's distortion by OpenCV."""
    offset = level_from_body(kinematics.roll_rad, kinematics.pitch_rad) @ np.array(camera.mount.offset_m)
    height_m = kinematics.height_m - offset[2]
    from_body = points_m - (kinematics.x_m, kinematics.y_m)
    level = from_body @ heading_rotation(kinematics.yaw_rad)[:2, :2] - offset[:2]
    ground = np.column_stack([level / height_m, np.ones(len(level))])
    homography = ground_homography(camera.lens, camera.mount, kinematics.roll_rad, kinematics.pitch_rad)
    ideal = ground @ homography.T
    rays = ideal @ np.linalg.inv(camera.lens.matrix()).T
    zero = np.zeros(3)
    pixels, _ = cv2.projectPoints(
        rays.reshape(-1, 1, 3), zero, zero, camera.lens.matrix(), np.array(camera.lens.distortion)
    )
    return np.asarray(pixels.reshape(-1, 2), np.float64)


def linear_blue(picture: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Blue light without the gamma: there paint counts by the area it covers."""
    light: NDArray[np.float32] = ((picture[..., 0].astype(np.float32) / 255.0 + 0.055) / 1.055) ** 2.4
    return light


def edge_offsets_px(
    light: NDArray[np.float32], at: NDArray[np.float64], inward: NDArray[np.float64], reach_px: float = 5.0
) -> NDArray[np.float64]:
    """How far from `at`, along the direction to the points `inward`, the paint's edge is seen."""
    normals = (inward - at) / np.linalg.norm(inward - at, axis=1, keepdims=True)
    steps = np.arange(-reach_px, reach_px + 0.01, 0.1)
    samples = (at[:, None, :] + steps[None, :, None] * normals[:, None, :]).astype(np.float32)
    profiles = np.asarray(cv2.remap(light, samples[..., 0], samples[..., 1], cv2.INTER_LINEAR))
    offsets = []
    for profile in profiles:
        middle = (profile[:10].mean() + profile[-10:].mean()) / 2
        first = int(np.argmax(profile < middle))
        share = (profile[first - 1] - middle) / (profile[first - 1] - profile[first])
        offsets.append(steps[first - 1] + 0.1 * share)
    return np.array(offsets)


CAMERAS = {
    "plain": SimCamera(lens=replace(wide_lens(), distortion=(0.0, 0.0, 0.0, 0.0, 0.0))),
    "default": SimCamera(),
    "mounted": SimCamera(
        lens=Lens(640, 360, 400.0, 396.0, 331.5, 170.25, (-0.12, 0.03, 0.001, -0.002, 0.0)),
        mount=Mount(yaw_rad=0.6, offset_m=(0.08, -0.03, 0.05)),
    ),
    "full-hd": SimCamera(lens=wide_lens(1920, 1080)),
}


@pytest.mark.parametrize("name", CAMERAS)
@pytest.mark.parametrize(
    "pose",
    [
        hover(2.7, 0.0),
        hover(2.6, 0.1, 1.1, roll_rad=0.2, pitch_rad=-0.15, yaw_rad=0.4),
        hover(2.75, -0.05, 1.8, roll_rad=-0.3, pitch_rad=0.25, yaw_rad=2.5),
        hover(2.7, 0.02, 0.35, roll_rad=0.05, pitch_rad=0.1, yaw_rad=-1.0),
    ],
)
def test_floor_points_appear_where_the_geometry_says(name: str, pose: Kinematics) -> None:
    camera = CAMERAS[name]
    picture = Renderer(DEMO, camera, CLEAN).render(pose, 0)
    half_m, node = DEMO.line_width_m / 2, DEMO.nodes["A3"]
    reach = np.concatenate([np.linspace(-0.4, -0.1, 16), np.linspace(0.1, 0.4, 16)])
    checked = 0
    for side in (-1.0, 1.0):
        for edge, line in (
            (np.column_stack([node.x_m + reach, np.full(32, side * half_m)]), np.array([0.0, -side * 0.01])),
            (np.column_stack([np.full(32, node.x_m + side * half_m), reach]), np.array([-side * 0.01, 0.0])),
        ):
            at, inward = project(edge, camera, pose), project(edge + line, camera, pose)
            inside = ((at > 8) & (at < (camera.lens.width_px - 9, camera.lens.height_px - 9))).all(axis=1)
            offsets = edge_offsets_px(linear_blue(picture), at[inside], inward[inside])
            assert np.abs(offsets).max(initial=0.0) < 0.3
            checked += inside.sum()
    assert checked > 20


@pytest.mark.parametrize("look", [DEFAULT, HARSH])
def test_a_picture_depends_on_pose_seed_and_seq_not_on_what_came_before(look: Appearance) -> None:
    poses = [hover(0.3 * i, 0.1 * i, 0.4 + 0.3 * i, yaw_rad=0.3 * i, vx_mps=0.5) for i in range(6)]
    forward, backward = Renderer(DEMO, SimCamera(), look, 5), Renderer(DEMO, SimCamera(), look, 5)
    taken = [forward.render(pose, seq).copy() for seq, pose in enumerate(poses)]
    for seq in reversed(range(6)):
        assert np.array_equal(backward.render(poses[seq], seq), taken[seq])
    assert not np.array_equal(forward.render(poses[0], 1), taken[0])
    assert not np.array_equal(Renderer(DEMO, SimCamera(), look, 6).render(poses[0], 0), taken[0])


def test_the_picture_is_written_where_it_is_wanted() -> None:
    renderer = Renderer(DEMO, SimCamera(), DEFAULT, 1)
    out = np.zeros((360, 640, 3), np.uint8)
    assert renderer.render(hover(), 3, out) is out
    assert np.array_equal(out, renderer.render(hover(), 3))
    assert out.flags.c_contiguous
    with pytest.raises(ValueError, match="640x360"):
        renderer.render(hover(), 0, np.zeros((480, 640, 3), np.uint8))


RENDERER = Renderer(DEMO, SimCamera(), DEFAULT, 2)


@settings(max_examples=25, deadline=None)
@given(
    x_m=st.floats(-200.0, 200.0),
    y_m=st.floats(-200.0, 200.0),
    height_m=st.floats(0.0, 6.0),
    roll_rad=st.floats(-1.5, 1.5),
    pitch_rad=st.floats(-1.5, 1.5),
    yaw_rad=st.floats(-7.0, 7.0),
    vx_mps=st.floats(-5.0, 5.0),
    roll_rate_radps=st.floats(-6.0, 6.0),
)
def test_every_pose_gives_a_picture(x_m: float, y_m: float, height_m: float, **motion: float) -> None:
    picture = RENDERER.render(hover(x_m, y_m, height_m, **motion), 0)
    assert 10.0 < picture.mean() < 240.0


def test_outside_the_warehouse_there_is_bare_concrete() -> None:
    far = Renderer(DEMO, SimCamera(), CLEAN).render(hover(80.0, -60.0), 0)
    assert far.std(axis=(0, 1)).max() < 1.0
    assert np.ptp(far.mean(axis=(0, 1))) < 15.0


def test_speed_smears_the_picture_along_its_way_only() -> None:
    renderer = Renderer(DEMO, SimCamera(exposure_s=0.02), replace(CLEAN, motion_blur=True))
    at = hover(2.7, 0.25)
    sharp = renderer.render(at, 0)
    along, across = renderer.render(replace(at, vx_mps=2.0), 0), renderer.render(replace(at, vy_mps=2.0), 0)

    def steepest(picture: NDArray[np.uint8]) -> float:
        return float(np.abs(np.diff(picture[60, :, 0].astype(float))).max())

    assert steepest(along) > 0.85 * steepest(sharp)
    assert steepest(across) < 0.4 * steepest(sharp)


def test_the_smear_leaves_mid_exposure_in_place() -> None:
    camera = SimCamera(exposure_s=0.02)
    renderer = Renderer(DEMO, camera, replace(CLEAN, motion_blur=True))
    moving = hover(2.1, 0.2, vy_mps=1.5, roll_rate_radps=0.3, yaw_rad=0.2)
    edge = np.column_stack([np.linspace(1.9, 2.3, 9), np.full(9, DEMO.line_width_m / 2)])
    at, inward = project(edge, camera, moving), project(edge - (0.0, 0.01), camera, moving)
    blue = renderer.render(moving, 0)[..., 0].astype(np.float32)
    assert np.abs(edge_offsets_px(blue, at, inward, 9.0)).max() < 0.3


@pytest.mark.parametrize("colour", [*LineColour, "#7a3fa0"])
def test_paint_has_its_colour(colour: str) -> None:
    site = one_line(colour)
    picture = Renderer(site, SimCamera(), CLEAN).render(hover(1.0, 0.0), 0)
    blue, green, red = (int(v) for v in picture[100, 320])
    match colour:
        case LineColour.YELLOW:
            assert red > green > 2 * blue
        case LineColour.WHITE:
            assert min(red, green, blue) > 200
        case LineColour.RED:
            assert red > 2 * max(green, blue)
        case LineColour.BLUE:
            assert blue > 1.5 * max(green, red)
        case LineColour.GREEN:
            assert green > 1.5 * max(blue, red)
        case LineColour.BLACK:
            assert max(red, green, blue) < 60
        case LineColour.ORANGE:
            assert red > 1.8 * green > 2.5 * blue
        case _:
            assert blue > red > 1.5 * green


def one_line(colour: str) -> Site:
    return lay_out("one", [Aisle("A", 0.0, 0.0, (2.0,))], [], [Pad("home", "A1", 0.5)], line_colour=colour)


def test_the_line_shows_on_the_dark_pad() -> None:
    picture = Renderer(DEMO, SimCamera(), CLEAN).render(hover(0.0, 0.0, 0.5), 0)
    assert picture[180, 320].max() > 200  # paint in the middle
    assert picture[120, 260].max() < 80  # mat beside it


def test_worn_paint_is_partly_gone_and_noise_is_as_asked() -> None:
    clean = Renderer(DEMO, SimCamera(), CLEAN).render(hover(2.1, 0.0), 0)
    worn = Renderer(DEMO, SimCamera(), replace(CLEAN, wear=0.4), 1).render(hover(2.1, 0.0), 0)
    paint = clean[..., 0] < 80
    gone = (worn[..., 0] > 110) & paint
    assert 0.05 < gone.sum() / paint.sum() < 0.6
    noisy = Renderer(DEMO, SimCamera(), replace(CLEAN, noise=4.0), 1).render(hover(2.1, 0.0), 0)
    bare = np.abs(clean.astype(int) - clean[5, 100].astype(int)).max(axis=2) == 0
    assert noisy[bare].std(axis=0) == pytest.approx([4.0] * 3, rel=0.3)


def test_with_a_rolling_shutter_each_row_is_seen_from_where_the_camera_was_then() -> None:
    still = replace(CLEAN, motion_blur=False)
    pose = hover(
        2.7, 0.05, 1.4, vx_mps=0.8, vy_mps=-0.3, roll_rate_radps=0.5, yaw_rate_radps=0.4, yaw_rad=0.3
    )
    rolling = Renderer(DEMO, SimCamera(readout_s=0.02), still).render(pose, 0).astype(int)
    at_once = Renderer(DEMO, SimCamera(), still)
    rows = {-0.01: slice(0, 8), 0.0: slice(176, 184), 0.01: slice(352, 360)}
    for dt_s, part in rows.items():
        same = at_once.render(moved(pose, dt_s), 0).astype(int)[part]
        others = [at_once.render(moved(pose, other), 0).astype(int)[part] for other in rows if other != dt_s]
        off = np.abs(rolling[part] - same).mean()
        assert off < 0.25 * min(np.abs(rolling[part] - other).mean() for other in others), dt_s
