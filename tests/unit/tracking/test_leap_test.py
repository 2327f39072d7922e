"""Whether a state that was known is suddenly another one."""

from __future__ import annotations

import random

import numpy as np
import pytest

from flightd.tracking.leap_test import SIDES, LeapTest

LEAP = 2.0
BY_LEAP = LEAP * np.array([[0.25, -0.25], [0.0, 0.0]])
"""What a leap to either side makes of two lines, in sigmas: the first tells the state."""


def known(sigma: float = 0.1) -> LeapTest:
    tested = LeapTest(LEAP)
    for _ in range(200):
        tested.moved(5.0, sigma, 0.03)
    return tested


def contradictions(tested: LeapTest, off: float, frames: int, seed: int) -> list[int]:
    """In which frames a state is contradicted that is off by so much."""
    rng, found = random.Random(seed), []
    for frame in range(frames):
        errors = BY_LEAP[:, 0] * off / LEAP + [rng.gauss(0.0, 1.0), rng.gauss(0.0, 1.0)]
        side = tested.contradicted(BY_LEAP, errors, np.eye(2))
        if side is not None:
            assert SIDES[side] * off > 0.0
            found.append(frame)
            for _ in range(200):
                tested.moved(5.0, 0.1, 0.03)
    return found


@pytest.mark.parametrize("off", [2.0, -2.0, 4.0])
def test_one_that_the_measurements_contradict_is_found_to_either_side(off: float) -> None:
    for seed in range(20):
        tested = known()
        found = contradictions(tested, off, 600, seed)
        assert found
        assert found[0] < 500.0 / abs(off)
        assert tested.leaps == len(found)


@pytest.mark.parametrize("off", [0.0, 0.4, -0.4])
def test_one_that_is_known_as_well_as_that_has_not_leapt(off: float) -> None:
    assert not any(contradictions(known(), off, 3_000, seed) for seed in range(10))


def test_what_was_not_known_does_not_leap() -> None:
    assert not contradictions(known(sigma=1.1), 8.0, 100, 0)


def test_a_side_begins_anew_once_nothing_speaks_for_it() -> None:
    tested = known()
    assert tested.begins == [0, 1]
    for error, begins in ((1.0, [1]), (-1.0, [0]), (0.0, [0, 1])):
        for _ in range(8):
            assert tested.contradicted(BY_LEAP, BY_LEAP[:, 0] * error, np.eye(2)) is None
        assert tested.begins == begins
    assert tested.contradicted(BY_LEAP, BY_LEAP[:, 0], np.eye(2)) is None
    tested.restart(0)
    assert tested.begins == [0, 1]


def test_what_moves_no_further_than_it_was_doubted_has_not_leapt() -> None:
    tested = known(sigma=0.9)
    for frame in range(100):
        tested.moved(5.0 + min(0.1 * frame, 2.5), max(0.9 - 0.01 * frame, 0.1), 0.03)
    assert tested.leaps == 0


def test_what_is_only_just_known_does_not_leap() -> None:
    tested = LeapTest(LEAP)
    for frame in range(100):
        tested.moved(5.0 - min(0.1 * frame, 3.0), 0.1, 0.03)
        assert tested.contradicted(BY_LEAP, BY_LEAP[:, 0] * 4.0, np.eye(2)) is None
    assert tested.leaps == 0


def test_one_that_was_moved_by_a_leap_within_seconds_has_leapt_once() -> None:
    tested = known()
    for frame in range(200):
        tested.moved(5.0 - min(0.1 * frame, 3.0), 0.1, 0.03)
    assert tested.leaps == 1
    for _ in range(2_000):
        tested.moved(2.0, 0.1, 0.03)
    for frame in range(2_000):
        tested.moved(2.0 + 0.005 * frame, 0.1, 0.03)
    assert tested.leaps == 1, "it drifts"
