"""Goods that fill their places in part, and what the truth says of them."""

from __future__ import annotations

import itertools
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest

from flightd.sim.racks.appearance import RackAppearance
from flightd.sim.racks.rack_layout import openings
from flightd.sim.racks.stock import StockPlace, StockShares, stock
from flightd.sim.racks.stock_truth import stock_truth
from flightd.site.shelf_cells import cells_of
from flightd.site.site_file import load_site

CONFIGS = Path(__file__).parents[3] / "configs"
SITE = load_site(CONFIGS / "site-racks-small.toml")
FOCAL_PX = 1000.0


@cache
def places(in_part: float) -> dict[str, StockPlace]:
    return dict(stock(SITE, StockShares(), FOCAL_PX, 1, in_part))


def test_places_that_are_not_filled_in_part_stay_as_they_are() -> None:
    some = places(0.5)
    changed = {code for code, place in places(0.0).items() if some[code] != place}
    assert 10 < len(changed) < len(some) - 10
    assert all(some[code].goods is not None for code in changed)


def test_stacks_stand_beside_each_other_in_their_opening() -> None:
    for place in places(1.0).values():
        if place.goods is None:
            continue
        ends = sorted(
            (stack.right_m - stack.width_m / 2, stack.right_m + stack.width_m / 2)
            for stack in place.goods.stacks
        )
        half_m = place.opening.width_m / 2
        assert -half_m - 1e-9 <= ends[0][0]
        assert ends[-1][1] <= half_m + 1e-9
        assert all(left[1] <= right[0] + 1e-9 for left, right in itertools.pairwise(ends))
        assert all(0.0 < stack.height_m <= place.opening.level.height_m for stack in place.goods.stacks)


def test_labels_hang_on_a_stack_and_no_text_is_lost_to_another() -> None:
    found = places(1.0)
    for place in found.values():
        for label in place.labels:
            assert place.goods is not None
            aside_m = abs(label.right_m - place.goods.right_m) + label.paper_size_m[0] / 2
            assert aside_m <= place.goods.width_m / 2 + 0.03
            assert 0.0 < label.height_m - place.opening.level.deck_m < place.goods.height_m
    texts = [text for place in found.values() for text in place.readable]
    assert len(texts) == len(set(texts)) > 20


def test_the_truth_says_how_full_each_place_is() -> None:
    truth = stock_truth(SITE, replace(RackAppearance(), in_part=1.0), FOCAL_PX, 1)
    fills = sorted(truth[code].fill for code, place in places(1.0).items() if place.goods is not None)
    assert fills[0] < 0.2
    assert fills[-1] > 0.6
    assert all(truth[code].fill == 0.0 for code, place in places(1.0).items() if place.goods is None)


@pytest.mark.parametrize("name", ["site-racks.toml", "site-racks-small.toml"])
def test_the_map_has_the_openings_where_the_world_has_them(name: str) -> None:
    site = load_site(CONFIGS / name)
    cells = cells_of(site)
    for opening in openings(site):
        cell = cells[opening.location.code]
        assert (cell.x0_m + cell.x1_m) / 2 == pytest.approx(opening.x_m)
        assert cell.x1_m - cell.x0_m == pytest.approx(opening.width_m)
        assert (cell.deck_m, cell.top_m) == pytest.approx((opening.level.deck_m, opening.level.top_m))
