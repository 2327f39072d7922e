"""The time of the running event loop, as everything in the daemon reads it."""

from __future__ import annotations

import asyncio
import contextlib
from contextlib import AbstractContextManager


class LoopClock:
    """`ports.Clock` of an event loop: real, scaled or virtual, whichever loop runs.

    Made inside the loop, or with the loop given.  Nothing else in flightd reads a clock.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop | None = None) -> None:
        self._loop = loop or asyncio.get_running_loop()
        holder = getattr(self._loop, "hold", None)
        self._hold = holder or contextlib.nullcontext

    def now_ns(self) -> int:
        """Monotonic nanoseconds; the epoch is arbitrary but the same for all processes of one machine."""
        return round(self._loop.time() * 1e9)

    def hold(self) -> AbstractContextManager[None]:
        """While entered, work outside the loop is awaited for which *virtual* time must stand still.
        Real time cannot be held: there it does nothing."""
        manager: AbstractContextManager[None] = self._hold()
        return manager
