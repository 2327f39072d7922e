"""The heading by the gyros: steel, leaps, gaps, and gyros that tell nothing."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest

from flightd.core.types import Attitude
from flightd.tracking.carried_heading import CarriedHeading

PERIOD_S = 0.02
TURN_RADPS = 0.5


def carried(
    told: Callable[[float], float],
    felt: Callable[[float], float],
    *,
    seconds: float = 4.0,
    watched: Callable[[float], bool] = lambda _: True,
    lost: Callable[[float], bool] = lambda _: False,
) -> tuple[CarriedHeading, float]:
    """The heading carried to the end of a flight whose telemetry tells so, by the time in s."""
    heading, yaw_rad = CarriedHeading(), math.nan
    for sample in range(round(seconds / PERIOD_S) + 1):
        at_s = sample * PERIOD_S
        if lost(at_s):
            continue
        attitude = Attitude(round(at_s * 1e9), 0.0, 0.0, told(at_s), felt(at_s))
        yaw_rad = heading.take(attitude, watched=watched(at_s)).yaw_rad
    return heading, yaw_rad


def noisy(rate_radps: float) -> Callable[[float], float]:
    """A gyro's rate, which is never twice the same."""
    return lambda at_s: rate_radps + 0.001 * math.sin(1e3 * at_s)


def turning(at_s: float) -> float:
    return math.remainder(TURN_RADPS * at_s, math.tau)


@pytest.mark.parametrize("bend_radps", [0.0, 0.08, -0.08])
def test_gyros_carry_the_heading_through_a_field_bent_by_steel(bend_radps: float) -> None:
    heading, yaw_rad = carried(lambda t: turning(t) + bend_radps * t, noisy(TURN_RADPS))
    assert yaw_rad == pytest.approx(turning(4.0), abs=0.01)
    assert heading.lead_rad == pytest.approx(-bend_radps * 4.0, abs=0.01)
    assert heading.leap_rad == 0.0


def test_where_nobody_watches_the_floor_the_heading_is_the_told_one() -> None:
    """Beside a bias of its gyro a drone on its pad would have turned by half a circle within the hour."""
    _, yaw_rad = carried(lambda _: 0.7, noisy(0.01), watched=lambda t: t > 3.0)
    assert yaw_rad == pytest.approx(0.7 + 0.01, abs=0.001)


@pytest.mark.parametrize("rate_radps", [math.nan, 0.0, 0.02, 50.0, math.inf])
def test_a_rate_that_is_none_or_stands_still_or_absurd_is_not_believed(rate_radps: float) -> None:
    heading, yaw_rad = carried(turning, lambda _: rate_radps)
    assert yaw_rad == pytest.approx(turning(4.0), abs=1e-9)
    assert heading.leap_rad == 0.0


def test_a_gap_in_telemetry_is_bridged_by_what_is_told_after_it() -> None:
    _, yaw_rad = carried(
        turning, lambda t: noisy(TURN_RADPS)(t) * (t < 1.0 or t > 1.5), lost=lambda t: 1.0 < t < 1.5
    )
    assert yaw_rad == pytest.approx(turning(4.0), abs=0.03)


@pytest.mark.parametrize("leap_rad", [0.4, -0.4])
def test_a_told_heading_that_leaps_is_not_followed_and_shown_for_a_while(leap_rad: float) -> None:
    def told(at_s: float) -> float:
        return turning(at_s) + leap_rad * (at_s > 1.0)

    heading, yaw_rad = carried(told, noisy(TURN_RADPS), seconds=2.0)
    assert yaw_rad == pytest.approx(turning(2.0), abs=0.01)
    assert heading.leap_rad == pytest.approx(leap_rad, abs=0.02)
    assert heading.leapt_lately
    later, _ = carried(told, noisy(TURN_RADPS), seconds=4.0)
    assert later.leap_rad == pytest.approx(leap_rad, abs=0.02), "it is still not right"
    assert not later.leapt_lately


def test_a_told_heading_that_swings_away_without_a_leap_is_shown_and_one_that_comes_back_is_not() -> None:
    def told(at_s: float, back_s: float) -> float:
        return turning(at_s) + min(max(at_s - 1.0, 0.0), 0.4) - min(max(at_s - back_s, 0.0), 0.4)

    away, yaw_rad = carried(lambda t: told(t, 99.0), noisy(TURN_RADPS))
    assert yaw_rad == pytest.approx(turning(4.0), abs=0.01)
    assert away.leap_rad == pytest.approx(0.4, abs=0.11)
    assert carried(lambda t: told(t, 2.0), noisy(TURN_RADPS))[0].leap_rad == 0.0


def test_a_leap_that_gyros_deny_is_not_followed_without_lines_either() -> None:
    _, yaw_rad = carried(lambda t: 0.4 * (t > 1.0), noisy(0.0), watched=lambda _: False)
    assert yaw_rad == pytest.approx(0.0, abs=0.01)


def test_samples_out_of_order_change_nothing() -> None:
    heading = CarriedHeading()
    heading.take(Attitude(2_000_000, 0.0, 0.0, 0.1, 0.0), watched=True)
    assert heading.take(Attitude(1_000_000, 0.0, 0.0, 0.9, 0.3), watched=True).yaw_rad == 0.1
    assert heading.lead_rad == 0.0
