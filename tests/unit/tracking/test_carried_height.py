"""The height that is carried on by the told climb once no range finder tells it."""

from __future__ import annotations

import math

import pytest

from flightd.tracking.carried_height import CarriedHeight

S = 1_000_000_000


def measured(height_m: float = 1.6, climbed_m: float = 0.4) -> CarriedHeight:
    carried = CarriedHeight()
    carried.measured(S, height_m, climbed_m)
    return carried


def test_what_is_measured_is_told_as_it_is() -> None:
    assert measured().at(S + 50_000_000, 1.58, 0.41) == 1.58
    assert measured().error_m(S + 50_000_000) == 0.0
    assert math.isnan(CarriedHeight().at(S, math.nan, 0.0))


def test_without_it_the_height_follows_the_climb_less_and_less_surely_and_not_for_ever() -> None:
    carried = measured()
    assert carried.at(2 * S, math.nan, 0.1) == pytest.approx(1.3)
    assert 0.0 < carried.error_m(2 * S) < carried.error_m(4 * S) < 0.2
    assert math.isnan(carried.at(6 * S, math.nan, 0.1))


def test_lines_that_agree_put_it_right_and_let_it_last() -> None:
    carried = measured()
    for tenth in range(20, 100):  # the told climb errs by 0.1 m/s
        told_m = 0.4 + 0.01 * (tenth - 20)
        assert carried.at(tenth * S // 10, math.nan, told_m) == pytest.approx(1.6, abs=0.12)
        carried.by_width(tenth * S // 10, 1.6, told_m)


@pytest.mark.parametrize("climbed_m", [math.nan, 0.4])
def test_what_is_not_believed_any_more_tells_nothing(climbed_m: float) -> None:
    carried = measured()
    if math.isfinite(climbed_m):
        carried.forget()
    assert math.isnan(carried.at(2 * S, math.nan, climbed_m))
    carried.by_width(2 * S, 1.6, climbed_m)
    assert math.isnan(carried.at(2 * S, math.nan, climbed_m))


def test_widths_change_nothing_while_the_range_finder_tells() -> None:
    carried = measured()
    carried.by_width(S + 100_000_000, 2.6, 0.4)
    assert carried.at(2 * S, math.nan, 0.4) == pytest.approx(1.6)
