"""Code reader processes, and the front camera's way through them to the mission."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from contextlib import nullcontext
from dataclasses import dataclass
from typing import Protocol

import cv2

from flightd.app.absent_parts import NO_GROUND
from flightd.app.frame_pool import FramePool, Work
from flightd.core.preview import CameraName, Preview, found_areas
from flightd.core.scanning import CodeSet, Place
from flightd.core.types import Image
from flightd.ports import Clock, Ground
from flightd.runtime.clock import Hold
from flightd.runtime.frame_ring import FrameTicket
from flightd.runtime.latest_slot import Latest
from flightd.runtime.niceness import give_way
from flightd.vision.shelf.shelf_look import read_shelf


@dataclass(frozen=True, slots=True)
class Wanted:
    """What a frame is wanted for: the places to look at (none: nothing is read), and whether the ground is
    to see it."""

    places: tuple[Place, ...]
    shown: bool = False


@dataclass(frozen=True, slots=True)
class Reading:
    """What was read (None where nothing was asked for), the evidence pictures by name, and the frame for
    the ground where that wants it; all pictures are JPEG."""

    codes: CodeSet | None
    evidence: dict[str, bytes]
    shown: bytes = b""


_MUCH_EVIDENCE = 500
"""Pictures of 50 KB at most; with more, those that nobody will ask for are forgotten."""
_MOST_SETS = 50
_SHOWN_PX, _SHOWN_QUALITY = 960, 80
"""Width and quality of a picture for people."""
_NICE = 5
"""Readers yield to the control loop and the detectors: a frame that is read late costs a stop at worst."""


class Readers(Protocol):
    """Frames in, codes and places out, somewhere else; `replaced` of them died or hung."""

    @property
    def replaced(self) -> int: ...

    async def read(self, ticket: FrameTicket, wanted: Wanted) -> Reading | None: ...


def read_frame(bgr: Image, ticket: FrameTicket, wanted: Wanted) -> Reading:
    """What a reader process makes of a frame, (H, W, 3) BGR."""
    shown = _shown(bgr) if wanted.shown else b""
    if not wanted.places:
        return Reading(None, {}, shown)
    how = ticket.exposure, ticket.gain
    codes, evidence = read_shelf(bgr, ticket.seq, ticket.stamp_ns, wanted.places, *how)
    return Reading(codes, evidence, shown)


def _shown(bgr: Image) -> bytes:
    """The frame as people look at it: no wider than a screen's window."""
    height, width = bgr.shape[:2]
    if width > _SHOWN_PX:
        size = _SHOWN_PX, round(height * _SHOWN_PX / width)
        small = cv2.resize(bgr, size, interpolation=cv2.INTER_AREA)
    else:
        small = bgr
    return cv2.imencode(".jpg", small, (cv2.IMWRITE_JPEG_QUALITY, _SHOWN_QUALITY))[1].tobytes()


def _shelf_reader() -> Work[Wanted, Reading]:
    give_way(_NICE)
    return read_frame


class ReaderPool(FramePool[Wanted, Reading]):
    """Processes that read codes; one that dies or hangs is replaced, its frame counts as lost."""

    def __init__(self, size: int, timeout_s: float, clock: Clock, hold: Hold = nullcontext) -> None:
        super().__init__(_shelf_reader, size, timeout_s, clock, "code reader", hold)

    async def read(self, ticket: FrameTicket, wanted: Wanted) -> Reading | None:
        """Codes and places of one frame, or None when it was lost."""
        return await self.ask(ticket, wanted)


class ShelfWatch:
    """Has the front camera's newest frame read while the mission wants one, and made a picture of when
    `ground` asks for one; all others are passed over.  `places` says what a frame exposed at a time is wanted
    for."""

    def __init__(self, readers: Readers, places: Callable[[int], tuple[Place, ...]]) -> None:
        self._readers = readers
        self.places = places
        self.ground: Ground = NO_GROUND
        self._sets: list[CodeSet] = []
        self._evidence: dict[str, bytes] = {}
        self.wanted_evidence: Callable[[], Collection[str]] = tuple
        """Which of the pictures that were taken are still wanted."""
        self.frames: Latest[FrameTicket] = Latest()
        self.read = 0
        self.lost = 0

    async def run(self) -> None:
        """Read one frame after the other; as many of these may run as there are readers."""
        while True:
            ticket = await self.frames.get()
            places = self.places(ticket.stamp_ns)
            shown = self.ground.picture_due(ticket.stamp_ns, CameraName.FRONT)
            if not places and not shown:
                continue
            reading = await self._readers.read(ticket, Wanted(places, shown))
            if reading is None or len(self._sets) >= _MOST_SETS:
                self.lost += 1
                continue
            self._show(ticket, reading)
            if reading.codes is not None:
                self._keep(reading.codes, reading.evidence)

    def _show(self, ticket: FrameTicket, reading: Reading) -> None:
        """Hand the ground the picture that it asked for."""
        if reading.shown:
            areas = () if reading.codes is None else found_areas(reading.codes)
            self.ground.picture(
                Preview(CameraName.FRONT, ticket.seq, ticket.stamp_ns, reading.shown, areas=areas)
            )

    def _keep(self, codes: CodeSet, evidence: Mapping[str, bytes]) -> None:
        """What was read, for the mission, and its evidence for the store."""
        self.read += 1
        self._sets.append(codes)
        self._evidence.update(evidence)
        if len(self._evidence) > _MUCH_EVIDENCE:
            new = (place.evidence for waiting in self._sets for place in waiting.places)
            wanted = {*self.wanted_evidence(), *new}
            self._evidence = {name: jpeg for name, jpeg in self._evidence.items() if name in wanted}

    def take(self) -> tuple[CodeSet, ...]:
        """What was read since the last call, in the order of the frames."""
        sets, self._sets = sorted(self._sets, key=lambda codes: codes.stamp_ns), []
        return tuple(sets)

    def evidence(self, name: str) -> bytes:
        """The evidence picture of that name; empty when it is not remembered."""
        return self._evidence.get(name, b"")
