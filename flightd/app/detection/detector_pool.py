"""The processes that find the lines: frames in, lines out, somewhere else."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import dataclass
from functools import partial
from typing import Protocol, TypeAlias

import cv2

from flightd.app.frame_pool import FramePool
from flightd.core.types import Image, LineSet
from flightd.ports import Clock
from flightd.runtime.clock import Hold
from flightd.runtime.frame_ring import FrameTicket

_Lines: TypeAlias = "tuple[LineSet, bytes | None]"


class Detect(Protocol):
    """What finds lines: pixels in, lines out."""

    def detect(self, bgr: Image, seq: int = 0, stamp_ns: int = 0) -> LineSet: ...


class Detectors(Protocol):
    """Frames in, lines out, somewhere else."""

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


class _DetectLines:
    """Inside a detector process: lines, and the frame's JPEG if it is asked for."""

    def __init__(self, make: Callable[[], Detect]) -> None:
        self._detector = make()

    def __call__(self, bgr: Image, ticket: FrameTicket, ask: bool) -> _Lines:
        lines = self._detector.detect(bgr, ticket.seq, ticket.stamp_ns)
        return lines, cv2.imencode(".jpg", bgr)[1].tobytes() if ask else None


class DetectorPool(FramePool[bool, _Lines]):
    """Processes that find the lines; `make` builds the detector inside each and must be picklable."""

    def __init__(
        self,
        make: Callable[[], Detect],
        size: int,
        timeout_s: float,
        clock: Clock,
        hold: Hold = nullcontext,
    ) -> None:
        super().__init__(partial(_DetectLines, make), size, timeout_s, clock, "detector", hold)

    async def detect(self, ticket: FrameTicket, with_jpeg: bool = False) -> Detection | None:
        """Lines of one frame (and its JPEG if wanted), or None when it was lost."""
        started_ns = self._clock.now_ns()
        found = await self.ask(ticket, with_jpeg)
        if found is None:
            return None
        return Detection(ticket, found[0], started_ns, self._clock.now_ns(), found[1])
