"""SIGINT and SIGTERM end a flight in order, whoever flies it."""

from __future__ import annotations

import asyncio
import signal
from typing import Any


def end_on_signals(flight: asyncio.Future[Any], came: list[signal.Signals]) -> None:
    """From now on either signal cancels `flight`, so that everything is closed on the way out, and is
    appended to `came`.  Call it in the running loop."""
    loop = asyncio.get_running_loop()

    def end(number: signal.Signals) -> None:
        came.append(number)
        flight.cancel()

    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, end, number)
