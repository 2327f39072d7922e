"""Worker processes that are stopped, killed and answer with 8 MB, beside what is measured meanwhile."""

from __future__ import annotations

import asyncio
import enum
import os
import random
import signal
from collections import Counter
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from typing import TypeAlias

from flightd.app.frame_pool import FramePool, Work
from flightd.core.types import Image
from flightd.runtime.clock import LoopClock
from flightd.runtime.frame_ring import FrameRing, FrameTicket

LARGE_BYTES = 8 << 20
_SIZES = {"detector": 2, "reader": 1}
_PERIOD_S = {"detector": 1 / 30, "reader": 0.25}
_TIMEOUT_S = 0.5
_TROUBLE_S = 0.25
_LARGE_EVERY = 8
"""Of the detectors' frames; a reader's answers are all large."""


class Trouble(enum.StrEnum):
    """What goes wrong with detectors and label readers."""

    NONE = "undisturbed"
    STOPPED = "stopped"
    KILLED = "killed"
    LARGE = "8 MB answers"
    ALL = "all of it"

    @property
    def signals(self) -> tuple[signal.Signals, ...]:
        """What a worker gets every quarter of a second: one of these."""
        stop, kill = signal.SIGSTOP, signal.SIGKILL
        return {Trouble.STOPPED: (stop,), Trouble.KILLED: (kill,), Trouble.ALL: (stop, kill)}.get(self, ())

    @property
    def is_large(self) -> bool:
        return self in {Trouble.LARGE, Trouble.ALL}


Workers: TypeAlias = "FramePool[bool, bytes]"


def _answer(_bgr: Image, _ticket: FrameTicket, large: bool) -> bytes:
    return b"x" * (LARGE_BYTES if large else 100)


def _make() -> Work[bool, bytes]:
    return _answer


class BusyWorkers:
    """Detectors and label readers that are asked as often as in flight, in pools as the daemon's."""

    def __init__(self) -> None:
        self._pools: dict[str, Workers] = {
            name: FramePool(_make, size, _TIMEOUT_S, LoopClock(), name) for name, size in _SIZES.items()
        }
        self._ring = FrameRing.create(8, 640, 360)
        self._seq = 0
        self.counts: Counter[str] = Counter()
        """Answers, large ones among them, and what was done to the workers."""

    @asynccontextmanager
    async def open(self) -> AsyncIterator[None]:
        """With their processes."""
        detectors, readers = self._pools.values()
        try:
            with detectors, readers:
                yield
        finally:
            self._ring.close()

    @asynccontextmanager
    async def asked(self, trouble: Trouble) -> AsyncIterator[None]:
        """Asked all the time, with that trouble; whole again before and after it."""
        for pool in self._pools.values():
            await pool.ready()
        before = {name: pool.replaced for name, pool in self._pools.items()}
        async with asyncio.TaskGroup() as tasks:
            running = [tasks.create_task(self._disturb(trouble))]
            running += [tasks.create_task(self._ask(name, trouble)) for name in self._pools]
            try:
                yield
            finally:
                for task in running:
                    task.cancel()
        self._signal(signal.SIGCONT, self._pids())
        replaced = sum(pool.replaced - before[name] for name, pool in self._pools.items())
        self.counts[f"{trouble}: replaced"] += replaced

    async def _ask(self, name: str, trouble: Trouble) -> None:
        pool = self._pools[name]
        async with asyncio.TaskGroup() as asking:
            number = 0
            while True:
                number += 1
                large = trouble.is_large and (name == "reader" or number % _LARGE_EVERY == 0)
                asking.create_task(self._one(pool, trouble, large=large))
                await asyncio.sleep(_PERIOD_S[name])

    async def _one(self, pool: Workers, trouble: Trouble, *, large: bool) -> None:
        found = await pool.ask(self._ticket(), large)
        self.counts[f"{trouble}: {'lost' if found is None else 'answers'}"] += 1
        if found is not None and len(found) == LARGE_BYTES:
            self.counts[f"{trouble}: answers of 8 MB"] += 1

    async def _disturb(self, trouble: Trouble) -> None:
        while trouble.signals:
            await asyncio.sleep(_TROUBLE_S)
            what = random.choice(trouble.signals)
            self._signal(what, random.sample(self._pids(), 1) if self._pids() else ())
            self.counts[f"{trouble}: {what.name}"] += 1

    def _pids(self) -> list[int]:
        return [pid for pool in self._pools.values() for pid in pool.pids]

    @staticmethod
    def _signal(what: signal.Signals, pids: list[int] | tuple[int, ...]) -> None:
        for pid in pids:
            with suppress(ProcessLookupError):
                os.kill(pid, what)

    def _ticket(self) -> FrameTicket:
        self._seq += 1
        ring, seq = self._ring, self._seq
        slot = ring.begin(seq)
        ring.publish(slot, seq, seq)
        return FrameTicket(ring.name, slot, ring.slots, seq, seq, seq, ring.width_px, ring.height_px)
