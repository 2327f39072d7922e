"""What is plotted of a long series: no peak is lost, and nothing is drawn where nothing is known."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flightd.replay.playback.decimation import TimeGrid, decimated

numbers = st.one_of(st.floats(-1e6, 1e6), st.just(math.nan))
steps = st.floats(0.001, 0.5)


@given(st.lists(st.tuples(steps, numbers), min_size=1, max_size=300), st.integers(1, 40))
def test_the_lowest_and_the_highest_value_are_kept(
    samples: list[tuple[float, float]], stretches: int
) -> None:
    t_s = np.cumsum([step for step, _ in samples])
    values = np.array([value for _, value in samples])
    found = decimated(t_s, values, TimeGrid(0.0, float(t_s[-1]) + 0.001, stretches))
    assert found.shape == (2 * stretches,)
    known = values[np.isfinite(values)]
    if len(known):
        assert np.nanmin(found) == known.min()
        assert np.nanmax(found) == known.max()
    else:
        assert np.isnan(found).all()


def test_the_two_values_of_a_stretch_come_in_the_order_in_which_they_were_measured() -> None:
    t_s = np.array([0.1, 0.2, 0.3, 1.1, 1.2, 1.3])
    found = decimated(t_s, np.array([1.0, 2.0, 3.0, 9.0, 5.0, 4.0]), TimeGrid(0.0, 2.0, 2))
    assert found.tolist() == [1.0, 3.0, 9.0, 4.0]


def test_rare_samples_are_joined_and_a_gap_stays_one() -> None:
    t_s, values = np.array([0.0, 1.0, 4.0, 5.0]), np.array([0.0, 1.0, 4.0, 5.0])
    grid = TimeGrid(0.0, 5.0, 50)
    found = decimated(t_s, values, grid)
    times = grid.times_s()
    joined = (times > 0.1) & (times < 0.9)
    assert found[joined] == pytest.approx(times[joined])
    assert np.isnan(found[(times > 1.1) & (times < 3.9)]).all(), "three seconds in which nothing was heard"


def test_what_lies_outside_of_the_grid_is_left_out() -> None:
    found = decimated(np.array([-5.0, 0.5, 9.0]), np.array([-99.0, 1.0, 99.0]), TimeGrid(0.0, 1.0, 1))
    assert found.tolist() == [1.0, 1.0]


@pytest.mark.parametrize(
    ("from_s", "to_s", "stretches"), [(1.0, 1.0, 3), (2.0, 1.0, 3), (0.0, 1.0, 0), (0.0, math.nan, 1)]
)
def test_a_grid_without_time_is_none(from_s: float, to_s: float, stretches: int) -> None:
    with pytest.raises(ValueError, match="no time grid"):
        TimeGrid(from_s, to_s, stretches)
