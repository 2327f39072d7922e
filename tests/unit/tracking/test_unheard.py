"""The attitude that is assumed of a silent vehicle: none while it talks, then what is asked of it."""

from __future__ import annotations

import math

import pytest

from flightd.core.types import Attitude, AttitudeSetpoint
from flightd.tracking.attitude_extrapolation import SILENT_NS, AttitudeExtrapolation

TICK_NS = 20_000_000
HEARD = Attitude(1_000_000_000, 0.1, -0.05, 3.1)


def test_nothing_is_assumed_while_it_talks_nor_of_one_of_which_nothing_was_asked() -> None:
    unheard = AttitudeExtrapolation()
    asked = AttitudeSetpoint(0, 0.2)
    assert unheard.step(HEARD.stamp_ns + SILENT_NS, HEARD, asked) is None
    assert unheard.step(HEARD.stamp_ns + 2 * SILENT_NS, HEARD, None) is None
    assert unheard.step(HEARD.stamp_ns, None, asked) is None


def test_silent_it_leans_and_turns_as_asked() -> None:
    unheard = AttitudeExtrapolation()
    now_ns = HEARD.stamp_ns + SILENT_NS + TICK_NS
    first = unheard.step(now_ns, HEARD, AttitudeSetpoint(0, -0.1, 0.02, 0.5))
    assert first is not None
    assert -0.1 < first.roll_rad < HEARD.roll_rad
    for _ in range(50):
        now_ns += TICK_NS
        last = unheard.step(now_ns, HEARD, AttitudeSetpoint(0, -0.1, 0.02, 0.5))
    assert last is not None
    assert (last.roll_rad, last.pitch_rad) == pytest.approx((-0.1, 0.02), abs=1e-3)
    turned = math.remainder(last.yaw_rad - HEARD.yaw_rad, math.tau)
    assert turned == pytest.approx(0.5 * (now_ns - HEARD.stamp_ns) * 1e-9)


def test_what_comes_late_all_the_time_is_where_each_guess_begins() -> None:
    unheard = AttitudeExtrapolation()
    asked = AttitudeSetpoint(0, -0.3)
    for tick in range(100):
        now_ns = 2_000_000_000 + tick * TICK_NS
        late = Attitude(now_ns - SILENT_NS - 10_000_000, 0.1, 0.0, 0.0)
        guess = unheard.step(now_ns, late, asked)
        assert guess is not None
        assert guess.roll_rad > -0.2, "it never runs on by what is asked alone"


def test_heard_again_it_starts_anew_from_what_it_then_says() -> None:
    unheard = AttitudeExtrapolation()
    asked = AttitudeSetpoint(0)
    unheard.step(HEARD.stamp_ns + 2 * SILENT_NS, HEARD, asked)
    later = Attitude(5_000_000_000, 0.3, 0.0, 0.0)
    assert unheard.step(later.stamp_ns, later, asked) is None
    silent = unheard.step(later.stamp_ns + SILENT_NS + 1, later, asked)
    assert silent is not None
    assert 0.0 < silent.roll_rad < 0.3
