"""The free way around the lines, and the keep-outs in it."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flightd.site.corridor import NEAR_KEEP_OUT_M, Corridor
from flightd.site.site_file import load_site
from flightd.site.ways import BODY_RADIUS_M, KEEP_OUT_CLEARANCE_M, KeepOut
from tests.unit.site.test_rack_depth import two_aisles

SITE = load_site(Path(__file__).parents[3] / "configs" / "site-demo.toml")
A, B = SITE.aisle_nodes(SITE.aisles[0].id)[1:3]
MIDDLE_M = (A.x_m + B.x_m) / 2
BESIDE = KeepOut(MIDDLE_M - 0.3, A.y_m + 0.65, MIDDLE_M + 0.3, A.y_m + 1.3)
"""Beside an open line, within the corridor's half width."""
CORRIDOR = Corridor(replace(SITE, keep_outs=(BESIDE,)), 0.45)
WIDE = Corridor(replace(SITE, keep_outs=(BESIDE,)), 10.0)
"""Nothing but the keep-out ends it."""


def test_beside_a_line_a_keep_out_ends_the_corridor() -> None:
    towards = (MIDDLE_M, A.y_m + 0.25)
    assert Corridor(SITE, 0.45).back(*towards, 0.0, 0.0) is None
    assert CORRIDOR.back(*towards, 0.0, 0.2) == pytest.approx((0.0, -1.0))
    assert CORRIDOR.outside_m(*towards) == pytest.approx(NEAR_KEEP_OUT_M - 0.4)
    assert CORRIDOR.back(MIDDLE_M, A.y_m, 0.0, 0.0) is None, "the line itself is free"
    assert CORRIDOR.outside_m(MIDDLE_M, A.y_m) == 0.0
    assert CORRIDOR.back(*towards, 0.0, -0.5) is None, "who comes back may brake"


def test_it_is_left_while_the_body_is_still_outside_the_keep_out() -> None:
    touching_m = BESIDE.y0_m - BODY_RADIUS_M
    assert CORRIDOR.outside_m(MIDDLE_M, touching_m - 0.1) > 0.0
    assert CORRIDOR.outside_m(MIDDLE_M, BESIDE.y0_m - KEEP_OUT_CLEARANCE_M) == 0.0, "where a line may lie"


@pytest.mark.parametrize("speed_mps", [0.3, 0.8, 1.5])
def test_the_way_in_which_it_comes_to_rest_counts_as_near(speed_mps: float) -> None:
    """Leaning against it only from there on, it stops with the body outside."""
    y_m = BESIDE.y0_m - 4.0
    while CORRIDOR.back(MIDDLE_M, y_m, 0.0, speed_mps) is None:
        y_m += 0.01
    assert BESIDE.y0_m - (y_m + speed_mps**2 / 2.0) > BODY_RADIUS_M
    assert CORRIDOR.back(MIDDLE_M, BESIDE.y0_m - 0.5, speed_mps, 0.0) is None, "who passes by does not come"


def test_of_two_keep_outs_that_counts_for_which_the_way_to_rest_is_due_first() -> None:
    ahead = KeepOut(MIDDLE_M + 0.85, A.y_m - 0.3, MIDDLE_M + 1.2, A.y_m + 0.3)
    beside = KeepOut(MIDDLE_M - 0.3, A.y_m + 0.7, MIDDLE_M + 0.3, A.y_m + 1.3)
    for order in ((ahead, beside), (beside, ahead)):
        corridor = Corridor(replace(SITE, keep_outs=order), 10.0)
        assert corridor.back(MIDDLE_M, A.y_m, 1.0, 0.0) == pytest.approx((-1.0, 0.0))
        assert corridor.back(MIDDLE_M, A.y_m, 0.0, 0.0) is None


@given(st.floats(0.05, 0.8))
def test_a_leg_that_ends_before_a_keep_out_is_not_hindered(speed_mps: float) -> None:
    """It slows down as legs do, by 0.5 m/s2, for a line that ends where one may."""
    to_end_m = speed_mps**2 / (2.0 * 0.5)
    y_m = BESIDE.y0_m - KEEP_OUT_CLEARANCE_M - to_end_m
    assert WIDE.back(MIDDLE_M, y_m, 0.0, speed_mps) is None


def test_in_a_keep_out_the_way_back_is_its_nearest_edge() -> None:
    inside = (MIDDLE_M + 0.25, A.y_m + 0.9)
    assert CORRIDOR.back(*inside, 0.0, 0.0) == pytest.approx((1.0, 0.0))
    assert CORRIDOR.outside_m(*inside) > NEAR_KEEP_OUT_M


def test_a_line_that_a_keep_out_closes_is_no_way_back() -> None:
    across = KeepOut(MIDDLE_M - 0.2, A.y_m - 0.2, MIDDLE_M + 0.2, A.y_m + 0.2)
    closed = Corridor(replace(SITE, keep_outs=(across,)), 0.45)
    near = closed.nearest(MIDDLE_M, A.y_m)
    assert near.distance_m > KEEP_OUT_CLEARANCE_M


@given(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0))
def test_the_way_back_never_leads_deeper_into_a_keep_out(dx_m: float, dy_m: float) -> None:
    x_m, y_m = MIDDLE_M + dx_m, BESIDE.y0_m + dy_m
    before = CORRIDOR.nearest_keep_out(x_m, y_m).distance_m
    back = CORRIDOR.back(x_m, y_m, 0.0, 0.0)
    if back is not None and before < NEAR_KEEP_OUT_M:
        assert math.hypot(*back) == pytest.approx(1.0)
        assert CORRIDOR.nearest_keep_out(x_m + 0.01 * back[0], y_m + 0.01 * back[1]).distance_m > before


def test_between_the_ends_of_racks_the_way_across_is_narrower_than_an_aisle() -> None:
    racks = load_site(Path(__file__).parents[3] / "configs" / "site-racks.toml")
    corridor = Corridor(racks, 0.45)
    a1, b1 = racks.nodes["A1"], racks.nodes["B1"]
    assert a1.x_m == b1.x_m
    (end_m, *_) = sorted(shelf.x0_m - a1.x_m for shelf in racks.shelves if shelf.x0_m > a1.x_m)
    between = (a1.y_m + b1.y_m) / 2
    assert corridor.outside_m(a1.x_m + end_m - 0.36, between) == 0.0
    assert corridor.outside_m(a1.x_m + end_m - 0.3, between) == pytest.approx(0.05)
    assert corridor.back(a1.x_m + end_m - 0.3, between, 0.0, 0.0) == pytest.approx((-1.0, 0.0))
    assert corridor.outside_m(a1.x_m + end_m - 0.3, a1.y_m) == 0.0, "along the aisle it is on the line"
    assert corridor.outside_m(a1.x_m + 1.0, a1.y_m + 0.5) == pytest.approx(0.05)


def test_behind_a_rack_with_one_front_the_way_is_narrower_too() -> None:
    """Its body ends 0.6 m before the line of the next aisle, whose own fronts are further off."""
    site = two_aisles(2.4, only_a=True)
    corridor, behind = Corridor(site, 0.45), site.nodes["B2"]
    assert corridor.outside_m(behind.x_m + 0.4, behind.y_m - 0.44) == pytest.approx(0.19)
    assert corridor.outside_m(behind.x_m + 0.4, behind.y_m - 0.2) == 0.0


def test_the_nearest_line_is_the_nearest_whatever_is_free_beside_it() -> None:
    racks = load_site(Path(__file__).parents[3] / "configs" / "site-racks.toml")
    a1 = racks.nodes["A1"]
    near = Corridor(racks, 0.45).nearest(a1.x_m, a1.y_m + 0.19)
    assert (near.x_m, near.y_m, near.distance_m) == pytest.approx((a1.x_m, a1.y_m + 0.19, 0.0))
