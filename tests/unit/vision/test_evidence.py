"""What paint the bands account for."""

from __future__ import annotations

import math

import numpy as np
import pytest

from flightd.core.types import Image
from flightd.vision.lines import band_evidence as evidence
from flightd.vision.lines import centroid
from flightd.vision.lines.colour_profile import STRONG, WEAK, Levels
from flightd.vision.lines.sampling import Grid
from flightd.vision.lines.undistortion import Plane
from tests.unit.vision import drawing
from tests.unit.vision.drawing import Band, grid

GRID, PLANE = Grid(320, 240, 1), Plane(320, 240)


def mask_of(bands: list[Band]) -> Image:
    return drawing.mask_of(bands, *grid(320, 240))


@pytest.mark.parametrize("theta", [0.0, 0.7, 1.9])
def test_paint_is_left_until_every_band_is_known(theta: float) -> None:
    bands = [Band(-40.0, theta, 12.0), Band(30.0, theta + math.pi / 2, 20.0)]
    strips = centroid.find(mask_of(bands), GRID, PLANE)
    assert len(strips) == 2
    assert not evidence.is_paint_left(mask_of(bands), strips, GRID, PLANE)
    for one in strips:
        assert evidence.is_paint_left(mask_of(bands), [one], GRID, PLANE)


def test_specks_are_no_paint_left() -> None:
    mask = mask_of([])
    mask[50:54, 60:64] = 255
    assert not evidence.is_paint_left(mask, [], GRID, PLANE)


def levels_of(short: Band, level: int, filled: float, long: int = STRONG) -> Levels:
    """A band of level `long` across the picture, and a short one beside it of which a part is `level`."""
    painted = np.random.default_rng(5).random((240, 320)) < filled
    levels: Levels = np.where(mask_of([short]) > 0, painted * level, 0).astype(np.uint8)
    levels[mask_of([Band(-90.0, 0.2, 12.0)]) > 0] = long
    return levels


@pytest.mark.parametrize(
    ("level", "filled", "half_px", "kept"),
    [
        (WEAK, 0.6, 45.0, False),  # lettering
        (STRONG, 0.6, 45.0, True),  # worn
        (WEAK, 1.0, 45.0, True),  # in shadow
        (WEAK, 0.6, 90.0, True),  # as long as a line
    ],
)
def test_a_short_patchy_band_of_a_similar_colour_is_no_line(
    level: int, filled: float, half_px: float, kept: bool
) -> None:
    short = Band(40.0, 0.2, 16.0, -half_px, half_px)
    strips = centroid.find(mask_of([Band(-90.0, 0.2, 12.0), short]), GRID, PLANE)
    left = evidence.without_faint(strips, levels_of(short, level, filled), GRID, PLANE)
    assert (len(strips), len(left)) == (2, 1 + kept)


def test_where_nothing_is_strong_weak_bands_are_lines() -> None:
    short = Band(40.0, 0.2, 16.0, -45.0, 45.0)
    strips = centroid.find(mask_of([short]), GRID, PLANE)
    levels = levels_of(short, WEAK, 0.6, long=WEAK)
    assert len(strips) == 1
    assert evidence.without_faint(strips, levels, GRID, PLANE) == strips
