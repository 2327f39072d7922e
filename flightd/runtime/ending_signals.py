"""SIGINT and SIGTERM end a flight in order, whoever flies it; a simulated one at once, if they come again."""

from __future__ import annotations

import asyncio
import contextlib
import os
import select
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Any, Final

ENDING: Final = (signal.SIGINT, signal.SIGTERM)
_STDERR: Final = 2
_CURSOR: Final = "\x1b[?25h"
"""Shows a terminal's cursor again, which a live view hides."""


def end_on_signals(
    flight: asyncio.Future[Any], came: list[signal.Signals], *, again_at_once: bool = False
) -> None:
    """From now on the first of either signal cancels `flight`, so that everything is closed on the way out;
    all are appended to `came`.  A second one must not cut that short, the vehicle's being handed back least
    of all; only with `again_at_once` it does (`end_at_once_on_signals`), and the first one says so.
    Call it in the running loop."""
    loop = asyncio.get_running_loop()

    def end(number: signal.Signals) -> None:
        came.append(number)
        if len(came) > 1:
            return
        flight.cancel()
        if again_at_once:
            for ending in ENDING:
                loop.remove_signal_handler(ending)
            end_at_once_on_signals()
            _say(f"{number.name}: it ends in order; a second one ends it at once")

    for number in ENDING:
        loop.add_signal_handler(number, end, number)


def end_at_once_on_signals() -> None:
    """From now on either signal ends this process, and all that it started, with 128 and its number: also
    where its loop hangs, or has ended.  Main thread only."""
    for number in ENDING:
        signal.signal(number, _end_at_once)


def _end_at_once(number: int, _: FrameType | None) -> None:
    for pid in _descendants(os.getpid()):
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.kill(pid, signal.SIGKILL)
    _say(f"ended at once by {signal.Signals(number).name}", after=_CURSOR)
    os._exit(128 + number)


def _descendants(ancestor: int) -> set[int]:
    """All processes that it started, and that those started; none where the system has no /proc."""
    children: dict[int, list[int]] = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):  # gone meanwhile
            _, parent = stat.read_text(errors="replace").rpartition(") ")[2].split()[:2]
            children.setdefault(int(parent), []).append(int(stat.parent.name))
    found: set[int] = set()
    latest = [ancestor]
    while latest:
        latest = [child for parent in latest for child in children.get(parent, ()) if child not in found]
        found.update(latest)
    return found


def _say(text: str, after: str = "") -> None:
    """A line on stderr, below what a live view shows there; none where it would have to be waited for."""
    line = f"flightd: {text}\n"
    with contextlib.suppress(OSError, ValueError):
        if os.isatty(_STDERR):
            line = f"\n{line}{after}"
        if select.select([], [_STDERR], [], 0.0)[1]:
            os.write(_STDERR, line.encode())


@contextmanager
def handlers_kept() -> Iterator[None]:
    """Both signals do afterwards what they did before.  Main thread only."""
    before = [(number, signal.getsignal(number)) for number in ENDING]
    try:
        yield
    finally:
        for number, handler in before:
            signal.signal(number, handler)


@contextmanager
def raised_signals(error: Callable[[signal.Signals], Exception]) -> Iterator[None]:
    """Either signal raises what `error` makes of it: between two flights, where no loop takes it.  Main
    thread only."""

    def end(number: int, _: FrameType | None) -> None:
        raise error(signal.Signals(number))

    with handlers_kept():
        for number in ENDING:
            signal.signal(number, end)
        yield
