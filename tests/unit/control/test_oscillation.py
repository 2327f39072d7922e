"""A loop that swings by itself is found and slowed down; gusts and guidance are not."""

from __future__ import annotations

import math
import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flightd.control.oscillation import OscillationMonitor

TICK_NS = 20_000_000


def swung(monitor: OscillationMonitor, off_mps: list[float], start_ns: int = 0) -> float | None:
    """When it was found first, s, given velocities off along x, one a tick."""
    for tick, off in enumerate(off_mps):
        now_ns = start_ns + tick * TICK_NS
        monitor.step(now_ns, off, 0.0)
        if monitor.swings:
            return now_ns * 1e-9
    return None


def swing(period_s: float, growth_per_s: float, seconds: float, first_mps: float = 0.45) -> list[float]:
    ticks = range(round(seconds * 1e9 / TICK_NS))
    return [
        first_mps * math.exp(growth_per_s * (t := tick * TICK_NS * 1e-9)) * math.sin(math.tau * t / period_s)
        for tick in ticks
    ]


@pytest.mark.parametrize("period_s", [0.5, 1.0, 1.3])
def test_a_limit_cycle_is_found_within_two_seconds(period_s: float) -> None:
    assert (swung(OscillationMonitor(), swing(period_s, 0.05, 5.0)) or math.inf) <= 2.0


def test_one_of_eight_centimetres_is_found_by_its_fourth_half_swing() -> None:
    period_s = 1.36
    found_s = swung(OscillationMonitor(), swing(period_s, 0.0, 5.0, 0.08 * math.tau / period_s))
    assert (found_s or math.inf) <= 2.0 * period_s


def test_as_slow_half_swings_that_keep_no_time_are_none() -> None:
    uneven = [
        0.38 * sign * math.sin(math.pi * tick / ticks)
        for sign, ticks in ((1, 30), (-1, 45), (1, 30), (-1, 45), (1, 30))
        for tick in range(ticks)
    ]
    even = [0.38 * sign * math.sin(math.pi * tick / 33) for sign in (1, -1, 1, -1, 1) for tick in range(33)]
    assert swung(OscillationMonitor(), even) is not None
    assert swung(OscillationMonitor(), uneven) is None


def test_one_that_grows_is_found_by_its_second_half_swing() -> None:
    assert (swung(OscillationMonitor(), swing(2.0, 0.7, 5.0, 0.4)) or math.inf) <= 2.0


def test_how_wild_it_is_is_judged_by_the_axis_that_swings() -> None:
    monitor = OscillationMonitor()
    for tick in range(50):
        monitor.step(tick * TICK_NS, 0.95 * math.sin(math.pi * tick / 50), 0.0)
    for tick, off_mps in enumerate(swing(1.0, 0.0, 3.0), start=400):
        if not monitor.swings:
            monitor.step(tick * TICK_NS, 0.0, off_mps)
    assert monitor.ease == 0.6


def test_what_was_hardly_held_any_more_is_held_again_once_it_is_calm() -> None:
    monitor = OscillationMonitor()
    now_ns, eases = 0, []
    for wild_s, calm_s in ((6.0, 30.0), (6.0, 30.0)):
        ticks = round(wild_s * 1e9 / TICK_NS), round(calm_s * 1e9 / TICK_NS)
        for off_mps in [*swing(1.0, 0.0, wild_s, 1.2), *[0.0] * ticks[1]]:
            monitor.step(now_ns, off_mps, 0.0)
            now_ns += TICK_NS
            eases.append(monitor.ease)
    assert min(eases) == 0.12
    assert eases[-1] == 0.35


def test_one_that_dies_away_is_none() -> None:
    assert swung(OscillationMonitor(), swing(1.0, -0.6, 6.0, 1.0)) is None


@pytest.mark.parametrize(
    ("found", "none"),
    [
        pytest.param((2.0, 1.0, 0.42), (2.0, 1.0, 0.40), id="how fast"),
        pytest.param((1.0, 1.0, 0.34), (1.0, 1.0, 0.30), id="how fast where it is steep"),
        pytest.param((1.4, 1.0, 0.38), (1.6, 1.0, 0.38), id="how steep"),
        pytest.param((1.0, 0.83, 1.5), (1.0, 0.77, 1.5), id="how little it dies away"),
        pytest.param((4.8, 1.0, 0.45), (5.2, 1.0, 0.45), id="no slower"),
    ],
)
def test_just_above_each_bound_it_is_found_and_just_below_it_is_none(
    found: tuple[float, float, float], none: tuple[float, float, float]
) -> None:
    """Period, s, share of a half swing in the one before, and first speed, m/s, of which smoothing takes a
    fifteenth at one a second."""
    for (period_s, share, first_mps), expected in ((found, True), (none, False)):
        off_mps = swing(period_s, math.log(share) / (0.5 * period_s), 12.0, first_mps)
        assert (swung(OscillationMonitor(), off_mps) is not None) is expected


def test_two_half_swings_tell_that_it_grows_by_half_and_three_that_it_grows_by_less() -> None:
    by_half, by_less = (swing(1.0, math.log(share) / 0.5, 3.0, 0.4) for share in (1.6, 1.2))
    assert (swung(OscillationMonitor(), by_half) or math.inf) < 1.0
    assert 1.0 < (swung(OscillationMonitor(), by_less) or math.inf) < 1.5


def test_gusts_are_none() -> None:
    """First-order noise of the strength and the correlation of what gusts make of the velocity."""
    draw, monitor, off, found = random.Random(4), OscillationMonitor(), 0.0, 0
    for tick in range(50 * 300):
        off += 0.02 / 0.4 * -off + 0.12 * math.sqrt(2.0 * 0.02 / 0.4) * draw.gauss(0.0, 1.0)
        monitor.step(tick * TICK_NS, off, 0.0)
        found += monitor.swings
    assert not found


def test_each_time_the_loop_is_slowed_down_but_never_below_the_least() -> None:
    monitor = OscillationMonitor()
    eases = {1.0}
    for again in range(6):
        swung(monitor, swing(1.0, 0.0, 4.0), start_ns=again * 10_000_000_000)
        eases.add(round(monitor.ease, 3))
        for tick in range(200, 400):
            monitor.step(again * 10_000_000_000 + tick * TICK_NS, 0.0, 0.0)
    assert sorted(eases, reverse=True) == [1.0, 0.6, 0.36, 0.35]


def calm(monitor: OscillationMonitor, from_s: float, seconds: float) -> None:
    for tick in range(round(seconds * 1e9 / TICK_NS)):
        monitor.step(round(from_s * 1e9) + tick * TICK_NS, 0.0, 0.0)


def test_after_a_calm_while_it_is_tried_faster_again_but_only_once() -> None:
    monitor = OscillationMonitor()
    swung(monitor, swing(1.0, 0.0, 4.0))
    calm(monitor, 3.0, 12.0)
    assert monitor.ease == 1.0
    assert not monitor.swings
    swung(monitor, swing(1.0, 0.0, 4.0), start_ns=16_000_000_000)
    calm(monitor, 20.0, 30.0)
    assert monitor.ease == 0.6


def test_what_moves_while_nothing_is_steered_counts_for_nothing() -> None:
    monitor = OscillationMonitor()
    off = swing(1.0, 0.0, 4.0)
    for tick, value in enumerate(off):
        if tick % 30 == 0:
            monitor.rest()
        monitor.step(tick * TICK_NS, value, 0.0)
    assert monitor.ease == 1.0


@given(st.lists(st.floats(allow_nan=True, allow_infinity=True), max_size=80))
def test_no_velocity_upsets_it(values: list[float]) -> None:
    monitor = OscillationMonitor()
    for tick, value in enumerate(values):
        monitor.step(tick * TICK_NS, value, -value)
    assert 0.35 <= monitor.ease <= 1.0


def test_leaps_of_the_estimate_are_no_swings() -> None:
    monitor = OscillationMonitor()
    for tick in range(500):
        leap = {0: 0.5, 1: -0.7, 2: 0.6}.get(tick % 50, 0.0)
        monitor.step(tick * TICK_NS, leap, 0.0)
        assert not monitor.swings


def test_it_swings_until_it_has_come_to_rest() -> None:
    monitor = OscillationMonitor()
    off = swing(1.6, 0.0, 12.0, 0.6)
    shown = []
    for tick, value in enumerate(off):
        monitor.step(tick * TICK_NS, value, 0.0)
        shown.append(monitor.swings)
    assert all(shown[shown.index(True) :])
    for tick in range(600, 700):
        monitor.step(tick * TICK_NS, 0.1, 0.0)
    assert not monitor.swings
