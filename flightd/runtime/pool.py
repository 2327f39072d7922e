"""Detector processes: each takes one picture at a time from shared memory and answers with its lines.

A worker that dies or exceeds its time is killed and replaced; the picture it had counts as lost.  The
pool never raises into its user: a lost picture is simply no answer (None).
"""

from __future__ import annotations

import asyncio
import contextlib
import multiprocessing
import signal
from collections import Counter, OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.context import BaseContext
from typing import Any, Protocol, Self, TypeAlias

import cv2

from flightd.core.errors import InputError, TransientError, UnavailableError
from flightd.core.types import Image, LineSet
from flightd.ports import Clock
from flightd.runtime.ring import FrameRing, FrameTicket

_PRELOAD = ["flightd.runtime.pool", "flightd.vision.detector"]
_MAX_RINGS = 4


class Detect(Protocol):
    """What runs in a worker: pixels in, lines out."""

    def detect(self, bgr: Image, seq: int = 0, stamp_ns: int = 0) -> LineSet: ...


class Detectors(Protocol):
    """Pictures in, lines out, somewhere else."""

    async def detect(self, ticket: FrameTicket, with_jpeg: bool = False) -> Detection | None: ...


@dataclass(frozen=True, slots=True)
class Detection:
    """Lines with the clock times of their way: taken by the worker, answered by it."""

    ticket: FrameTicket
    lines: LineSet
    started_ns: int
    finished_ns: int
    jpeg: bytes | None = None


def worker_context() -> BaseContext:
    """Start method for children: a clean server process with the vision code loaded forks each worker
    in milliseconds, without the parent's loop, sockets or locks."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(_PRELOAD)
    return context


_Answer: TypeAlias = "tuple[LineSet, bytes | None] | str"
"""Lines and the JPEG if one was wanted, or why there are none."""


class _Rings:
    """The rings that a worker has mapped, oldest dropped first."""

    def __init__(self) -> None:
        self._rings: OrderedDict[str, FrameRing] = OrderedDict()

    def of(self, ticket: FrameTicket) -> FrameRing:
        ring = self._rings.get(ticket.ring)
        if ring is None:
            ring = FrameRing.attach(ticket.ring, ticket.slots, ticket.width_px, ticket.height_px)
            self._rings[ticket.ring] = ring
            if len(self._rings) > _MAX_RINGS:
                self._rings.popitem(last=False)[1].close()
        return ring


def _work(conn: Connection, make: Callable[[], Detect]) -> None:
    """A worker's life: it ends when its parent closes the pipe."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    rings = _Rings()
    detector = make()
    conn.send("ready")
    while True:
        try:
            ticket, with_jpeg = conn.recv()
        except (EOFError, OSError):
            return
        answer: _Answer
        try:
            ring = rings.of(ticket)
            ring.check(ticket.slot, ticket.seq)
            pixels = ring.pixels(ticket.slot)
            lines = detector.detect(pixels, ticket.seq, ticket.stamp_ns)
            answer = lines, cv2.imencode(".jpg", pixels)[1].tobytes() if with_jpeg else None
            ring.check(ticket.slot, ticket.seq)
        except (TransientError, UnavailableError, InputError, ValueError) as err:
            answer = str(err)
        with contextlib.suppress(BrokenPipeError):
            conn.send(answer)


class _Worker:
    """One process and its pipe; `on_ready` is called when it can take its first picture, `on_death`
    when it is gone."""

    def __init__(
        self,
        context: BaseContext,
        make: Callable[[], Detect],
        on_ready: Callable[[_Worker], None],
        on_death: Callable[[_Worker], None],
    ) -> None:
        self._loop = asyncio.get_running_loop()
        self._on_ready = on_ready
        self._on_death = on_death
        self.conn, child = context.Pipe()
        self.process: Any = context.Process(target=_work, args=(child, make), daemon=True)  # type: ignore[attr-defined]
        self.process.start()
        child.close()
        self.alive = True
        self._answer: asyncio.Future[_Answer] | None = None
        self._loop.add_reader(self.conn.fileno(), self._readable)

    def _readable(self) -> None:
        try:
            answer = self.conn.recv()
        except (EOFError, OSError):
            self.kill()
            return
        if answer == "ready":
            self._on_ready(self)
        elif self._answer is not None and not self._answer.done():
            self._answer.set_result(answer)

    async def ask(self, ticket: FrameTicket, with_jpeg: bool) -> _Answer:
        self._answer = self._loop.create_future()
        try:
            self.conn.send((ticket, with_jpeg))
        except OSError:
            self.kill()
        return await self._answer

    def kill(self) -> None:
        if not self.alive:
            return
        self.alive = False
        self._loop.remove_reader(self.conn.fileno())
        self.conn.close()
        self.process.kill()
        if self._answer is not None and not self._answer.done():
            self._answer.set_result("the detector process died")
        self._on_death(self)


class DetectorPool:
    """`size` detector processes behind `detect`; `run` starts, watches and replaces them.

    `make` builds the detector inside each worker and must be picklable.  `timeout_s` is the time after
    which a worker counts as hung.
    """

    def __init__(self, make: Callable[[], Detect], size: int, timeout_s: float, clock: Clock) -> None:
        self._make = make
        self._size = size
        self._timeout_s = timeout_s
        self._clock = clock
        self._context = worker_context()
        self._open = False
        self._idle: asyncio.LifoQueue[_Worker] = asyncio.LifoQueue()
        self._workers: set[_Worker] = set()
        self.lost: Counter[str] = Counter()
        self.replaced = 0

    @property
    def pids(self) -> tuple[int, ...]:
        return tuple(worker.process.pid for worker in self._workers if worker.alive)

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
            worker.process.join(1.0)

    async def ready(self) -> None:
        """Wait for the first worker that can take a picture."""
        with self._clock.hold():
            self._idle.put_nowait(await self._idle.get())

    async def detect(self, ticket: FrameTicket, with_jpeg: bool = False) -> Detection | None:
        """Lines of one picture (and its JPEG if wanted), or None when it was lost (counted in `lost`)."""
        worker = await self._take()
        started_ns = self._clock.now_ns()
        try:
            async with asyncio.timeout(self._timeout_s):
                answer = await worker.ask(ticket, with_jpeg)
        except TimeoutError:
            answer = "the detector process hung"
            worker.kill()
        except asyncio.CancelledError:
            worker.kill()
            raise
        if worker.alive:
            self._idle.put_nowait(worker)
        if isinstance(answer, str):
            self.lost[answer.split(":", maxsplit=1)[0]] += 1
            return None
        lines, jpeg = answer
        return Detection(ticket, lines, started_ns, self._clock.now_ns(), jpeg)

    async def _take(self) -> _Worker:
        """An idle worker that lives (one that died while idle has been replaced already)."""
        while True:
            worker = await self._idle.get()
            if worker.alive:
                return worker

    def _add(self) -> None:
        self._workers.add(_Worker(self._context, self._make, self._idle.put_nowait, self._replace))

    def _replace(self, worker: _Worker) -> None:
        self._workers.discard(worker)
        if self._open:
            self.replaced += 1
            self._add()
