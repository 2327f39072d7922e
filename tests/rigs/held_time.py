"""Time that stands still in tests where it is virtual."""

from __future__ import annotations

import asyncio
from contextlib import AbstractContextManager, nullcontext

from flightd.runtime.event_loops import VirtualLoop


def held() -> AbstractContextManager[None]:
    """A `runtime.clock.Hold` for whichever loop runs the test."""
    loop = asyncio.get_running_loop()
    return loop.hold() if isinstance(loop, VirtualLoop) else nullcontext()
