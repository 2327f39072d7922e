"""The painted floor and the camera: no seams, one floor at every resolution, lens and blur that add up."""

import math
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flightd.core.distortion import undistorted
from flightd.core.errors import InputError
from flightd.core.geometry import Lens
from flightd.sim.appearance import CLEAN, DEFAULT, HARSH, Appearance, preset
from flightd.sim.floor.floor import Floor
from flightd.sim.floor.lighting import Lighting
from flightd.sim.floor.paint_damage import UNDAMAGED, OldLine, PaintDamage, Stripe, Tape
from flightd.sim.floor.texture import Patch
from flightd.sim.sensors.camera_effects import blur_kernel
from flightd.sim.sensors.optics import wide_lens
from flightd.site.site_file import load_site

DEMO = load_site(Path(__file__).parents[3] / "configs" / "site-demo.toml")


def floor(look: Appearance, damage: PaintDamage = UNDAMAGED) -> Floor:
    return Floor(DEMO, look, Lighting(DEMO, look, 4), 4, damage)


def tone(painted: Floor, x_m: float, y_m: float) -> tuple[float, float]:
    """Brightness, and how yellow it is (red less blue), of 4 cm of floor about a point."""
    blue, green, red = painted.paint(Patch(x_m - 0.02, y_m - 0.02, 0.001, 40)).astype(float).mean(axis=(0, 1))
    return (blue + green + red) / 3, red - blue


@pytest.mark.parametrize("look", [DEFAULT, HARSH])
@pytest.mark.parametrize("texel_m", [0.001, 0.004, 0.016])
def test_tiles_join_without_a_seam(look: Appearance, texel_m: float) -> None:
    painted = floor(look)
    side_m = 64 * texel_m
    whole = painted.paint(Patch(-0.4, -0.4, texel_m, 128))
    for row in range(2):
        for column in range(2):
            tile = painted.paint(Patch(-0.4 + column * side_m, -0.4 + row * side_m, texel_m, 64))
            part = whole[row * 64 : row * 64 + 64, column * 64 : column * 64 + 64]
            # a warp knows 32 positions between two cells: texels differ by a grey level or so
            assert np.abs(part.astype(int) - tile).mean() < 1.0
            assert np.abs(part.astype(int)[0] - tile[0]).mean() < 1.5


def test_the_floor_is_the_same_at_every_resolution() -> None:
    painted = floor(DEFAULT)
    fine = painted.paint(Patch(-0.256, -0.256, 0.002, 256)).astype(np.float32)
    coarse = painted.paint(Patch(-0.256, -0.256, 0.008, 64)).astype(np.float32)
    averaged = cv2.resize(fine, (64, 64), interpolation=cv2.INTER_AREA)
    assert np.abs(averaged - coarse).mean() < 5.0
    assert np.corrcoef(averaged.ravel(), coarse.ravel())[0, 1] > 0.98


@pytest.mark.parametrize(
    "lens", [wide_lens(), Lens(640, 360, 400.0, 396.0, 331.5, 170.25, (-0.12, 0.03, 0.001, -0.002, 0.01))]
)
def test_undistorting_inverts_the_lens(lens: Lens) -> None:
    corners = np.array([[-0.8, 0.0, 0.7], [-0.45, 0.1, 0.4]])
    ideal = undistorted(corners, lens)
    zero = np.zeros(3)
    rays = np.vstack([ideal, np.ones(3)]).T.reshape(-1, 1, 3)
    again, _ = cv2.projectPoints(rays, zero, zero, np.eye(3), np.array(lens.distortion))
    assert pytest.approx(corners, abs=1e-9) == again.reshape(-1, 2).T


def test_a_lens_that_folds_the_picture_is_refused() -> None:
    folding = Lens(640, 360, 300.0, 300.0, 319.5, 179.5, (-0.9, 0.0, 0.0, 0.0, 0.0))
    with pytest.raises(ValueError, match="milder lens"):
        undistorted(np.array([[1.2], [0.8]]), folding)


@given(st.floats(-60.0, 60.0), st.floats(-60.0, 60.0), st.floats(0.0, 2.0))
def test_blur_keeps_the_light_and_the_place(right_px: float, down_px: float, soft_px: float) -> None:
    kernel = blur_kernel((right_px, down_px), soft_px)
    if kernel is None:
        assert math.hypot(right_px, down_px) < 0.5
        assert soft_px < 0.5
        return
    assert kernel.sum() == pytest.approx(1.0, abs=1e-5)
    rows, columns = kernel.shape
    assert (rows % 2, columns % 2) == (1, 1)
    assert (kernel.sum(axis=0) * np.arange(columns)).sum() == pytest.approx((columns - 1) / 2, abs=1e-3)
    assert (kernel.sum(axis=1) * np.arange(rows)).sum() == pytest.approx((rows - 1) / 2, abs=1e-3)


def test_a_smear_is_as_long_as_the_way() -> None:
    kernel = blur_kernel((12.0, 0.0), 0.4)
    assert kernel is not None
    along = kernel.sum(axis=0)
    spread = (along * (np.arange(len(along)) - (len(along) - 1) / 2) ** 2).sum()
    assert math.sqrt(12 * (spread - 0.4**2)) == pytest.approx(12.0, rel=0.03)


def test_appearances_have_names_and_limits() -> None:
    assert preset("default") == DEFAULT
    with pytest.raises(InputError, match="choose from: default, clean, harsh"):
        preset("pretty")
    with pytest.raises(ValueError, match="noise"):
        Appearance(noise=-1.0)
    with pytest.raises(ValueError, match="wear"):
        Appearance(wear=math.nan)


def test_gaps_show_concrete_and_covers_what_lies_there() -> None:
    damage = PaintDamage(
        gaps=((2.0, -0.1, 2.4, 0.1),), pallets=((5.0, -0.4, 5.8, 0.8),), gratings=((3.0, -0.08, 4.2, 0.08),)
    )
    whole, damaged = floor(DEFAULT), floor(DEFAULT, damage)
    for on_line in (1.0, 2.2, 3.3, 5.3):
        assert tone(whole, on_line, 0.0)[1] > 100.0
    concrete, _ = tone(whole, 2.2, 0.3)
    assert tone(damaged, 1.0, 0.0) == tone(whole, 1.0, 0.0)
    bare, yellow = tone(damaged, 2.2, 0.0)
    assert bare == pytest.approx(concrete, abs=25.0)
    assert yellow < 25.0
    wood, brown = tone(damaged, 5.3, 0.0)
    assert 25.0 < brown < 80.0
    assert wood < concrete
    steel, grey = tone(damaged, 3.3, 0.0)
    assert steel < 0.65 * concrete
    assert abs(grey) < 15.0


@pytest.mark.parametrize("turn_deg", [0.0, 90.0, 80.0, -10.0])
def test_a_false_line_is_painted_like_a_true_one(turn_deg: float) -> None:
    stripe = Stripe(3.6, 0.6, 0.8, 0.06, math.radians(turn_deg))
    damaged = floor(CLEAN, PaintDamage(false_lines=(stripe,)))
    along = math.cos(stripe.turn_rad), math.sin(stripe.turn_rad)
    for at_m in (-0.37, 0.0, 0.37):
        seen = tone(damaged, 3.6 + at_m * along[0], 0.6 + at_m * along[1])
        assert seen == pytest.approx(tone(damaged, 3.6, 0.0), abs=1.0)
    for at_m, beside_m in ((0.0, 0.06), (0.0, -0.06), (0.43, 0.0), (-0.43, 0.0)):
        x_m, y_m = 3.6 + at_m * along[0] - beside_m * along[1], 0.6 + at_m * along[1] + beside_m * along[0]
        assert tone(damaged, x_m, y_m) == tone(floor(CLEAN), x_m, y_m)


def test_an_old_line_is_fainter_paint_and_the_true_one_lies_on_it() -> None:
    old = OldLine(Stripe(3.6, 0.12, 1.0, 0.08, 0.0), 0.5)
    damaged, clean = floor(CLEAN, PaintDamage(old_lines=(old,))), floor(CLEAN)
    paint, concrete = tone(clean, 3.6, 0.0), tone(clean, 3.6, 0.12)
    faint = tone(damaged, 3.6, 0.12)
    assert concrete[1] + 30.0 < faint[1] < paint[1] - 30.0
    assert tone(damaged, 3.6, 0.0) == paint
    assert tone(damaged, 4.2, 0.12) == concrete
    assert tone(floor(CLEAN, PaintDamage(old_lines=(replace(old, left=0.9),))), 3.6, 0.12)[1] > faint[1]


def test_tape_has_its_own_colour_and_lies_below_the_paint() -> None:
    tape = Tape(Stripe(3.6, 0.0, 0.8, 0.06, math.pi / 2), "red")
    damaged, clean = floor(CLEAN, PaintDamage(tapes=(tape,))), floor(CLEAN)
    blue, green, red = damaged.paint(Patch(3.58, 0.2, 0.001, 40)).astype(float).mean(axis=(0, 1))
    assert (red, green, blue) == pytest.approx((176.0, 40.0, 38.0), abs=3.0)
    assert tone(damaged, 3.6, 0.0) == tone(clean, 3.6, 0.0)


def test_a_grating_keeps_its_tone_from_afar() -> None:
    grated = floor(CLEAN, PaintDamage(gratings=((2.0, -1.0, 4.0, 1.0),)))
    tones = [float(grated.paint(Patch(2.2, -0.6, 0.64 / n, n)).mean()) for n in (640, 160, 40)]
    assert max(tones) - min(tones) < 25.0
