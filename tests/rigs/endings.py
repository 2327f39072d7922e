"""A program with child processes whose orderly end lasts: its loop waits, or it hangs."""

from __future__ import annotations

import asyncio
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from typing import Any

from flightd.runtime.child_process import Child
from flightd.runtime.ending_signals import end_on_signals
from tests.rigs.event_loops import real


def hanging() -> Callable[[Any], Any]:
    """Of a child that never answers."""
    return lambda _: signal.pause()


async def last(how: str) -> None:
    """Say that it is there, and end when nobody waits for it any more."""
    started = asyncio.Event()
    child = Child(hanging, lambda one: started.set(), print)
    beside = subprocess.Popen(["sh", "-c", "trap '' TERM INT; sleep 600 & wait; wait"])  # noqa: ASYNC220
    await started.wait()
    child.ask(None)
    came: list[signal.Signals] = []
    end_on_signals(asyncio.ensure_future(_stubborn(how)), came, again_at_once=True)
    print("all are there", flush=True)
    while not came:  # noqa: ASYNC110 - a signal tells nobody
        await asyncio.sleep(0.01)
    await asyncio.sleep(600.0)
    beside.kill()


async def _stubborn(how: str) -> None:
    try:
        await asyncio.sleep(600.0)
    finally:
        if how == "hangs":
            threading.Event().wait(600.0)  # as for a disk
        await asyncio.sleep(600.0)


if __name__ == "__main__":
    real(last(sys.argv[1]))
