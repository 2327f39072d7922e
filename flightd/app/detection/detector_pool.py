"""The processes that find the lines: frames in, lines out, somewhere else."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import dataclass
from enum import Enum, auto
from functools import partial
from typing import Any, Protocol, TypeAlias, runtime_checkable

import cv2
import msgspec
import numpy as np

from flightd.app.frame_pool import FramePool
from flightd.core.types import Image, LineSet
from flightd.ports import Clock
from flightd.runtime.clock import Hold
from flightd.runtime.frame_ring import FrameTicket

_Answer: TypeAlias = "tuple[bytes, bytes | None]"
"""Packed lines, and the JPEG: a frame's hundred small messages are pickled in ten times as long."""

_MOST_AHEAD = 8
"""Frames looked at ahead and not asked for yet: more than are on their way from any camera."""


def _plain(value: object) -> object:
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"a {type(value).__name__} is not what a detector finds")


_packed = msgspec.msgpack.Encoder(enc_hook=_plain).encode
_unpacked = msgspec.msgpack.Decoder(LineSet).decode


class Detect(Protocol):
    """What finds lines: pixels in, lines out."""

    def detect(self, bgr: Image, seq: int = 0, stamp_ns: int = 0) -> LineSet: ...


@runtime_checkable
class LooksAhead(Protocol):
    """What is able to do the part of it that the pixels alone decide before the frame is asked for:
    `detect` is `told` of what `look` says."""

    def look(self, bgr: Image) -> Any: ...

    def told(self, look: Any, seq: int = 0, stamp_ns: int = 0) -> LineSet: ...


class Wanted(Enum):
    """What a detector process is to make of a frame."""

    AHEAD = auto()
    """Nothing yet, but it will be asked for its lines."""
    LINES = auto()
    LINES_AND_JPEG = auto()


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
        self._ahead: OrderedDict[tuple[str, int], Any] = OrderedDict()

    def __call__(self, bgr: Image, ticket: FrameTicket, wanted: Wanted) -> _Answer | None:
        if wanted is Wanted.AHEAD:
            self._look_ahead(bgr, ticket)
            return None
        jpeg = cv2.imencode(".jpg", bgr)[1].tobytes() if wanted is Wanted.LINES_AND_JPEG else None
        return _packed(self._lines(bgr, ticket)), jpeg

    def _look_ahead(self, bgr: Image, ticket: FrameTicket) -> None:
        if isinstance(self._detector, LooksAhead):
            self._ahead[ticket.ring, ticket.seq] = self._detector.look(bgr)
            if len(self._ahead) > _MOST_AHEAD:
                self._ahead.popitem(last=False)

    def _lines(self, bgr: Image, ticket: FrameTicket) -> LineSet:
        look = self._ahead.pop((ticket.ring, ticket.seq), None)
        if look is not None and isinstance(self._detector, LooksAhead):
            return self._detector.told(look, ticket.seq, ticket.stamp_ns)
        return self._detector.detect(bgr, ticket.seq, ticket.stamp_ns)


class DetectorPool(FramePool[Wanted, "_Answer | None"]):
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
        found = await self.ask(ticket, Wanted.LINES_AND_JPEG if with_jpeg else Wanted.LINES)
        if found is None:
            return None
        lines, jpeg = found
        return Detection(ticket, _unpacked(lines), started_ns, self._clock.now_ns(), jpeg)

    def look_ahead(self, ticket: FrameTicket) -> None:
        """Begin with a frame whose pixels are there before it arrives: in a simulation it is under way for
        longer than it takes to look at.  `detect` finds the same with and without."""
        self.tell(ticket, Wanted.AHEAD)
