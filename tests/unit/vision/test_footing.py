"""Where the deck of an opening is hidden by a front, by a side, or by nothing: drawn rasters."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from flightd.core.scanning import PlaceOpening
from flightd.vision.shelf.footing import Footing, footing
from flightd.vision.shelf.opening_raster import BELOW_M, COLUMN_M, ROW_M

WIDTH_M, HEIGHT_M, LIT_M = 0.65, 0.6, 0.4
BEAM, DECK, DARK = (0.12, 0.37, 0.9), (0.31, 0.37, 0.41), (0.06, 0.07, 0.08)
COLUMNS = round(WIDTH_M / COLUMN_M)


def look(
    depths_m: NDArray[np.float64], tone: tuple[float, float, float], eye_m: tuple[float, float, float]
) -> Footing:
    """Of an opening in whose columns the deck goes on to these depths, and something of that tone above."""
    rows = round((HEIGHT_M + BELOW_M) / ROW_M)
    raster = np.empty((rows, COLUMNS, 3), np.float32)
    deck = round(BELOW_M / ROW_M)
    strips = np.minimum(depths_m, LIT_M)
    ends = deck + np.round(eye_m[1] * strips / (eye_m[2] + strips) / ROW_M).astype(int)
    for column, (end, depth_m) in enumerate(zip(ends, depths_m, strict=True)):
        raster[:, column] = tone if depth_m < LIT_M else DARK
        raster[:end, column] = DECK
    raster[:deck] = BEAM
    opening = PlaceOpening(((0.0, 0.0),) * 4, WIDTH_M, HEIGHT_M, eye_m, (False, False))
    return footing(raster, opening, 0.0, np.full(COLUMNS, 0.9))


@given(
    st.tuples(st.floats(-0.4, 0.4), st.floats(0.2, 0.45), st.floats(1.1, 1.3)),
    st.floats(0.02, 0.2),
    st.sampled_from([(0.26, 0.26, 0.27), (0.13, 0.4, 0.22), (0.9, 0.9, 0.92), (0.4, 0.6, 0.75)]),
    st.integers(6, 20),
    st.integers(10, 30),
)
def test_a_front_of_any_colour_stands_where_the_deck_ends_at_one_depth(
    eye_m: tuple[float, float, float],
    depth_m: float,
    tone: tuple[float, float, float],
    start: int,
    width: int,
) -> None:
    depths_m = np.full(COLUMNS, 0.9)
    depths_m[start : start + width] = depth_m
    found = look(depths_m, tone, eye_m)
    assert found.stands[start + 2 : start + width - 2].all()
    assert not found.stands[: start - 3].any()
    assert not found.stands[start + width + 3 :].any()
    assert found.is_free[: start - 1].all()
    assert not found.is_free[start : start + width].any()


@pytest.mark.parametrize("right_m", [-0.35, 0.35])
def test_a_side_whose_foot_rises_into_the_rack_is_no_front(right_m: float) -> None:
    eye_m = (right_m, 0.3, 1.2)
    at_m = (np.arange(COLUMNS) + 0.5) * COLUMN_M - WIDTH_M / 2
    aside_m = np.abs(at_m) * (at_m * right_m > 0.0)  # of goods that end in the middle
    depths_m = np.where(aside_m > 0.0, 1.2 * aside_m / np.maximum(abs(right_m) - aside_m, 0.01), 0.02)
    found = look(depths_m, (0.18, 0.28, 0.37), eye_m)
    rising = (depths_m > 0.08) & (depths_m < 0.3)
    assert rising.sum() >= 4
    assert not found.stands[rising].any()


def test_nothing_is_told_of_a_deck_that_is_seen_from_too_low() -> None:
    found = look(np.full(COLUMNS, 0.05), (0.9, 0.9, 0.9), (0.0, 0.05, 1.2))
    assert not found.stands.any()
    assert not found.is_free.any()
