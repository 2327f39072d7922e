"""Starting child processes that a Ctrl-C at the terminal leaves alone from their first instruction on."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import resource_tracker


@contextmanager
def undisturbed() -> Iterator[None]:
    """While entered, this thread's SIGINT waits, and a process started from it is born with it blocked.

    A terminal sends Ctrl-C to the whole group; a child that is still importing would die of it with a
    traceback of its own.  Ending the child is its parent's task.
    """
    resource_tracker.ensure_running()  # begun later it would let SIGINT through again
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
