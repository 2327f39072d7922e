"""Code reader processes, and the front camera's way through them to the mission."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from contextlib import nullcontext
from typing import Protocol, TypeAlias

from flightd.app.detection.detector_pool import FramePool, Work
from flightd.core.scanning import CodeSet, Place
from flightd.core.types import Image
from flightd.ports import Clock
from flightd.runtime.clock import Hold
from flightd.runtime.frame_ring import FrameTicket
from flightd.runtime.latest_slot import Latest
from flightd.vision.shelf.shelf_look import read_shelf

Reading: TypeAlias = tuple[CodeSet, dict[str, bytes]]
"""What was read, and the evidence pictures by name (JPEG)."""

_MOST_EVIDENCE = 1000
_MOST_SETS = 50


class Readers(Protocol):
    """Frames in, codes and places out, somewhere else."""

    async def read(self, ticket: FrameTicket, places: tuple[Place, ...]) -> Reading | None: ...


def _read(bgr: Image, ticket: FrameTicket, places: tuple[Place, ...]) -> Reading:
    return read_shelf(bgr, ticket.seq, ticket.stamp_ns, places, ticket.exposure)


def _shelf_reader() -> Work[tuple[Place, ...], Reading]:
    return _read


class ReaderPool(FramePool[tuple[Place, ...], Reading]):
    """Processes that read codes; one that dies or hangs is replaced, its frame counts as lost."""

    def __init__(self, size: int, timeout_s: float, clock: Clock, hold: Hold = nullcontext) -> None:
        super().__init__(_shelf_reader, size, timeout_s, clock, "code reader", hold)

    async def read(self, ticket: FrameTicket, places: tuple[Place, ...]) -> Reading | None:
        """Codes and places of one frame, or None when it was lost."""
        return await self.ask(ticket, places)


class ShelfWatch:
    """Has the front camera's newest frame read while the mission wants one; all others are passed over
    unread.  `places` says what a frame exposed at a time is wanted for."""

    def __init__(self, readers: Readers, places: Callable[[int], tuple[Place, ...]]) -> None:
        self._readers = readers
        self.places = places
        self._sets: list[CodeSet] = []
        self._evidence: OrderedDict[str, bytes] = OrderedDict()
        self.frames: Latest[FrameTicket] = Latest()
        self.read = 0
        self.lost = 0

    async def run(self) -> None:
        """Read one frame after the other; as many of these may run as there are readers."""
        while True:
            ticket = await self.frames.get()
            places = self.places(ticket.stamp_ns)
            if not places:
                continue
            reading = await self._readers.read(ticket, places)
            if reading is None or len(self._sets) >= _MOST_SETS:
                self.lost += 1
                continue
            codes, pictures = reading
            self.read += 1
            self._sets.append(codes)
            self._evidence.update(pictures)
            while len(self._evidence) > _MOST_EVIDENCE:
                self._evidence.popitem(last=False)

    def take(self) -> tuple[CodeSet, ...]:
        """What was read since the last call, in the order of the frames."""
        sets, self._sets = sorted(self._sets, key=lambda codes: codes.stamp_ns), []
        return tuple(sets)

    def evidence(self, name: str) -> bytes:
        """The evidence picture of that name; empty when it is not remembered."""
        return self._evidence.get(name, b"")
