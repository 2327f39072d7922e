"""Waiting for what comes true by itself, never for longer than a bound."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

_LOOK_S = 0.005


async def until(condition: Callable[[], Any], within_s: float = 30.0) -> float:
    """Let others run until the condition holds; the seconds that took, by the loop's clock.

    Fails when it does not hold in time."""
    loop = asyncio.get_running_loop()
    start_s = loop.time()
    while not condition():
        assert loop.time() - start_s < within_s, f"not within {within_s:g} s"
        await asyncio.sleep(_LOOK_S)
    return loop.time() - start_s
