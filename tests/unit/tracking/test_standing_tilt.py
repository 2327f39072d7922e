"""The attitude that is told of a drone that stands."""

from __future__ import annotations

import math
import random

import pytest

from flightd.core.types import Attitude
from flightd.tracking.standing_tilt import StandingTilt

ROLL, PITCH = math.radians(1.2), math.radians(-0.8)
BEGAN_NS = 1_000_000_000


def now_ns(at_s: float) -> int:
    return BEGAN_NS + round(at_s * 1e9)


def sample(at_s: float, roll_rad: float = ROLL, pitch_rad: float = PITCH) -> Attitude:
    return Attitude(now_ns(at_s), roll_rad, pitch_rad, 0.3)


def stood(for_s: float, *, noise_rad: float = 0.0) -> StandingTilt:
    standing, rng = StandingTilt(), random.Random(1)
    for number in range(round(50 * for_s) + 1):
        roll, pitch = ROLL + rng.gauss(0.0, noise_rad), PITCH + rng.gauss(0.0, noise_rad)
        standing.take(sample(0.02 * number, roll, pitch))
    return standing


def test_it_is_the_mean_of_what_is_told() -> None:
    tilt = stood(5.0, noise_rad=math.radians(0.1)).at(now_ns(5.0))
    assert tilt == pytest.approx((ROLL, PITCH), abs=math.radians(0.04))


def test_nothing_is_known_before_it_has_stood_for_a_second() -> None:
    assert StandingTilt().at(BEGAN_NS) is None
    assert stood(0.9).at(now_ns(0.9)) is None
    assert stood(1.1).at(now_ns(1.1)) is not None


@pytest.mark.parametrize(
    "moved",
    [
        (ROLL + math.radians(3.0), PITCH),
        (ROLL, PITCH - math.radians(3.0)),
        (math.nan, PITCH),
        (ROLL, math.nan),
    ],
)
def test_who_is_moved_does_not_stand(moved: tuple[float, float]) -> None:
    standing = stood(5.0)
    standing.take(sample(5.02, *moved))
    assert standing.at(now_ns(5.02)) is None
    for number in range(60):
        standing.take(sample(5.04 + 0.02 * number))
    assert standing.at(now_ns(6.3)) == pytest.approx((ROLL, PITCH))


def test_over_a_gap_it_may_have_been_carried() -> None:
    standing = stood(5.0)
    assert standing.at(now_ns(5.9)) is not None
    assert standing.at(now_ns(6.1)) is None
    standing.take(sample(7.0))
    assert standing.at(now_ns(7.0)) is None


def test_a_sample_of_the_past_changes_nothing() -> None:
    standing = stood(5.0)
    standing.take(sample(4.0, 0.5))
    assert standing.at(now_ns(5.0)) == pytest.approx((ROLL, PITCH))
