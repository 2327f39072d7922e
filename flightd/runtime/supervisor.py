"""What is not critical restarts; this is the one place that decides so."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable

from flightd.core.errors import TransientError

_FIRST_WAIT_S = 0.1
_LONGEST_WAIT_S = 5.0


async def restarted(part: Callable[[], Awaitable[None]], failed: Callable[[TransientError], None]) -> None:
    """Run `part` for ever: each TransientError is told to `failed` and followed by a new start, after a
    wait that doubles up to 5 s.  Every other error is the caller's."""
    wait_s = _FIRST_WAIT_S
    loop = asyncio.get_running_loop()
    while True:
        started_s = loop.time()
        try:
            await part()
        except TransientError as err:
            failed(err)
        if loop.time() - started_s > 2 * _LONGEST_WAIT_S:
            wait_s = _FIRST_WAIT_S
        await asyncio.sleep(wait_s)
        wait_s = min(2 * wait_s, _LONGEST_WAIT_S)
