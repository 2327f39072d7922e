"""Detector processes: each takes one picture at a time from shared memory and answers with its lines.

A worker that dies or exceeds its time is killed and replaced; the picture it had counts as lost.  The
pool never raises into its user: a lost picture is simply no answer (None).
"""

from __future__ import annotations

import asyncio
from collections import Counter, OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Protocol, Self, TypeAlias

import cv2

from flightd.core.errors import InputError, TransientError, UnavailableError
from flightd.core.types import Image, LineSet
from flightd.ports import Clock
from flightd.runtime.child import Child
from flightd.runtime.ring import FrameRing, FrameTicket

_MAX_RINGS = 4
_HOPELESS = 8
"""Workers that died in a row without one being ready."""


class Detect(Protocol):
    """What runs in a worker: pixels in, lines out."""

    def detect(self, bgr: Image, seq: int = 0, stamp_ns: int = 0) -> LineSet: ...


class Detectors(Protocol):
    """Pictures in, lines out, somewhere else."""

    @property
    def replaced(self) -> int:
        """Workers that died or hung and were replaced."""
        ...

    async def detect(self, ticket: FrameTicket, with_jpeg: bool = False) -> Detection | None: ...


@dataclass(frozen=True, slots=True)
class Detection:
    """Lines with the clock times of their way: taken by the worker, answered by it."""

    ticket: FrameTicket
    lines: LineSet
    started_ns: int
    finished_ns: int
    jpeg: bytes | None = None


_Answer: TypeAlias = "tuple[LineSet, bytes | None] | str"
"""Lines and the JPEG if one was wanted, or why there are none."""


class _Worker:
    """Inside the process: answers (ticket, with_jpeg)."""

    def __init__(self, make: Callable[[], Detect]) -> None:
        cv2.setNumThreads(1)
        self._detector = make()
        self._rings: OrderedDict[str, FrameRing] = OrderedDict()

    def __call__(self, request: tuple[FrameTicket, bool]) -> _Answer:
        ticket, with_jpeg = request
        try:
            ring = self._ring(ticket)
            ring.check(ticket.slot, ticket.seq)
            pixels = ring.pixels(ticket.slot)
            lines = self._detector.detect(pixels, ticket.seq, ticket.stamp_ns)
            jpeg = cv2.imencode(".jpg", pixels)[1].tobytes() if with_jpeg else None
            ring.check(ticket.slot, ticket.seq)
        except (TransientError, UnavailableError, InputError, ValueError, cv2.error) as err:
            return str(err)
        return lines, jpeg

    def _ring(self, ticket: FrameTicket) -> FrameRing:
        ring = self._rings.get(ticket.ring)
        if ring is None:
            ring = FrameRing.attach(ticket.ring, ticket.slots, ticket.width_px, ticket.height_px)
            self._rings[ticket.ring] = ring
            if len(self._rings) > _MAX_RINGS:
                self._rings.popitem(last=False)[1].close()
        return ring


class DetectorPool:
    """`size` detector processes behind `detect`, replaced when they die.

    `make` builds the detector inside each worker and must be picklable.  `timeout_s` is the time after
    which a worker counts as hung.
    """

    def __init__(self, make: Callable[[], Detect], size: int, timeout_s: float, clock: Clock) -> None:
        self._make = partial(_Worker, make)
        self._size = size
        self._timeout_s = timeout_s
        self._clock = clock
        self._idle: asyncio.LifoQueue[Child] = asyncio.LifoQueue()
        self._workers: set[Child] = set()
        self._open = False
        self._deaths = 0
        self._changed = asyncio.Event()
        self.lost: Counter[str] = Counter()
        self.replaced = 0

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
        """Wait until every worker can take a picture.  UnavailableError when they die one after another."""
        with self._clock.hold():
            while self._idle.qsize() < self._size:
                if self._deaths >= _HOPELESS:
                    raise UnavailableError("detector processes die as they start: is there memory left?")
                self._changed.clear()
                await self._changed.wait()

    async def detect(self, ticket: FrameTicket, with_jpeg: bool = False) -> Detection | None:
        """Lines of one picture (and its JPEG if wanted), or None when it was lost (counted in `lost`)."""
        worker = await self._take()
        started_ns = self._clock.now_ns()
        answer: _Answer
        try:
            async with asyncio.timeout(self._timeout_s):
                answer = await worker.ask((ticket, with_jpeg))
        except TimeoutError:
            answer = "the detector process hung"
            worker.kill()
        except TransientError as err:
            answer = str(err)
        except asyncio.CancelledError:
            worker.kill()  # its answer would be taken for the next picture's
            raise
        if worker.alive:
            self._idle.put_nowait(worker)
        if isinstance(answer, str):
            self.lost[answer.split(":", maxsplit=1)[0]] += 1
            return None
        lines, jpeg = answer
        return Detection(ticket, lines, started_ns, self._clock.now_ns(), jpeg)

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
        self.replaced += 1
        self._deaths += 1
        self._changed.set()
        wait_s = 0.0 if self._deaths <= self._size else min(0.1 * 2.0 ** (self._deaths - self._size), 5.0)
        asyncio.get_running_loop().call_later(wait_s, self._add)
