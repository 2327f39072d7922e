"""Roll and pitch by the gyros: leaps of the told ones, real turns, gaps, and gyros that tell nothing."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest

from flightd.core.types import Attitude
from flightd.tracking.carried_lean import GAP_S, CarriedLean

PERIOD_S = 0.02
FADE_S = 8.0
LEAP_S, LEAP_RAD = 2.0, math.radians(3.0)


def leaning(at_s: float) -> tuple[float, float]:
    """Roll of a drone that brakes and sets off, by 12 degrees within a quarter of a second, and its rate."""
    swing_rad, fast = math.radians(6.0), 4.0 * math.pi
    return swing_rad * (1.0 - math.cos(fast * at_s)), swing_rad * fast * math.sin(fast * at_s)


def carried(
    error: Callable[[float], float],
    felt: Callable[[float, float], float] = lambda _, rate: rate,
    *,
    until_s: float = 3.0,
    lost: Callable[[float], bool] = lambda _: False,
) -> tuple[CarriedLean, list[tuple[float, float]]]:
    """How far the carried roll is from the true one, by time, where the told one errs so."""
    lean, found = CarriedLean(FADE_S), []
    for sample in range(round(until_s / PERIOD_S) + 1):
        at_s = sample * PERIOD_S
        if lost(at_s):
            continue
        true_rad, rate = leaning(at_s)
        told = true_rad + error(at_s)
        rates = {"roll_rate_radps": felt(at_s, rate), "pitch_rate_radps": 0.0}
        found.append(
            (at_s, lean.take(Attitude(round(at_s * 1e9), told, 0.0, 0.0, **rates)).roll_rad - true_rad)
        )
    return lean, found


def leaps(at_s: float) -> float:
    return LEAP_RAD if at_s >= LEAP_S else 0.0


def test_gyros_carry_the_lean_over_a_leap_of_the_told_one() -> None:
    lean, found = carried(leaps, until_s=LEAP_S + 0.2)
    assert max(abs(error) for _, error in found) < math.radians(0.2)
    assert lean.lead.roll_rad == pytest.approx(-LEAP_RAD, rel=0.1)
    assert lean.lead.pitch_rad == 0.0


def test_a_leap_fades_as_the_error_that_it_brought_does() -> None:
    lean, found = carried(lambda at_s: leaps(at_s) * math.exp((LEAP_S - at_s) / FADE_S), until_s=20.0)
    assert max(abs(error) for _, error in found) < math.radians(0.2)
    assert lean.lead.roll_rad == pytest.approx(-LEAP_RAD * math.exp((LEAP_S - 20.0) / FADE_S), rel=0.1)


def test_what_leaps_back_leaves_nothing() -> None:
    lean, _ = carried(lambda at_s: leaps(at_s) if at_s < LEAP_S + 0.1 else 0.0, until_s=LEAP_S + 0.2)
    assert abs(lean.lead.roll_rad) < math.radians(0.1)


def test_true_turns_and_errors_that_wander_are_no_leaps() -> None:
    lean, _ = carried(lambda at_s: math.radians(4.0) * math.sin(at_s), until_s=10.0)
    assert lean.lead == (0.0, 0.0)


@pytest.mark.parametrize("rate_radps", [math.nan, 0.0, 0.02, 50.0, math.inf])
def test_where_no_rate_is_measured_the_lean_is_the_told_one(rate_radps: float) -> None:
    lean, found = carried(leaps, lambda _at_s, _rate: rate_radps)
    assert lean.lead == (0.0, 0.0)
    assert found[-1][1] == pytest.approx(LEAP_RAD)


def test_over_a_gap_nothing_leaps() -> None:
    """A drone may have leant and come back meanwhile."""
    lean, _ = carried(leaps, lost=lambda at_s: LEAP_S - GAP_S < at_s < LEAP_S)
    assert lean.lead == (0.0, 0.0)


def test_a_sample_that_was_overtaken_changes_nothing() -> None:
    lean, _ = carried(leaps, until_s=LEAP_S + 0.1)
    lead = lean.lead
    assert lean.take(Attitude(round(LEAP_S * 1e9), 0.0, 0.0, 0.0)).roll_rad == pytest.approx(lead.roll_rad)
    assert lean.lead == lead
