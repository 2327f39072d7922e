"""Worker processes: each takes one frame at a time from shared memory and answers what it found in it.

A worker that dies or exceeds its time is killed and replaced; the frame it had counts as lost.  The
pool never raises into its user: a lost frame is simply no answer (None).
"""

from __future__ import annotations

import asyncio
import re
from collections import Counter, OrderedDict
from collections.abc import Callable
from contextlib import nullcontext
from functools import partial
from typing import Any, Generic, Protocol, Self, TypeAlias, TypeVar

import cv2

from flightd.core.errors import InputError, TransientError, UnavailableError
from flightd.core.types import Image
from flightd.ports import Clock
from flightd.runtime.child_process import Child
from flightd.runtime.clock import Hold
from flightd.runtime.frame_ring import FrameRing, FrameTicket

AskT = TypeVar("AskT")
FoundT = TypeVar("FoundT")
AskT_contra = TypeVar("AskT_contra", contravariant=True)
FoundT_co = TypeVar("FoundT_co", covariant=True)

_MAX_RINGS = 4
_STOOD_STILL_S = 0.1
"""A timer that is late by more shows that the loop stood still."""
_NUMBER = re.compile(r"\d+")
_MOST_KINDS, _OTHERS = 20, "others"
_HOPELESS = 8
"""Workers that died in a row without one being ready."""


class Work(Protocol[AskT_contra, FoundT_co]):
    """What runs in a worker: a frame and what is asked of it, the answer out."""

    def __call__(self, bgr: Image, ticket: FrameTicket, ask: AskT_contra, /) -> FoundT_co: ...


_Answer: TypeAlias = "tuple[Any] | str"
"""What was found in the frame, or why nothing was."""


class _Worker:
    """Inside the process: answers (ticket, ask)."""

    def __init__(self, make: Callable[[], Work[Any, Any]]) -> None:
        cv2.setNumThreads(1)
        self._work = make()
        self._rings: OrderedDict[str, FrameRing] = OrderedDict()

    def __call__(self, request: tuple[FrameTicket, Any]) -> _Answer:
        ticket, ask = request
        try:
            ring = self._ring(ticket)
            ring.check(ticket.slot, ticket.seq)
            found = self._work(ring.pixels(ticket.slot), ticket, ask)
            ring.check(ticket.slot, ticket.seq)
        except (TransientError, UnavailableError, InputError, ValueError, cv2.error) as err:
            return str(err)
        return (found,)

    def _ring(self, ticket: FrameTicket) -> FrameRing:
        ring = self._rings.get(ticket.ring)
        if ring is None:
            ring = FrameRing.attach(ticket.ring, ticket.slots, ticket.width_px, ticket.height_px)
            self._rings[ticket.ring] = ring
            if len(self._rings) > _MAX_RINGS:
                self._rings.popitem(last=False)[1].close()
        return ring


class FramePool(Generic[AskT, FoundT]):
    """`size` worker processes behind `ask`, replaced when they die.

    `make` builds the work inside each worker and must be picklable.  `timeout_s` is the time after which a
    worker counts as hung.  `name` says in messages what the workers do; time is held by `hold`
    until they are ready.
    """

    def __init__(
        self,
        make: Callable[[], Work[AskT, FoundT]],
        size: int,
        timeout_s: float,
        clock: Clock,
        name: str,
        hold: Hold = nullcontext,
    ) -> None:
        self._make = partial(_Worker, make)
        self._name = name
        self._size = size
        self._timeout_s = timeout_s
        self._clock = clock
        self._hold = hold
        self._idle: asyncio.LifoQueue[Child] = asyncio.LifoQueue()
        self._workers: set[Child] = set()
        self._open = False
        self._deaths = 0
        self._changed = asyncio.Event()
        self.lost: Counter[str] = Counter()
        self._replaced = 0

    @property
    def replaced(self) -> int:
        """Processes that died or hung and were replaced."""
        return self._replaced

    @property
    def pids(self) -> tuple[int, ...]:
        return tuple(worker.pid for worker in self._workers if worker.pid is not None)

    def __enter__(self) -> Self:
        self._open = True
        for _ in range(self._size):
            self._add()
        return self

    def __exit__(self, *_: object) -> None:
        self._open = False
        workers = list(self._workers)
        for worker in workers:
            worker.kill()
        for worker in workers:
            worker.join(1.0)

    async def ready(self) -> None:
        """Wait until every worker can take a frame.  UnavailableError when they die one after another."""
        with self._hold():
            while self._idle.qsize() < self._size:
                if self._deaths >= _HOPELESS:
                    raise UnavailableError(f"{self._name} processes die as they start: is there memory left?")
                self._changed.clear()
                await self._changed.wait()

    async def ask(self, ticket: FrameTicket, ask: AskT) -> FoundT | None:
        """What is found in one frame, or None when it was lost (counted in `lost`)."""
        worker = await self._take()
        answer: _Answer
        try:
            answer = await self._in_time(worker, (ticket, ask))
        except TransientError as err:
            answer = str(err)
        if worker.alive:
            self._idle.put_nowait(worker)
        if isinstance(answer, str):
            self._lose(answer.split(":", maxsplit=1)[0])
            return None
        found: FoundT = answer[0]
        return found

    def tell(self, ticket: FrameTicket, ask: AskT) -> None:
        """Let the worker that will be asked about a frame have this first, with no answer.  Of several nobody
        knows which that is: then nothing is told."""
        if self._size == 1:
            for worker in tuple(self._workers):  # one that has died is replaced at once
                worker.tell((ticket, ask))

    def _lose(self, why: str) -> None:
        """Count a lost frame by why: many reasons name it, so that each would be one of its own."""
        kind = _NUMBER.sub("N", why)
        self.lost[kind if kind in self.lost or len(self.lost) < _MOST_KINDS else _OTHERS] += 1

    async def _in_time(self, worker: Child, request: tuple[FrameTicket, AskT]) -> _Answer:
        """The worker's answer; TransientError when it died over it, or was killed because it hung.  Where
        this loop stood still, what came meanwhile still has to be read: that is no fault of the worker's."""
        answer, loop = worker.ask(request), asyncio.get_running_loop()
        due_s = loop.time() + self._timeout_s
        try:
            await asyncio.wait([answer], timeout=self._timeout_s)
            if loop.time() - due_s > _STOOD_STILL_S:
                await asyncio.wait([answer], timeout=self._timeout_s)
        except asyncio.CancelledError:
            answer.cancel()
            worker.kill()  # its answer would be taken for the next frame's
            raise
        if not answer.done():
            worker.kill(f"the {self._name} process hung")
        found: _Answer = answer.result()
        return found

    async def _take(self) -> Child:
        """An idle worker that lives (one that died while idle has been replaced already)."""
        while True:
            worker = await self._idle.get()
            if worker.alive:
                return worker

    def _add(self) -> None:
        if self._open:
            self._workers.add(Child(self._make, self._welcome, self._replace))

    def _welcome(self, worker: Child) -> None:
        self._deaths = 0
        self._idle.put_nowait(worker)
        self._changed.set()

    def _replace(self, worker: Child) -> None:
        """At once the first time; workers that die as they start are given more and more time."""
        self._workers.discard(worker)
        if not self._open:
            return
        self._replaced += 1
        self._deaths += 1
        self._changed.set()
        wait_s = 0.0 if self._deaths <= self._size else min(0.1 * 2.0 ** (self._deaths - self._size), 5.0)
        asyncio.get_running_loop().call_later(wait_s, self._add)
