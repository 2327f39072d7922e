"""Which heights of a range finder are believed at once, and which only once the next one agrees."""

from __future__ import annotations

import math

from hypothesis import given
from hypothesis import strategies as st

from flightd.adapters.vehicle.height_leap_gate import HeightLeapGate

_MS = 1_000_000
_HEIGHTS = st.floats(0.05, 8.0, allow_nan=False)


def accepted(*heights_m: float, every_ms: int = 50, climb_mps: float = math.nan) -> list[bool]:
    gate = HeightLeapGate()
    return [gate.accepts(height, height, n * every_ms * _MS, climb_mps) for n, height in enumerate(heights_m)]


def test_one_echo_is_not_believed_and_what_follows_is() -> None:
    assert accepted(1.6, 1.62, 2.9, 1.61, 1.6) == [True, True, False, True, True]


def test_an_echo_after_a_gap_is_a_leap_where_no_climb_is_told_that_makes_it() -> None:
    """Every third reading of 20 Hz was lost: 0.4 m more than 0.1 s before."""
    echo = 1.55, 1.93, 1.56
    assert accepted(*echo, every_ms=100, climb_mps=0.1) == [True, False, True]
    assert all(accepted(*echo, every_ms=100, climb_mps=2.0))
    assert all(accepted(*echo, every_ms=100))
    for climb_mps in (-2.5, 0.0, 2.5):  # also one that is told 1 m/s too slow
        told_mps = climb_mps - math.copysign(1.0, climb_mps)
        assert all(accepted(*(5.0 + climb_mps * 0.2 * n for n in range(5)), every_ms=200, climb_mps=told_mps))


def test_goods_below_are_believed_with_the_second_reading() -> None:
    assert accepted(1.6, 1.1, 1.12, 1.11) == [True, False, True, True]


def test_an_echo_that_is_told_again_before_there_is_a_new_reading_confirms_nothing() -> None:
    """A sonar of 10 Hz whose readings go out at 20 Hz."""
    assert accepted(1.6, 1.6, 2.9, 2.9, 1.61, 1.61) == [True, True, False, False, True, True]
    assert accepted(1.6, 1.6, 0.8, 0.8, 0.8) == [True, True, False, False, True]


def test_a_fast_climb_and_a_take_off_from_the_least_reading_are_no_leaps() -> None:
    assert all(accepted(0.2, 0.2, *(0.25 + 0.1 * n for n in range(20))))


def test_what_was_silent_for_long_is_believed_at_once() -> None:
    gate = HeightLeapGate()
    assert gate.accepts(1.6, 1.6, 0)
    assert gate.accepts(2.9, 2.9, 600 * _MS)


@given(st.lists(_HEIGHTS, min_size=1, max_size=20), _HEIGHTS)
def test_whatever_came_before_a_steady_height_is_believed_soon(before: list[float], height_m: float) -> None:
    steady = [height_m + 0.001 * n for n in range(4)]
    assert accepted(*before, *steady)[-1]


def test_stamps_that_go_back_lose_no_steady_height() -> None:
    gate = HeightLeapGate()
    assert gate.accepts(1.6, 1.6, 100 * _MS)
    assert gate.accepts(1.61, 1.61, 80 * _MS)
    assert gate.accepts(1.6, 1.6, 130 * _MS)
