"""A child process that answers one request at a time over a pipe.

Own code: a picture costs 0.2 ms on its way there and back, 0.3 ms in pebble 5.2 and 19 ms in loky 3.7; after
a worker's death the next answer comes in 0.08 s, theirs in 0.11 to 0.19 s and 2.1 s (tools/bench_pools.py,
on two loaded cores).  And here the loop itself waits for the pipe, no thread does.
"""

from __future__ import annotations

import asyncio
import contextlib
import multiprocessing
import signal
from collections.abc import Callable
from multiprocessing.connection import Connection
from multiprocessing.context import ForkServerContext
from typing import Any

from flightd.core.errors import TransientError
from flightd.runtime.undisturbed_start import undisturbed

_PRELOAD = [
    "flightd.app.detection.detector_pool",
    "flightd.vision.line_detector",
    "flightd.vision.shelf.shelf_look",
]
_READY = "ready"


def child_context() -> ForkServerContext:
    """How children start: a clean server process with the vision code loaded forks each in milliseconds,
    without the parent's loop, sockets or locks."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(_PRELOAD)
    return context


def _live(conn: Connection, make: Callable[[], Callable[[Any], Any]]) -> None:
    """The child's life: it ends when its parent closes the pipe."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with contextlib.suppress(EOFError, OSError):
        answer = make()
        conn.send(_READY)
        while True:
            conn.send(answer(conn.recv()))


class Child:
    """One process made of `make`, which is called in the child (it must be picklable) and gives the
    function that answers requests.

    `on_ready` is called when it can take its first request, `on_death` when it is gone, killed or not.
    """

    def __init__(
        self,
        make: Callable[[], Callable[[Any], Any]],
        on_ready: Callable[[Child], None],
        on_death: Callable[[Child], None],
    ) -> None:
        self._loop = asyncio.get_running_loop()
        self._on_ready = on_ready
        self._on_death = on_death
        self._answer: asyncio.Future[Any] | None = None
        context = child_context()
        self._conn, self._theirs = context.Pipe()
        self._process = context.Process(target=_live, args=(self._theirs, make), daemon=True)
        self.alive = True
        # in a thread: where the server that forks children has died too, a new one takes seconds
        self._starting = self._loop.run_in_executor(None, self._start)
        self._starting.add_done_callback(self._started)

    def _start(self) -> None:
        with undisturbed():
            self._process.start()

    @property
    def pid(self) -> int | None:
        return self._process.pid

    async def ask(self, request: Any) -> Any:
        """The child's answer.  Raises TransientError when it dies over it.  One request at a time."""
        if not self.alive:
            raise TransientError("the process died")
        self._answer = self._loop.create_future()
        try:
            self._conn.send(request)
        except OSError:
            self.kill()
        return await self._answer

    def kill(self) -> None:
        """End the child at once; idempotent."""
        if not self.alive:
            return
        self.alive = False
        self._loop.remove_reader(self._conn.fileno())
        self._conn.close()
        if self._process.pid is not None:
            self._process.kill()
        if self._answer is not None and not self._answer.done():
            self._answer.set_exception(TransientError("the process died"))
        self._on_death(self)

    def join(self, timeout_s: float) -> None:
        """Wait for a killed child to be gone."""
        if self._process.pid is not None:
            self._process.join(timeout_s)

    def _started(self, starting: asyncio.Future[None]) -> None:
        self._theirs.close()
        if starting.cancelled() or starting.exception() is not None:
            self.kill()
        elif not self.alive:  # killed while it started
            self._process.kill()
        else:
            self._loop.add_reader(self._conn.fileno(), self._readable)

    def _readable(self) -> None:
        try:
            answer = self._conn.recv()
        except (EOFError, OSError):
            self.kill()
            return
        if answer == _READY:
            self._on_ready(self)
        elif self._answer is not None and not self._answer.done():
            self._answer.set_result(answer)
