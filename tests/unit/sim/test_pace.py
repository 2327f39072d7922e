"""A simulator that runs faster or slower than was said is noticed, one that started anew is not blamed."""

from __future__ import annotations

import pytest

from flightd.sim.external.external_pace import PaceMonitor


def _paces(factor: float, seconds: float, watch: PaceMonitor, start_ms: int = 1000) -> list[float]:
    told = []
    for step in range(round(seconds * 50)):
        now_ns = step * 20_000_000
        pace = watch.observe(start_ms + round(step * 20 * factor), now_ns)
        if pace is not None:
            told.append(pace)
    return told


@pytest.mark.parametrize("factor", [0.9, 1.0, 1.1])
def test_a_little_jitter_is_nothing(factor: float) -> None:
    assert _paces(factor, 20.0, PaceMonitor()) == []


@pytest.mark.parametrize("factor", [0.3, 0.7, 2.0, 5.0])
def test_a_wrong_speed_is_told_from_the_second_window_on(factor: float) -> None:
    told = _paces(factor, 16.0, PaceMonitor())
    assert told == pytest.approx([factor] * 2, rel=0.01)


def test_a_restart_is_no_wrong_speed() -> None:
    watch = PaceMonitor()
    assert watch.observe(60_000, 0) is None
    assert watch.observe(10, 4_000_000_000) is None
    assert watch.observe(5_010, 9_000_000_000) is None


def test_messages_that_waited_while_we_paused_are_no_wrong_speed() -> None:
    watch = PaceMonitor()
    boot_ms, told = 0, []
    for step in range(2000):
        boot_ms = step * 20
        arrival_ms = max(boot_ms, 7_000) if boot_ms > 1_000 else boot_ms
        told.append(watch.observe(boot_ms, arrival_ms * 1_000_000))
    assert not any(told)
