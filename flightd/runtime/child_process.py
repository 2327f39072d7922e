"""Child processes that talk to this one over a channel; one kind answers a request at a time.

Own code: a frame costs 0.2 ms on its way there and back, 0.3 ms in pebble 5.2 and 19 ms in loky 3.7; after
a worker's death the next answer comes in 0.08 s, theirs in 0.11 to 0.19 s and 2.1 s (tools/bench_pools.py,
on two loaded cores).  And here the loop itself waits for the channel, no thread does.
"""

from __future__ import annotations

import asyncio
import contextlib
import multiprocessing
import os
import select
import signal
import socket
import threading
import time
from collections.abc import Callable
from multiprocessing import forkserver
from multiprocessing.context import ForkServerContext
from typing import Any

from flightd.core.errors import TransientError
from flightd.runtime.message_channel import Channel, ChildEnd
from flightd.runtime.undisturbed_start import undisturbed

_PRELOAD = [
    "flightd.app.detection.detector_pool",
    "flightd.vision.line_detector",
    "flightd.vision.shelf.shelf_look",
]
_READY = "ready"
_START_S = 60.0
"""A child that is not ready by then hangs."""
LAST_S = 5.0
"""For what a child still does without its parent: a camera's exposure is given back, a LED put out."""


def child_context() -> ForkServerContext:
    """How children start: a clean server process with the vision code loaded forks each in milliseconds,
    without the parent's loop, sockets or locks."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(_PRELOAD)
    return context


def start_child_server() -> None:
    """Let what children are forked from load the vision code from now on, while this process loads what it
    needs itself: the first child would have to wait for it."""
    child_context()
    with undisturbed():
        forkserver.ensure_running()


class LinkedProcess:
    """A process that runs `target(ChildEnd, *args)`, all of it picklable, until it returns or this end is
    closed.  What it sends goes to `on_message`; `on_end` is called once, when it is gone or was killed, and
    told why."""

    def __init__(
        self,
        target: Callable[..., None],
        args: tuple[Any, ...],
        on_message: Callable[[Any], None],
        on_end: Callable[[str], None],
    ) -> None:
        self._on_message = on_message
        self._on_end = on_end
        self._channel = Channel()
        arguments = (target, self._channel.theirs, args)
        self._process = child_context().Process(target=_live, args=arguments, daemon=True)
        self.alive = True
        # in a thread: where the server that forks children has died too, a new one takes seconds
        starting = asyncio.get_running_loop().run_in_executor(None, self._start)
        starting.add_done_callback(self._started)

    @property
    def pid(self) -> int | None:
        return self._process.pid

    def send(self, message: Any) -> bool:
        """Hand a message over, never waiting.  A process that does not take it is killed: it hangs."""
        if self.alive and not self._channel.send(message):
            self.kill("the process takes no messages")
        return self.alive

    def hang_up(self) -> None:
        """Close this end, `on_end` is not told: a process that listens ends by itself."""
        self.alive = False
        self._channel.close()

    def kill(self, why: str = "the process was killed") -> None:
        """End the process at once; idempotent."""
        told, self.alive = not self.alive, False
        self._channel.close()
        if self._process.pid is not None:
            self._process.kill()
        if not told:
            self._on_end(why)

    def join(self, timeout_s: float) -> None:
        """Wait for a process to be gone that was killed or left alone."""
        if self._process.pid is not None:
            self._process.join(timeout_s)

    def _start(self) -> None:
        with undisturbed():
            self._process.start()

    def _started(self, starting: asyncio.Future[None]) -> None:
        self._channel.theirs.close()
        if starting.cancelled() or starting.exception() is not None:
            self.kill("the process did not start")
        elif not self.alive:  # killed while it started
            self._process.kill()
        else:
            self._channel.listen(self._on_message, self.kill)


def _live(target: Callable[..., None], link: socket.socket, args: tuple[Any, ...]) -> None:
    """The child's life: it ends when its parent closes the channel, or dies, whatever it is at."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_after, args=(link,), name="parent", daemon=True).start()
    with contextlib.suppress(EOFError, OSError):
        target(ChildEnd(link), *args)


def _end_after(link: socket.socket) -> None:
    """In a thread of the child: nobody is left to kill one that hangs after its parent died."""
    parent = select.poll()
    parent.register(link, 0)  # only that its other end is closed
    parent.poll()
    time.sleep(LAST_S)
    os._exit(1)


class Child:
    """One process made of `make`, which is called in the child (it must be picklable) and gives the
    function that answers requests.

    `on_ready` is called when it can take its first request, `on_death` when it is gone, killed or not.  One
    that is not ready within a minute is killed; how long an answer may take is up to who asks.
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
        self._process = LinkedProcess(_answer_requests, (make,), self._received, self._ended)
        self._too_late = self._loop.call_later(_START_S, self.kill)

    @property
    def alive(self) -> bool:
        return self._process.alive

    @property
    def pid(self) -> int | None:
        return self._process.pid

    def ask(self, request: Any) -> asyncio.Future[Any]:
        """The child's answer, to be awaited or cancelled: TransientError when it dies over it.  One request
        at a time."""
        self._answer = answer = self._loop.create_future()
        if self.alive:
            self._process.send((request, True))
        else:
            answer.set_exception(TransientError("the process died"))
        return answer

    def tell(self, request: Any) -> None:
        """Hand over what is answered to nobody; the child comes to it in its turn."""
        self._process.send((request, False))

    def kill(self, why: str = "the process was killed") -> None:
        """End the child at once, which its answer fails with; idempotent."""
        self._process.kill(why)

    def join(self, timeout_s: float) -> None:
        """Wait for a killed child to be gone."""
        self._process.join(timeout_s)

    def _received(self, message: Any) -> None:
        if message == _READY:
            self._too_late.cancel()
            self._on_ready(self)
        elif self._answer is not None and not self._answer.done():
            self._answer.set_result(message)

    def _ended(self, why: str) -> None:
        self._too_late.cancel()
        if self._answer is not None and not self._answer.done():
            self._answer.set_exception(TransientError(why))
        self._on_death(self)


def _answer_requests(parent: ChildEnd, make: Callable[[], Callable[[Any], Any]]) -> None:
    answer = make()
    parent.send(_READY)
    while True:
        request, is_asked = parent.receive()
        answered = answer(request)
        if is_asked:
            parent.send(answered)
