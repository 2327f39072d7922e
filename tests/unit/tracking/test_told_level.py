"""What is flown level by without a view of the floor."""

from __future__ import annotations

import math

import pytest

from flightd.tracking.carried_lean import Lean
from flightd.tracking.told_level import ToldLevel

S = 1_000_000_000
FADE_S = 8.0
DEG = math.radians(1.0)


def stood() -> ToldLevel:
    level = ToldLevel(FADE_S)
    level.stood(10 * S, (DEG, -DEG))
    return level


def test_what_was_told_while_it_stood_fades() -> None:
    assert stood().at(10 * S) == pytest.approx((DEG, -DEG))
    assert stood().at(18 * S) == pytest.approx((DEG / math.e, -DEG / math.e))
    assert not ToldLevel(FADE_S).is_known
    assert ToldLevel(FADE_S).at(10 * S) == (0.0, 0.0)


def test_soon_after_it_stood_the_new_attitude_errs_by_the_whole_leap() -> None:
    level = stood()
    level.leaps(10 * S, Lean(2.0 * DEG, 0.0))
    assert level.at(10 * S) == pytest.approx((3.0 * DEG, -DEG))


def test_later_either_may_be_right() -> None:
    level = stood()
    level.leaps(90 * S, Lean(2.0 * DEG, 0.0))
    assert level.at(90 * S)[0] == pytest.approx(DEG, rel=0.01)
    level.leaps(91 * S, Lean(-2.0 * DEG, 0.0))
    assert abs(level.at(91 * S)[0]) < 0.2 * DEG


def test_what_leaps_far_and_back_leaves_nothing() -> None:
    level = stood()
    level.leaps(11 * S, Lean(8.0 * DEG, 0.0))
    level.leaps(12 * S, Lean(-8.0 * DEG, 0.0))
    assert abs(level.by_leaps(12 * S).roll_rad) < DEG


def test_no_leap_has_it_lean_by_much_and_standing_again_ends_it() -> None:
    level = stood()
    level.leaps(11 * S, Lean(20.0 * DEG, 0.0))
    assert level.at(11 * S)[0] < 4.0 * DEG
    level.stood(12 * S, None)
    assert level.at(12 * S) == pytest.approx((DEG, -DEG))
