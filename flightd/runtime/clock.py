"""The time of the running event loop, as everything in the daemon reads it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import TypeAlias

Hold: TypeAlias = Callable[[], AbstractContextManager[None]]
"""Entered while work outside the loop is awaited, for which virtual time has to stand still; whoever awaits
such work is given one.  Real time cannot be held: there it is `contextlib.nullcontext`."""


class LoopClock:
    """`ports.Clock` of an event loop: real, scaled or virtual, whichever loop runs.

    Made inside the loop, or with the loop given.  Nothing else in flightd reads a clock.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop | None = None) -> None:
        self._loop = loop or asyncio.get_running_loop()

    def now_ns(self) -> int:
        """Monotonic nanoseconds; the epoch is arbitrary but the same for all processes of one machine."""
        return round(self._loop.time() * 1e9)
