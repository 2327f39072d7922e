"""Up to where dim fronts go, by their outlines: drawn rows of parts of white."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from flightd.vision.shelf.dim_fronts import risen

ROWS, COLUMNS = 200, 60
REACH = (20, 190)
PALLET = 40
"""Row up to which a light pallet is known, in columns 15 to 44."""
KNOWN = np.where((np.arange(COLUMNS) >= 15) & (np.arange(COLUMNS) < 45), PALLET, 0).astype(np.intp)


def found(
    load: tuple[slice, slice], level: float, stands: slice = slice(15, 45), known: NDArray[np.intp] = KNOWN
) -> list[int]:
    """The rows up to which the front goes in the load's first and last column, with a load of that level."""
    colours = np.full((ROWS, COLUMNS, 3), 0.06, np.float32)
    colours[load] = level
    colours[:PALLET, 15:45] = 0.6
    flags = np.zeros(COLUMNS, np.bool_)
    flags[stands] = True
    fronts = risen(known, colours, flags, REACH)
    return [int(fronts[load[1].start]), int(fronts[load[1].stop - 1])]


@pytest.mark.parametrize("level", [0.25, 0.4])
def test_a_dim_load_on_a_light_pallet_is_a_front_up_to_its_upper_edge(level: float) -> None:
    assert found((slice(PALLET, 150), slice(15, 45)), level) == pytest.approx([150, 150], abs=1)


def test_what_is_no_lighter_than_goods_at_the_back_is_no_front() -> None:
    assert found((slice(PALLET, 150), slice(15, 45)), 0.2) == [PALLET, PALLET]


def test_a_top_that_goes_on_beside_is_a_top() -> None:
    assert found((slice(PALLET, 150), slice(20, 38)), 0.3) == [PALLET, PALLET]


def test_an_upper_edge_that_is_not_level_is_that_of_a_side() -> None:
    colours = np.full((ROWS, COLUMNS, 3), 0.06, np.float32)
    for column in range(15, 45):
        colours[PALLET : 80 + 2 * column, column] = 0.35
    colours[:PALLET, 15:45] = 0.6
    assert (risen(KNOWN, colours, KNOWN > 0, REACH) == KNOWN).all()


def test_where_no_front_stands_nothing_rises() -> None:
    assert found((slice(PALLET, 150), slice(15, 45)), 0.35, stands=slice(0, 0)) == [PALLET, PALLET]
