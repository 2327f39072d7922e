"""What several pictures say together of how full a location is."""

from __future__ import annotations

import pytest

from flightd.core.inventory import CaseGrid, LocationState, PlaceFill
from flightd.mission.scan.fill_votes import FillVotes

READ, EMPTY = LocationState.READ, LocationState.EMPTY


def together(state: LocationState, *shares: float | None) -> PlaceFill | None:
    votes = FillVotes()
    for share in shares:
        votes.add(PlaceFill(share))
    return votes.together(state)


def test_the_share_in_the_middle_holds_where_pictures_agree() -> None:
    assert together(READ, 0.5, 0.52, 0.58, None) == PlaceFill(0.52)


@pytest.mark.parametrize("shares", [(0.3, 0.6), (None, None, 0.5), (0.2, 0.5, 0.8)])
def test_pictures_that_do_not_agree_or_do_not_tell_leave_it_unknown(shares: tuple[float | None, ...]) -> None:
    assert together(READ, *shares) == PlaceFill(None)


def test_the_share_never_contradicts_the_state() -> None:
    assert together(EMPTY, 0.0, 0.04) == PlaceFill(0.0)
    assert together(EMPTY, None, None) == PlaceFill(0.0)
    assert together(EMPTY, 0.4, 0.4) == PlaceFill(None)
    assert together(READ, 0.0, 0.01) == PlaceFill(None)
    assert together(LocationState.OCCLUDED, 0.7, 0.7) == PlaceFill(None)


def test_a_location_of_which_no_picture_shows_the_opening_is_not_asked() -> None:
    votes = FillVotes()
    votes.add(None)
    assert votes.together(EMPTY) is None


@pytest.mark.parametrize(
    ("leans_m", "told_m"),
    [
        ((0.03, 0.034, 0.04), 0.034),
        ((0.03, 0.034, None), 0.032),
        ((0.03, None, None), None),
        ((0.0, 0.03, 0.05), None),
        ((0.0, 0.004, 0.0), 0.0),
    ],
)
def test_a_lean_is_told_where_most_pictures_tell_the_same(
    leans_m: tuple[float | None, ...], told_m: float | None
) -> None:
    votes = FillVotes()
    for lean_m in leans_m:
        votes.add(PlaceFill(0.5, lean_m=lean_m))
    told = votes.together(READ)
    assert told is not None
    assert told.lean_m == told_m


def test_goods_are_seen_where_most_pictures_that_tell_a_share_show_some() -> None:
    votes = FillVotes()
    assert not votes.sees_goods
    for share in (0.0, 0.0, 0.2, None, None):
        votes.add(PlaceFill(share))
    assert not votes.sees_goods
    for share in (0.1, 0.05):
        votes.add(PlaceFill(share))
    assert votes.sees_goods


def test_an_overhang_is_told_where_most_pictures_show_it() -> None:
    votes = FillVotes()
    for overhang_m in (0.05, 0.07, None):
        votes.add(PlaceFill(0.5, overhang_m))
    assert votes.together(READ) == PlaceFill(0.5, 0.06)
    votes.add(PlaceFill(0.5))
    assert votes.together(READ) == PlaceFill(0.5)


def cases(state: LocationState, *grids: CaseGrid | None) -> CaseGrid | None:
    votes = FillVotes()
    for grid in grids:
        votes.add(PlaceFill(0.5, cases=grid))
    fill = votes.together(state)
    return fill.cases if fill else None


def test_cases_are_told_where_several_pictures_do_and_none_tells_others() -> None:
    three, four = CaseGrid(3, 2), CaseGrid(4, 2)
    assert cases(READ, three, None, three) == three
    assert cases(LocationState.UNREADABLE, three, three) == three
    assert cases(READ, three, None, None) is None
    assert cases(READ, three, three, three, four) is None
    assert cases(EMPTY, three, three) is None
    assert cases(LocationState.OCCLUDED, three, three) is None
