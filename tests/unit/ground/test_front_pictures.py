"""The front camera's pictures for the ground: only when asked for, beside the count, never instead of it."""

from __future__ import annotations

import asyncio

import cv2
import numpy as np

from flightd.app.absent_parts import NoGround
from flightd.app.counting.code_readers import Reading, ShelfWatch, Wanted, read_frame
from flightd.core.preview import CameraName, Preview
from flightd.core.scanning import CodeSet, Occupancy, Place, PlaceLook
from flightd.runtime.frame_ring import FrameTicket
from tests.rigs.event_loops import virtual

QUAD = ((-100.0, -80.0), (100.0, -80.0), (100.0, 80.0), (-100.0, 80.0))
PLACE = Place("A1L-01", QUAD, 1.0, QUAD)
FRAME = np.full((720, 1280, 3), 90, np.uint8)


class Asking(NoGround):
    """People who ask for pictures of the front camera, or do not."""

    def __init__(self, *, asks: bool) -> None:
        self.asks = asks
        self.shown: list[Preview] = []

    def picture_due(self, stamp_ns: int, camera: CameraName = CameraName.DOWN) -> bool:
        return self.asks and camera is CameraName.FRONT

    def picture(self, preview: Preview) -> None:
        self.shown.append(preview)


class Here:
    """Reads in this process what the reader processes read."""

    def __init__(self) -> None:
        self.wanted: list[Wanted] = []

    async def read(self, ticket: FrameTicket, wanted: Wanted) -> Reading | None:
        self.wanted.append(wanted)
        return read_frame(FRAME, ticket, wanted)


def watched(*, asks: bool, places: tuple[Place, ...]) -> tuple[ShelfWatch, Here, Asking]:
    """After one frame."""
    readers, ground = Here(), Asking(asks=asks)

    async def look() -> ShelfWatch:
        watch = ShelfWatch(readers, lambda _: places)
        watch.ground = ground
        running = asyncio.ensure_future(watch.run())
        watch.frames.put(FrameTicket("ring", 0, 4, 7, 10**9, 10**9, 1280, 720))
        await asyncio.sleep(1.0)
        running.cancel()
        await asyncio.wait([running])
        return watch

    return virtual(look()), readers, ground


def test_nobody_asks_and_nothing_is_scanned_so_the_frame_is_passed_over() -> None:
    _, readers, ground = watched(asks=False, places=())
    assert (readers.wanted, ground.shown) == ([], [])


def test_a_frame_that_is_only_shown_counts_for_nothing() -> None:
    watch, readers, ground = watched(asks=True, places=())
    assert readers.wanted == [Wanted((), shown=True)]
    assert (watch.take(), watch.read) == ((), 0)
    (preview,) = ground.shown
    assert (preview.camera, preview.seq, preview.stamp_ns, preview.areas) == (CameraName.FRONT, 7, 10**9, ())
    shown = cv2.imdecode(np.frombuffer(preview.jpeg, np.uint8), cv2.IMREAD_COLOR)
    assert shown is not None
    assert shown.shape == (540, 960, 3), "as wide as a screen's window"


def test_a_frame_that_is_scanned_and_shown_is_both() -> None:
    watch, _, ground = watched(asks=True, places=(PLACE,))
    (codes,) = watch.take()
    assert [look.location for look in codes.places] == ["A1L-01"]
    (area,) = ground.shown[0].areas
    assert (area.kind, area.text.partition(":")[0]) == ("place", "A1L-01")


def test_a_frame_that_is_only_scanned_is_made_no_picture_of() -> None:
    watch, readers, ground = watched(asks=False, places=(PLACE,))
    assert readers.wanted == [Wanted((PLACE,), shown=False)]
    assert (len(watch.take()), ground.shown) == (1, [])


class Named:
    """Answers each frame with one place, whose picture is named after the frame."""

    async def read(self, ticket: FrameTicket, wanted: Wanted) -> Reading | None:
        name = f"picture {ticket.seq}"
        look = PlaceLook(wanted.places[0].location, (), 1.0, Occupancy.GOODS, name)
        return Reading(CodeSet(ticket.seq, ticket.stamp_ns, 1280, 720, (), (look,)), {name: name.encode()})


def test_the_best_picture_of_a_place_is_kept_for_as_long_as_it_may_be_asked_for() -> None:
    """However long its place is looked at: 30 frames a second with eight places each are 1,000 in 4 s."""

    async def look() -> ShelfWatch:
        watch = ShelfWatch(Named(), lambda _: (PLACE,))
        watch.wanted_evidence = lambda: {"picture 7"}
        running = asyncio.ensure_future(watch.run())
        for seq in range(2000):
            watch.frames.put(FrameTicket("ring", 0, 4, seq, seq, seq, 1280, 720))
            await asyncio.sleep(0.03)
            if seq % 3 == 0:
                watch.take()
        running.cancel()
        await asyncio.wait([running])
        return watch

    watch = virtual(look())
    assert (watch.read, watch.lost) == (2000, 0)
    assert watch.evidence("picture 7") == b"picture 7"
    assert watch.evidence("picture 1998"), "read, and not taken yet"
    assert not watch.evidence("picture 8"), "nobody asks for it any more"
