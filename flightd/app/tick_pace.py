"""When the control tick comes: as soon as there are fresh lines, else a period after the last one."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from typing import Any

from flightd.core.tick import CLOSEST_TICKS_S, TICK_S
from flightd.ports import Clock
from flightd.runtime.within import Within

_TICK_NS, _CLOSEST_NS = round(TICK_S * 1e9), round(CLOSEST_TICKS_S * 1e9)


class TickPace:
    """Call `turn` before each tick.  `arrival` returns when there is what a tick should not wait for."""

    def __init__(self, clock: Clock, arrival: Callable[[], Coroutine[Any, Any, None]]) -> None:
        self._clock = clock
        self._arrival = arrival
        self._last_ns = clock.now_ns()
        self._due_ns = self._last_ns + _TICK_NS

    async def turn(self) -> tuple[int, float]:
        """Wait for the next tick: the time now, and how late the tick is, seconds; 0 for one that comes
        before its period is over."""
        clock = self._clock
        try:
            async with Within((self._due_ns - clock.now_ns()) * 1e-9):
                await self._arrival()
                await asyncio.sleep((self._last_ns + _CLOSEST_NS - clock.now_ns()) * 1e-9)
        except TimeoutError:
            now_ns = clock.now_ns()
            late_s = (now_ns - self._due_ns) * 1e-9
            # late: leave ticks out, never bunch them
            self._due_ns = max(self._due_ns, now_ns - _TICK_NS) + _TICK_NS
        else:
            now_ns = clock.now_ns()
            late_s = max(now_ns - self._due_ns, 0) * 1e-9
            self._due_ns = now_ns + _TICK_NS
        self._last_ns = now_ns
        return now_ns, late_s
