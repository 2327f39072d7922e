"""SIGINT and SIGTERM end a flight in order, whoever flies it."""

from __future__ import annotations

import asyncio
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any, Final

_ENDING: Final = (signal.SIGINT, signal.SIGTERM)


def end_on_signals(flight: asyncio.Future[Any], came: list[signal.Signals]) -> None:
    """From now on the first of either signal cancels `flight`, so that everything is closed on the way out;
    a second one must not cut that short, the vehicle's being handed back least of all.  All are appended to
    `came`.  Call it in the running loop."""
    loop = asyncio.get_running_loop()

    def end(number: signal.Signals) -> None:
        came.append(number)
        if len(came) == 1:
            flight.cancel()

    for number in _ENDING:
        loop.add_signal_handler(number, end, number)


@contextmanager
def raised_signals(error: Callable[[signal.Signals], Exception]) -> Iterator[None]:
    """Either signal raises what `error` makes of it: between two flights, where no loop takes it.  Main
    thread only."""

    def end(number: int, _: FrameType | None) -> None:
        raise error(signal.Signals(number))

    before = [(number, signal.signal(number, end)) for number in _ENDING]
    try:
        yield
    finally:
        for number, handler in before:
            signal.signal(number, handler)
