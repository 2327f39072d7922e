"""Work that waits for a disk, in threads of its own: one that hangs keeps nothing waiting but disk work.

asyncio's own threads (`asyncio.to_thread`) are left to what flies: MAVSDK's calls, starts of child processes,
a camera's memory, the interlock.
"""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import ParamSpec, TypeVar

from flightd.core.errors import TransientError

_P = ParamSpec("_P")
_T = TypeVar("_T")

_THREADS = 8
"""More than there are parts of the daemon that write or look at once: what hangs on one disk keeps nobody
waiting who works on another."""
_MOST = 32


class DiskThreads:
    """At most `threads` that work, and `most` pieces of work that run or wait."""

    def __init__(self, threads: int = _THREADS, most: int = _MOST) -> None:
        self._threads = ThreadPoolExecutor(threads, "disk")
        self._room = threading.Semaphore(most)

    async def run(self, work: Callable[_P, _T], *args: _P.args, **kwargs: _P.kwargs) -> _T:
        """What `work` returns or raises; TransientError where so much is under way that the disk hangs.  Work
        that has begun ends by itself where its caller is cancelled; what has not never begins."""
        if not self._room.acquire(blocking=False):
            raise TransientError("a disk does not answer, and too much waits for it already")
        try:
            begun = self._threads.submit(work, *args, **kwargs)
        except RuntimeError as err:  # there is no room for another thread
            self._room.release()
            raise TransientError(f"no thread for the disk: {err}") from err
        begun.add_done_callback(lambda _: self._room.release())
        return await asyncio.wrap_future(begun)


_ALL = DiskThreads()


async def on_disk(work: Callable[_P, _T], *args: _P.args, **kwargs: _P.kwargs) -> _T:
    """`DiskThreads.run`, in those of this process."""
    return await _ALL.run(work, *args, **kwargs)
