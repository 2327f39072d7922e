"""Starting child processes that a Ctrl-C at the terminal leaves alone from their first instruction on."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import resource_tracker

from flightd.runtime.ending_signals import ENDING


@contextmanager
def undisturbed() -> Iterator[None]:
    """While entered, SIGINT waits (in the main thread SIGTERM, too), and a process started from this thread
    is born with it blocked.

    A terminal sends Ctrl-C to the whole group; a child that is still importing would die of it with a
    traceback of its own.  Ending the child is its parent's task.
    """
    resource_tracker.ensure_running()  # begun later it would let SIGINT through again
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        with _put_off():
            yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def _put_off() -> Iterator[None]:
    """Another thread may take the signal, whose handler then runs in the main one: it runs at the end.  A
    loop's own is told by a descriptor, which is silent meanwhile, for SIGTERM too: it would hear of the
    one twice, and of the other not at all."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    came: set[int] = set()
    handlers = [(number, signal.signal(number, lambda one, _: came.add(one))) for number in ENDING]
    told = signal.set_wakeup_fd(-1)
    try:
        yield
    finally:
        signal.set_wakeup_fd(told, warn_on_full_buffer=False)  # first: rather heard twice than not at all
        for number, handler in handlers:
            signal.signal(number, handler)
        for late in sorted(came):
            signal.raise_signal(late)
