"""Whether a state that was known is suddenly another one."""

from __future__ import annotations

import random

import numpy as np
import pytest

from flightd.tracking.leap_test import LeapTest

LEAP, BY_STATE = 2.0, np.array([0.25, 0.0])


def known(sigma: float = 0.1) -> LeapTest:
    tested = LeapTest(LEAP)
    tested.moved(5.0, sigma, 0.03)
    return tested


def contradictions(tested: LeapTest, off: float, frames: int, seed: int) -> list[int]:
    """In which frames a state is contradicted that is off by so much; the first of two lines tells it by a
    quarter of a sigma."""
    rng, found = random.Random(seed), []
    for frame in range(frames):
        errors = np.array([-BY_STATE[0] * off + rng.gauss(0.0, 1.0), rng.gauss(0.0, 1.0)])
        if tested.contradicted(BY_STATE, errors, np.eye(2)):
            found.append(frame)
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
    assert not contradictions(known(sigma=0.7), 8.0, 100, 0)


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
