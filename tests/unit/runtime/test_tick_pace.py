"""When the control tick comes."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence

from flightd.app.tick_pace import TickPace
from flightd.core.tick import CLOSEST_TICKS_S, TICK_S
from flightd.runtime.clock import LoopClock
from tests.rigs.event_loops import virtual

PERIOD_MS, CLOSEST_MS = TICK_S * 1e3, CLOSEST_TICKS_S * 1e3


async def _ticks(
    arrivals_ms: Sequence[float], until_ms: float, stall: tuple[float, float] = (-1.0, 0.0)
) -> list[tuple[float, float]]:
    """When each tick came and how late, in ms, where lines came at these times; the tick at or after
    `stall[0]` takes so many ms."""
    clock, arrived = LoopClock(), asyncio.Event()
    ticks: list[tuple[float, float]] = []
    start_ns = clock.now_ns()
    for at_ms in arrivals_ms:
        asyncio.get_running_loop().call_later(at_ms * 1e-3, arrived.set)

    async def arrival() -> None:
        await arrived.wait()

    pace, (stall_ms, stalls_ms) = TickPace(clock, arrival), stall
    while True:
        now_ns, late_s = await pace.turn()
        at_ms = (now_ns - start_ns) * 1e-6
        if at_ms > until_ms:
            return ticks
        arrived.clear()
        ticks.append((round(at_ms, 3), round(late_s * 1e3, 3)))
        if at_ms >= stall_ms >= 0.0:
            stall_ms = -1.0
            await asyncio.sleep(stalls_ms * 1e-3)


def test_without_lines_ticks_keep_their_period() -> None:
    assert virtual(_ticks([], 101.0)) == [(n * PERIOD_MS, 0.0) for n in range(1, 6)]


def test_lines_do_not_wait_for_the_period() -> None:
    assert virtual(_ticks([27.0], 70.0)) == [(20.0, 0.0), (27.0, 0.0), (47.0, 0.0), (67.0, 0.0)]


def test_lines_that_come_together_cost_one_tick() -> None:
    at_ms = [at for at, _ in virtual(_ticks([27.0, 28.0, 29.0], 50.0))]
    assert at_ms == [20.0, 27.0, 27.0 + CLOSEST_MS]


def test_lines_that_come_just_after_a_tick_wait_a_little() -> None:
    assert [at for at, _ in virtual(_ticks([20.5], 40.0))] == [20.0, 25.0]


def test_after_a_tick_that_took_long_ticks_are_left_out_not_bunched() -> None:
    ticks = virtual(_ticks([], 151.0, stall=(20.0, 90.0)))
    assert ticks == [(20.0, 0.0), (110.0, 70.0), (110.0, 0.0), (130.0, 0.0), (150.0, 0.0)]
