"""Which pixels are looked at, and where the lens moves them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flightd.core.geometry import Lens
from flightd.vision.lines.sampling import OUTSIDE, Grid, coarsened, grid_for, look_up, sample
from flightd.vision.lines.undistortion import Plane

FISHY = Lens(640, 360, 420.0, 415.0, 322.0, 178.0, (-0.25, 0.08, 0.002, -0.001, -0.01))


@given(width=st.integers(16, 700), height=st.integers(16, 500), step=st.integers(1, 6))
def test_sample_i_is_pixel_k_i_and_a_half_step(width: int, height: int, step: int) -> None:
    y, x = np.mgrid[0:height, 0:width]
    image = np.stack([x & 255, y & 255, (x >> 8) + 16 * (y >> 8)], axis=-1).astype(np.uint8)
    grid = Grid(width, height, step)
    small = sample(image, grid)
    assert small.shape == (grid.height, grid.width, 3)
    if step > 1:
        expected = image[grid.offset :: step, grid.offset :: step][: grid.height, : grid.width]
        assert np.array_equal(small, expected)


@pytest.mark.parametrize("size", [(1920, 1080), (1918, 1077), (640, 360), (300, 200)])
def test_a_coarse_sample_is_the_pixel_its_grid_tells(size: tuple[int, int]) -> None:
    width, height = size
    y, x = np.mgrid[0:height, 0:width]
    image = np.stack([x & 255, y & 255, (x >> 8) + 16 * (y >> 8)], axis=-1).astype(np.uint8)
    grid = grid_for(width, height)
    coarse, where = coarsened(sample(image, grid), grid)
    assert coarse.shape == (where.height, where.width, 3)
    columns = where.x(np.arange(where.width)) + (width - 1) / 2
    rows = where.y(np.arange(where.height)) + (height - 1) / 2
    assert np.array_equal(coarse, image[np.ix_(rows.astype(int), columns.astype(int))])


@given(width=st.integers(16, 4000), height=st.integers(16, 4000), i=st.integers(0, 50))
def test_a_sample_s_place_leads_back_to_it(width: int, height: int, i: int) -> None:
    grid = grid_for(width, height)
    assert grid.places(grid.x(i), grid.y(i)) == pytest.approx([i, i], abs=1e-3)


def test_what_is_looked_up_is_the_nearest_sample_or_outside() -> None:
    table = np.array([[0, 255], [255, 0]], np.uint8)
    places = np.array([[(0.4, 0.4), (0.6, 0.4), (-0.6, 0.0)], [(1.4, 1.4), (np.inf, 0.0), (1e9, -1e9)]])
    found = look_up(table, places.astype(np.float32))
    assert found.tolist() == [[0, 255, OUTSIDE], [0, OUTSIDE, OUTSIDE]]


def test_as_many_places_as_one_likes_are_looked_up() -> None:
    table = np.array([[0, 255]], np.uint8)
    places = np.zeros((70_000, 1, 2), np.float32)
    places[::2, 0, 0] = 1.0
    assert np.array_equal(look_up(table, places)[:, 0], np.tile(np.array([255, 0], np.uint8), 35_000))


def test_the_usual_pictures_are_looked_at_320_samples_wide() -> None:
    assert grid_for(1920, 1080).step == 6
    assert grid_for(640, 360).step == 2
    assert grid_for(3840, 2160).step == 6  # a 6 px line must still leave a trace


def test_taking_out_the_lens_and_putting_it_back_changes_nothing() -> None:
    plane = Plane(640, 360, FISHY)
    x, y = np.meshgrid(np.linspace(-310, 310, 21), np.linspace(-170, 170, 13))
    ideal = plane.ideal(x, y)
    assert np.abs(np.hypot(ideal[0] - x, ideal[1] - y)).max() > 5
    back = plane.raw(*ideal)
    assert back[0] == pytest.approx(x, abs=0.02)
    assert back[1] == pytest.approx(y, abs=0.02)


def test_without_a_lens_nothing_moves() -> None:
    x, y = np.array([1.5, -20.0]), np.array([3.0, 4.0])
    assert Plane(640, 360).ideal(x, y)[0] is x
    assert Plane(640, 360).raw(x, y)[1] is y
