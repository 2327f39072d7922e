"""Roll and pitch by the gyros: leaps of the told ones, real turns, gaps, and gyros that tell nothing."""

from __future__ import annotations

import math
import random
from collections.abc import Callable

import pytest

from flightd.core.types import Attitude
from flightd.tracking.carried_lean import GAP_S, LEVEL, CarriedLean

PERIOD_S = 0.02
FADE_S = 8.0
LEAP_S, LEAP_RAD = 2.0, math.radians(3.0)


def leaning(at_s: float, swing_rad: float = math.radians(6.0)) -> tuple[float, float]:
    """Roll of a drone that brakes and sets off, by 12 degrees within a quarter of a second, and its rate."""
    fast = 4.0 * math.pi
    return swing_rad * (1.0 - math.cos(fast * at_s)), swing_rad * fast * math.sin(fast * at_s)


def carried(
    error: Callable[[float], float],
    felt: Callable[[float, float], float] = lambda _, rate: rate,
    late: Callable[[float], float] = lambda _: 0.0,
    *,
    until_s: float = 3.0,
    lost: Callable[[float], bool] = lambda _: False,
    period_s: float = PERIOD_S,
    swing_rad: float = math.radians(6.0),
) -> tuple[CarriedLean, list[tuple[float, float]]]:
    """How far the carried roll is from the true one, by time, where the told one errs so, the gyros feel so
    much of a rate, and stamps are so late."""
    lean, found = CarriedLean(FADE_S), []
    for sample in range(round(until_s / period_s) + 1):
        at_s = sample * period_s
        if lost(at_s):
            continue
        true_rad, rate = leaning(at_s, swing_rad)
        stamp_ns, told = round((at_s + late(at_s)) * 1e9), true_rad + error(at_s)
        sample_told = Attitude(stamp_ns, told, 0.0, 0.0, 0.0, felt(at_s, rate), 0.0)
        found.append((at_s, lean.take(sample_told).roll_rad - true_rad))
    return lean, found


def leaps(at_s: float) -> float:
    return LEAP_RAD if at_s >= LEAP_S else 0.0


def test_gyros_carry_the_lean_over_a_leap_of_the_told_one() -> None:
    lean, found = carried(leaps, until_s=LEAP_S + 0.2)
    assert max(abs(error) for _, error in found) < math.radians(0.2)
    lead = lean.lead_at(round((LEAP_S + 0.2) * 1e9))
    assert lead.roll_rad == pytest.approx(-LEAP_RAD, rel=0.1)
    assert lead.pitch_rad == 0.0
    assert lean.leaps == 1


def test_a_leap_fades_as_the_error_that_it_brought_does() -> None:
    lean, found = carried(lambda at_s: leaps(at_s) * math.exp((LEAP_S - at_s) / FADE_S), until_s=20.0)
    assert max(abs(error) for _, error in found) < math.radians(0.2)
    for at_s in (20.0, 29.0):  # nothing is heard any more after 20 s
        left_rad = -LEAP_RAD * math.exp((LEAP_S - at_s) / FADE_S)
        assert lean.lead_at(round(at_s * 1e9)).roll_rad == pytest.approx(left_rad, rel=0.1)


def test_what_leaps_back_leaves_nothing() -> None:
    lean, _ = carried(lambda at_s: leaps(at_s) if at_s < LEAP_S + 0.1 else 0.0, until_s=LEAP_S + 0.2)
    assert abs(lean.lead_at(0).roll_rad) < math.radians(0.1)
    assert lean.leaps == 2


def test_true_turns_and_errors_that_wander_are_no_leaps() -> None:
    lean, _ = carried(lambda at_s: math.radians(4.0) * math.sin(at_s), until_s=10.0)
    assert lean.lead_at(0) == LEVEL


@pytest.mark.parametrize("rate_radps", [math.nan, 0.0, 0.02, 50.0, math.inf])
def test_where_no_rate_is_measured_the_lean_is_the_told_one(rate_radps: float) -> None:
    lean, found = carried(leaps, lambda _at_s, _rate: rate_radps)
    assert lean.lead_at(0) == LEVEL
    assert found[-1][1] == pytest.approx(LEAP_RAD)


def test_over_a_gap_nothing_leaps() -> None:
    """A drone may have leant and come back meanwhile."""
    lean, _ = carried(leaps, lost=lambda at_s: LEAP_S - GAP_S < at_s < LEAP_S)
    assert lean.lead_at(0) == LEVEL


def test_a_sample_that_was_overtaken_changes_nothing() -> None:
    lean, _ = carried(leaps, until_s=LEAP_S + 0.1)
    lead = lean.lead_at(0)
    assert lean.take(Attitude(round(LEAP_S * 1e9), 0.0, 0.0, 0.0)).roll_rad == pytest.approx(lead.roll_rad)
    assert lean.lead_at(0) == lead


def rough(seed: int, rms: float) -> Callable[[float], float]:
    noise = random.Random(seed)
    return lambda _: noise.gauss(0.0, rms)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(
    "wrong",
    [lambda _, rate: -rate, lambda _, rate: math.degrees(rate), lambda _, rate: 0.02 * rate],
    ids=["the other way", "degrees", "dead"],
)
def test_gyros_that_do_not_explain_the_turns_carry_nothing(
    wrong: Callable[[float, float], float], seed: int
) -> None:
    noise = rough(seed, 0.01)
    lean, _ = carried(leaps, lambda at_s, rate: wrong(at_s, rate) + noise(at_s), until_s=20.0)
    assert lean.leaps == 0


@pytest.mark.parametrize("rms_degps", [15.0, 30.0, 50.0])
def test_gyros_that_shake_carry_nothing_astray(rms_degps: float) -> None:
    noise = rough(1, math.radians(rms_degps))
    _, found = carried(lambda _: 0.0, lambda at_s, rate: rate + noise(at_s), until_s=20.0)
    assert max(abs(error) for _, error in found) < math.radians(1.5)


@pytest.mark.parametrize("period_s", [0.01, 0.02, 0.04, 0.05])
@pytest.mark.parametrize("swing_deg", [3.0, 6.0, 12.0])
@pytest.mark.parametrize("dies_s", [10.0, 10.1, 10.2])
def test_a_gyro_that_dies_in_flight_carries_nothing_for_long(
    period_s: float, swing_deg: float, dies_s: float
) -> None:
    _, found = carried(
        lambda _: 0.0,
        lambda at_s, rate: rate if at_s < dies_s else 0.0,
        until_s=20.0,
        period_s=period_s,
        swing_rad=math.radians(swing_deg),
    )
    wrong_s = [at_s for at_s, error in found if abs(error) > math.radians(1.0)]
    assert len(wrong_s) * period_s < 1.0
    assert abs(found[-1][1]) < math.radians(0.5)


@pytest.mark.parametrize("period_s", [0.01, 0.02, 0.05])
def test_a_calm_hover_proves_gyros_too(period_s: float) -> None:
    """Half a degree to either side, with the noise of a cheap gyro."""
    noise = rough(1, math.radians(0.5))
    lean, _ = carried(
        lambda at_s: leaps(at_s - 6.0),
        lambda at_s, rate: rate + noise(at_s),
        until_s=9.0,
        period_s=period_s,
        swing_rad=math.radians(0.5),
    )
    assert lean.leaps == 1
    assert lean.lead_at(0).roll_rad == pytest.approx(-LEAP_RAD, rel=0.2)


def test_an_estimator_that_does_not_settle_is_no_gyros_fault_for_good() -> None:
    """The third leap within a second takes back what was carried; soon after, leaps are believed anew."""

    def error(at_s: float) -> float:
        flips = sum(at_s >= LEAP_S + 0.2 * number for number in range(5)) % 2
        return LEAP_RAD * flips + (2.0 * LEAP_RAD if at_s >= LEAP_S + 4.0 else 0.0)

    lean, found = carried(error, until_s=LEAP_S + 4.2)
    told_s = {round(at_s, 2): wrong for at_s, wrong in found}
    assert told_s[round(LEAP_S + 0.9, 2)] == pytest.approx(LEAP_RAD, rel=0.1), "as it is told"
    assert found[-1][1] == pytest.approx(LEAP_RAD, rel=0.1), "as before the last leap"
    assert lean.leaps == 5


def test_what_is_told_otherwise_over_two_samples_is_as_it_is_told() -> None:
    lean, found = carried(lambda at_s: leaps(at_s) / 2 + leaps(at_s - PERIOD_S) / 2)
    assert found[-1][1] == pytest.approx(LEAP_RAD, rel=0.1)
    assert abs(lean.lead_at(0).roll_rad) < math.radians(0.1)
    assert lean.leaps == 2


def test_what_leaps_far_and_back_leaves_nothing() -> None:
    lean, _ = carried(lambda at_s: 5.0 * leaps(at_s) if at_s < LEAP_S + 0.5 else 0.0)
    assert lean.leaps == 2
    assert abs(lean.lead_at(0).roll_rad) < math.radians(1.0)


def test_what_leaps_back_at_the_floor_or_under_shaking_leaves_nothing() -> None:
    lean = CarriedLean(FADE_S)
    for sample in range(150):
        at_s = sample * PERIOD_S
        roll_rad, rate = leaning(at_s)
        error_rad = LEAP_RAD if 2.0 <= at_s < 2.5 else 0.0
        told = Attitude(round(at_s * 1e9), roll_rad + error_rad, 0.0, 0.0, 0.0, rate, 0.0)
        lean.take(told, leaps=at_s < 2.4)
    assert lean.lead_at(0) == LEVEL


def test_a_lead_does_not_outlive_the_proof_of_the_gyros() -> None:
    """One turn with a dead gyro, then a hover: nothing leaps any more by which it would be found."""

    def calm(at_s: float) -> tuple[float, float]:
        if at_s < 3.0:
            return leaning(at_s)
        turned_rad = math.radians(12.0) * min(max(at_s - 4.0, 0.0) / 0.1, 1.0)
        return turned_rad, 0.0

    lean, wrong_s = CarriedLean(FADE_S), 0.0
    for sample in range(200):
        at_s = sample * 0.05
        roll_rad, rate = calm(at_s)
        noise = 1e-4 * math.sin(1e3 * at_s)
        told = lean.take(Attitude(round(at_s * 1e9), roll_rad + noise, 0.0, 0.0, 0.0, rate, 0.0))
        wrong_s += 0.05 * (abs(told.roll_rad - roll_rad) > math.radians(0.5))
    assert wrong_s < 0.5


def test_what_is_left_of_a_lead_that_has_faded_is_no_leap_when_the_proof_is_lost() -> None:
    died_s = 30.0
    lean, _ = carried(
        lambda at_s: leaps(at_s) * math.exp((LEAP_S - at_s) / FADE_S),
        lambda at_s, rate: rate if at_s < died_s else 0.0,
        until_s=40.0,
        swing_rad=math.radians(2.0),
    )
    assert lean.lead_at(0) == LEVEL
    assert lean.leaps == 1


@pytest.mark.parametrize("late_s", [0.005, 0.01])
def test_stamps_that_are_wrong_make_no_leaps_of_turns(late_s: float) -> None:
    noise = random.Random(1)
    _, found = carried(
        lambda _: 0.0, late=lambda _: min(noise.expovariate(1.0 / late_s), 0.019), until_s=20.0
    )
    assert max(abs(error) for _, error in found) < math.radians(2.0)


def test_of_what_touches_the_floor_nothing_leaps() -> None:
    lean = CarriedLean(FADE_S)
    for sample in range(200):
        at_s = sample * PERIOD_S
        roll_rad, rate = leaning(at_s)
        told = Attitude(round(at_s * 1e9), roll_rad + leaps(at_s), 0.0, 0.0, 0.0, rate, 0.0)
        assert lean.take(told, leaps=False) == told
    assert lean.leaps == 0
