"""Bands from the centroids of thin slabs of a mask."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from flightd.core.types import Image
from flightd.vision.lines import centroid
from flightd.vision.lines.sampling import Grid, grid_for
from flightd.vision.lines.undistortion import Plane
from tests.unit.vision import drawing
from tests.unit.vision.drawing import Band

PLANE = Plane(1920, 1080)
GRID = grid_for(1920, 1080)


def mask_of(bands: list[Band], grid: Grid = GRID) -> Image:
    x: NDArray[np.float64] = grid.x(np.arange(grid.width))[None, :] + np.zeros((grid.height, 1))
    y: NDArray[np.float64] = grid.y(np.arange(grid.height))[:, None] + np.zeros((1, grid.width))
    return drawing.mask_of(bands, x, y)


@pytest.mark.parametrize("size", [(16, 16), (17, 640), (640, 17), (1919, 1079), (1920, 1080)])
@pytest.mark.parametrize("value", [0, 255])
def test_a_mask_of_one_value_has_no_band(size: tuple[int, int], value: int) -> None:
    grid = grid_for(*size)
    assert centroid.find(np.full((grid.height, grid.width), value, np.uint8), grid, Plane(*size)) == []


@pytest.mark.parametrize("theta", np.linspace(-math.pi / 2, math.pi / 2, 13).tolist())
@pytest.mark.parametrize("width", [12.0, 40.0, 150.0])
def test_a_band_of_any_direction_is_found_within_a_sample(theta: float, width: float) -> None:
    strips = centroid.find(mask_of([Band(60.0, theta, width)]), GRID, PLANE)
    line = min((strip.to_line() for strip in strips), key=lambda line: abs(abs(line.rho_px) - 60.0))
    assert abs(line.rho_px) == pytest.approx(60.0, abs=0.5 * GRID.step)
    assert line.width_px == pytest.approx(width, abs=1.1 * GRID.step)


def test_a_short_band_among_long_ones_gets_its_draws() -> None:
    long = [Band(rho, 0.1, 30.0) for rho in (-700.0, -400.0, -100.0, 300.0, 600.0)]
    short = Band(500.0, 1.3, 14.0, -60.0, 140.0)
    strips = centroid.find(mask_of([*long, short]), GRID, PLANE)
    assert any(not s.steep and abs(s.width_px - 14.0) < 6.0 for s in strips)
    assert sum(s.steep and abs(s.width_px - 30.0) < 6.0 for s in strips) == len(long)


def test_the_slabs_come_closer_the_less_paint_there_is() -> None:
    spacings = [centroid.slab_spacing(coverage) for coverage in (0.01, 0.05, 0.3)]
    assert spacings == sorted(spacings)
    assert spacings[0] < spacings[-1]
