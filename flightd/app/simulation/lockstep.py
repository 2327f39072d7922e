"""Detection and reading in lockstep with virtual time: the real processes, a modelled time."""

from __future__ import annotations

import asyncio
from dataclasses import replace

from flightd.app.counting.code_readers import Readers, Reading, Wanted
from flightd.app.detection.detector_pool import Detection, Detectors
from flightd.ports import Clock
from flightd.runtime.clock import Hold
from flightd.runtime.frame_ring import FrameTicket


class LockstepDetectors:
    """Answers `latency_s` of virtual time after it was asked, whenever the process really was done.

    The work goes on in parallel with virtual time; only at the end `hold` makes time stand still for it, if
    need be.
    """

    def __init__(self, inner: Detectors, clock: Clock, latency_s: float, hold: Hold) -> None:
        self._inner = inner
        self._clock = clock
        self._latency_s = latency_s
        self._hold = hold

    @property
    def replaced(self) -> int:
        return self._inner.replaced

    async def detect(self, ticket: FrameTicket, with_jpeg: bool = False) -> Detection | None:
        started_ns = self._clock.now_ns()
        work = asyncio.ensure_future(self._inner.detect(ticket, with_jpeg))
        try:
            await asyncio.sleep(self._latency_s)
            with self._hold():
                detection = await work
        finally:
            work.cancel()
        if detection is None:
            return None
        return replace(detection, started_ns=started_ns, finished_ns=self._clock.now_ns())


class LockstepReaders:
    """The same for the readers of codes."""

    def __init__(self, inner: Readers, latency_s: float, hold: Hold) -> None:
        self._inner = inner
        self._latency_s = latency_s
        self._hold = hold

    @property
    def replaced(self) -> int:
        return self._inner.replaced

    async def read(self, ticket: FrameTicket, wanted: Wanted) -> Reading | None:
        work = asyncio.ensure_future(self._inner.read(ticket, wanted))
        try:
            await asyncio.sleep(self._latency_s)
            with self._hold():
                return await work
        finally:
            work.cancel()
