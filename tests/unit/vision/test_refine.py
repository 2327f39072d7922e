"""What the full frame says against a band that the small mask shows."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from flightd.core.types import Image
from flightd.vision.line_detector import Detector
from tests.unit.vision.drawing import FLOOR, Band, coverage, draw, grid, nearest, photographed

BAND = Band(20.0, 0.3, 60.0)


def floor_with(shade: NDArray[np.float64]) -> Image:
    """Grey floor whose brightness is multiplied by `shade` (H, W), a little blurred and noisy."""
    return photographed(shade[..., None] * np.array(FLOOR), 0, 2.0)


@pytest.mark.parametrize("shade", [0.6, 0.7])
def test_a_soft_shadow_is_no_black_line(shade: float) -> None:
    painted = coverage([BAND], *grid(1920, 1080))
    soft = 1 - (1 - shade) * np.asarray(cv2.GaussianBlur(painted, (0, 0), 9.0), np.float64)
    assert Detector(profile="black").detect(floor_with(soft)).lines == ()


def test_a_black_line_is_one_even_where_it_reflects_as_much_as_a_shadow() -> None:
    painted = coverage([BAND], *grid(1920, 1080))
    seen = Detector(profile="black").detect(floor_with(1 - 0.55 * painted))
    _, rho, theta = nearest(seen, BAND)
    assert abs(rho) < 0.1
    assert abs(theta) < 1e-3


def test_a_tyre_mark_in_a_shadow_is_no_black_line() -> None:
    """Sharp as paint, and there as dark as black paint in the light."""
    x, y = grid(1920, 1080)
    mark = 1 - 0.28 * coverage([BAND], x, y)
    shadow = 1 - 0.6 * np.clip((300 - np.abs(y)) / 80, 0, 1)
    picture = floor_with(mark * shadow)
    assert Detector("centroid", "black").detect(picture).lines
    assert Detector("combined", "black").detect(picture).lines == ()


@pytest.mark.parametrize(
    ("colour", "paint", "left"), [("green", (70, 140, 50), 0.3), ("black", (40, 40, 40), 0.4)]
)
@pytest.mark.parametrize("width", [8.0, 24.0])
def test_a_faded_line_on_a_light_floor_is_no_mark(
    colour: str, paint: tuple[int, int, int], left: float, width: float
) -> None:
    """Green that is no darker than a tyre's mark, and black that is just so."""
    band = Band(10.0, 0.3, width)
    covered = left * coverage([band], *grid(640, 360))[..., None]
    seen = np.array((205, 208, 210)) * (1 - covered) + np.array(paint) * covered
    assert abs(nearest(Detector(profile=colour).detect(photographed(seen, 0, 2.0)), band)[1]) < 1.0


def test_the_border_of_a_darker_floor_is_no_line() -> None:
    x, y = grid(1920, 1080)
    dark = 1 - 0.5 * np.clip(x * np.cos(0.3) + y * np.sin(0.3) + 0.5, 0, 1)
    for profile in ("black", "white"):
        assert Detector(profile=profile).detect(floor_with(dark)).lines == ()


def test_a_strip_between_a_dark_floor_and_a_light_one_is_no_black_line() -> None:
    _, y = grid(1920, 1080)
    picture = floor_with(np.where(y < 0, 0.5, np.where(y < 16, 0.6, 1.0)))
    assert Detector("centroid", "black").detect(picture).lines
    assert Detector("combined", "black").detect(picture).lines == ()


@pytest.mark.parametrize("theta", [0.0, np.pi / 2])
@pytest.mark.parametrize("floor_px", [3.0, 4.0, 5.0])
@pytest.mark.parametrize("width", [16.0, 20.0, 26.0])
def test_a_line_beside_a_little_floor_at_the_border_is_one(
    width: float, floor_px: float, theta: float
) -> None:
    half = 320.0 if theta == 0 else 180.0
    band = Band(half - floor_px - width / 2, theta, width)
    _, rho, turn = nearest(Detector().detect(draw([band])), band)
    assert abs(rho) < 1.1  # of a 4 px wide strip of floor one edge may be all that can be located
    assert abs(turn) < 3e-3


@pytest.mark.parametrize("theta", [0.03, 0.06, -0.03])
@pytest.mark.parametrize("beyond_px", [4.0, 10.0])
def test_goods_that_the_border_cuts_are_no_line_along_it(beyond_px: float, theta: float) -> None:
    """Boards of a pallet at the foot of a shelf, of about the paint's colour."""
    x, y = grid(640, 360)
    covered = coverage([Band(320.0 + beyond_px, theta, 60.0)], x, y)[..., None]
    wood = np.array((62, 82, 98)) * np.where((y + 200) % 34 < 5, 0.35, 1.0)[..., None]
    shown = np.array((118, 118, 120)) * (1 - covered) + wood * covered
    for seed in range(3):
        assert Detector().detect(photographed(shown, seed, 6.0)).lines == ()


@pytest.mark.parametrize("blur_px", [5, 13, 25])
def test_a_black_line_blurred_by_motion_is_no_shadow(blur_px: int) -> None:
    band = Band(20.0, 0.0, 50.0)
    sharp = floor_with(1 - 0.6 * coverage([band], *grid(1280, 720)))
    blurred = np.asarray(cv2.blur(sharp, (blur_px, 1)), np.uint8)
    _, rho, _ = nearest(Detector(profile="black").detect(blurred), band)
    assert abs(rho) < 1.0
