"""Detector processes: frames by shared memory, death and hanging survived, nothing stale believed."""

from __future__ import annotations

import asyncio
import math
import os
import signal
import socket
import threading
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from flightd.app.detection.detector_pool import Detection, DetectorPool
from flightd.app.frame_pool import FramePool, Work
from flightd.app.simulation.lockstep import LockstepDetectors
from flightd.core.errors import TransientError, UnavailableError
from flightd.core.types import (
    FloorFeature,
    Image,
    Junction,
    JunctionKind,
    Line,
    LineSet,
    MarkerSight,
    PadSight,
    PictureCheck,
)
from flightd.runtime.clock import LoopClock
from flightd.runtime.frame_ring import FrameRing, FrameTicket
from tests.rigs.event_loops import real, virtual
from tests.rigs.held_time import held
from tests.rigs.waiting import until


class MeanDetector:
    """Answers the frame's mean as a method name; frame 13 hangs, 14 kills the process."""

    def detect(self, bgr: Image, seq: int = 0, stamp_ns: int = 0) -> LineSet:
        if seq == 13:
            signal.pause()
        if seq == 14:
            os.kill(os.getpid(), signal.SIGKILL)
        if seq == 15:
            raise ValueError("a frame of nothing")
        return LineSet(seq, stamp_ns, bgr.shape[1], bgr.shape[0], (), (), str(int(bgr.mean())))


class FarSighted(MeanDetector):
    """Answers whether the frame was looked at ahead, and its mean then."""

    def look(self, bgr: Image) -> str:
        return f"ahead {int(bgr.mean())}"

    def told(self, look: str, seq: int = 0, stamp_ns: int = 0) -> LineSet:
        return LineSet(seq, stamp_ns, 64, 36, (), (), look)


LARGE_BYTES = 8 << 20


def large_answer(_bgr: Image, _ticket: FrameTicket, _ask: bool) -> bytes:
    return b"x" * LARGE_BYTES


def large_answers(signal_in_first: signal.Signals | None) -> Work[bool, bytes]:
    """Inside the worker: answers of 8 MB; the signal takes this process in the middle of the first."""
    whole = socket.socket.sendall

    def half(link: socket.socket, data: bytes) -> None:
        if signal_in_first is not None and len(data) > LARGE_BYTES:
            whole(link, data[: len(data) // 2])
            os.kill(os.getpid(), signal_in_first)
        whole(link, data)

    socket.socket.sendall = half  # type: ignore[assignment, method-assign]
    return large_answer


def ticket(ring: FrameRing, seq: int, value: int) -> FrameTicket:
    slot = ring.begin(seq)
    ring.pixels(slot)[:] = value
    ring.publish(slot, seq, seq * 1000)
    return FrameTicket(
        ring.name, slot, ring.slots, seq, seq * 1000, seq * 1000, ring.width_px, ring.height_px
    )


def pool_of(size: int, timeout_s: float = 0.3) -> DetectorPool:
    return DetectorPool(partial(MeanDetector), size, timeout_s, LoopClock())


def test_pictures_reach_the_workers_through_shared_memory() -> None:
    async def main() -> list[str]:
        ring = FrameRing.create(4, 64, 36)
        try:
            with pool_of(2) as pool:
                found = await asyncio.gather(*(pool.detect(ticket(ring, i, 10 * i)) for i in range(4)))
                return [d.lines.method for d in found if d is not None]
        finally:
            ring.close()

    assert real(main()) == ["0", "10", "20", "30"]


@pytest.mark.parametrize(("seq", "why"), [(13, "hung"), (14, "died"), (15, "nothing")])
def test_a_worker_that_fails_costs_one_picture_and_is_replaced(seq: int, why: str) -> None:
    async def main() -> tuple[list[Detection | None], DetectorPool]:
        ring = FrameRing.create(4, 64, 36)
        try:
            with pool_of(1) as pool:
                await pool.ready()
                answers = [await pool.detect(ticket(ring, n, 7)) for n in (seq, 20, 21)]
                return answers, pool
        finally:
            ring.close()

    answers, pool = real(main())
    assert answers[0] is None
    assert None not in answers[1:]
    assert pool.lost.total() == 1
    assert why in next(iter(pool.lost))


def test_lost_frames_are_counted_by_a_few_reasons() -> None:
    async def main() -> DetectorPool:
        ring = FrameRing.create(4, 64, 36)
        try:
            with pool_of(1) as pool:
                await pool.ready()
                lost = FrameTicket(ring.name, 1, 4, 1, 0, 0, 64, 36)
                for seq in range(100, 130):
                    assert await pool.detect(replace(lost, seq=seq)) is None
                for seq in range(100, 130):
                    assert await pool.detect(replace(lost, ring=chr(seq))) is None
                return pool
        finally:
            ring.close()

    lost = real(main()).lost
    assert lost["frame N was overwritten before it was read"] == 30
    assert lost.total() == 60
    assert len(lost) <= 21


def test_idle_workers_killed_from_outside_are_replaced() -> None:
    async def main() -> tuple[object, int]:
        ring = FrameRing.create(4, 64, 36)
        try:
            with pool_of(2) as pool:
                await pool.ready()
                for pid in pool.pids:
                    os.kill(pid, signal.SIGKILL)
                await until(lambda: pool.replaced >= 2)
                return await pool.detect(ticket(ring, 1, 5)), len(pool.pids)
        finally:
            ring.close()

    detection, workers = real(main())
    assert detection is not None
    assert workers == 2


def test_a_picture_that_was_overwritten_is_lost_never_mistaken() -> None:
    async def main() -> object:
        ring = FrameRing.create(2, 64, 36)
        try:
            with pool_of(1) as pool:
                old = ticket(ring, 1, 50)
                ticket(ring, 3, 99)
                return await pool.detect(old)
        finally:
            ring.close()

    assert real(main()) is None


def test_the_ring_refuses_foreign_names_and_slots() -> None:
    with pytest.raises(UnavailableError, match="not the name"):
        FrameRing.attach("../etc/passwd", 4, 64, 36)
    with pytest.raises(UnavailableError, match="No such file"):
        FrameRing.attach("flightd-0-00000000", 4, 64, 36)
    ring = FrameRing.create(2, 64, 36)
    try:
        with pytest.raises(TransientError, match="outside"):
            ring.check(9, 1)
        with pytest.raises(UnavailableError, match="smaller"):
            FrameRing.attach(ring.name, 200, 640, 360)
        assert np.all(ring.pixels(0) == 0)
    finally:
        ring.close()


EVERYTHING = LineSet(
    frame_seq=7,
    stamp_ns=(1 << 60) + 1,
    width_px=640,
    height_px=360,
    lines=(Line(-12.5, 0.1, 5.3, -80.0, 0.1 + 0.2, 0.9, 0.01, 1e-17, -3e-4),),
    junctions=(Junction(next(iter(JunctionKind)), 1.0, -2.0, (0.5, math.pi)),),
    method="combined",
    timings_ms={"colour": 0.25},
    pads=(PadSight(1.5, 2.5, 99.0, 0.8),),
    picture=PictureCheck((1 << 63) + 5, 112.4, 9.1),
    markers=(MarkerSight(3, -4.0, 5.0, 17.0),),
    features=(FloorFeature(12, 0.5, -0.25),),
)


class SeesEverything:
    def detect(self, bgr: Image, seq: int = 0, stamp_ns: int = 0) -> LineSet:
        return EVERYTHING


def test_all_that_a_detector_finds_comes_to_the_last_bit() -> None:
    async def main() -> Detection | None:
        ring = FrameRing.create(2, 64, 36)
        try:
            with DetectorPool(partial(SeesEverything), 1, 1.0, LoopClock()) as pool:
                await pool.ready()
                return await pool.detect(ticket(ring, 1, 5))
        finally:
            ring.close()

    found = real(main())
    assert found is not None
    assert repr(found.lines) == repr(EVERYTHING)


def methods(found: list[Detection | None]) -> list[str | None]:
    return [None if detection is None else detection.lines.method for detection in found]


def test_a_frame_is_looked_at_before_it_is_asked_for_and_once() -> None:
    """Also one that is asked for after a later one, and never one of another camera."""

    async def main() -> list[str | None]:
        ring, other = FrameRing.create(4, 64, 36), FrameRing.create(4, 64, 36)
        try:
            with DetectorPool(partial(FarSighted), 1, 1.0, LoopClock()) as pool:
                await pool.ready()
                frames = [ticket(ring, seq, 10 * seq) for seq in (1, 2)]
                for frame in frames:
                    pool.look_ahead(replace(frame, stamp_ns=0))
                asked = [frames[1], ticket(other, 1, 50), frames[0], frames[0]]
                return methods([await pool.detect(frame) for frame in asked])
        finally:
            ring.close()
            other.close()

    assert real(main()) == ["ahead 20", "50", "ahead 10", "10"]


def test_of_frames_looked_at_ahead_and_never_asked_for_the_oldest_are_forgotten() -> None:
    async def main() -> list[str | None]:
        ring = FrameRing.create(16, 64, 36)
        try:
            with DetectorPool(partial(FarSighted), 1, 1.0, LoopClock()) as pool:
                await pool.ready()
                frames = [ticket(ring, 20 + n, n) for n in range(12)]
                for frame in frames:
                    pool.look_ahead(frame)
                return methods([await pool.detect(frame) for frame in (frames[0], frames[-1])])
        finally:
            ring.close()

    assert real(main()) == ["0", "ahead 11"]


def test_a_frame_overwritten_since_it_was_looked_at_ahead_is_lost() -> None:
    async def main() -> Detection | None:
        ring = FrameRing.create(2, 64, 36)
        try:
            with DetectorPool(partial(FarSighted), 1, 1.0, LoopClock()) as pool:
                await pool.ready()
                old = ticket(ring, 1, 50)
                pool.look_ahead(old)
                assert await pool.detect(old) is not None
                pool.look_ahead(old)
                await asyncio.sleep(0.1)
                ticket(ring, 3, 99)
                return await pool.detect(old)
        finally:
            ring.close()

    assert real(main()) is None


def test_in_lockstep_a_detector_that_hangs_costs_one_picture() -> None:
    """Time is held for it, so nothing but the machine's own clock can tell that it hangs."""

    async def main() -> list[bool]:
        ring, clock = FrameRing.create(4, 64, 36), LoopClock()
        try:
            with DetectorPool(partial(MeanDetector), 1, 1.5, clock, held) as pool:
                await pool.ready()
                detectors = LockstepDetectors(pool, clock, 0.045, held)
                found = [await detectors.detect(ticket(ring, seq, 7)) for seq in (1, 13, 20, 21)]
                return [detection is not None for detection in found]
        finally:
            ring.close()

    assert virtual(main(), patience_s=9.0) == [True, False, True, True]


async def turns_until(asked: asyncio.Future[bytes | None], wait_s: float) -> int:
    """How often another task that waits so long has its turn until the answer is there."""
    turns = 0
    while not asked.done():
        turns += 1
        await asyncio.sleep(wait_s)
    return turns


@pytest.mark.parametrize(("number", "why"), [(signal.SIGSTOP, "hung"), (signal.SIGKILL, "died")])
def test_a_worker_stopped_or_killed_in_mid_answer_keeps_nothing_else_waiting(
    number: signal.Signals, why: str
) -> None:
    """Half of 8 MB has come: the control loop goes on, the worker is replaced within its time."""

    async def main() -> tuple[bytes | None, FramePool[bool, bytes], int]:
        ring, make = FrameRing.create(4, 64, 36), partial(large_answers, number)
        try:
            with FramePool(make, 1, 0.5, LoopClock(), "test") as pool:
                await pool.ready()
                asked = asyncio.ensure_future(pool.ask(ticket(ring, 1, 7), True))
                turns = await turns_until(asked, 0.005)
                await pool.ready()
                return await asked, pool, turns
        finally:
            ring.close()

    answer, pool, turns = real(main())
    assert answer is None
    assert why in next(iter(pool.lost))
    assert pool.replaced == 1
    if number is signal.SIGSTOP:
        assert turns > 10, "others had their turn meanwhile"


def test_an_answer_that_waited_for_a_stalled_loop_is_taken_and_its_worker_lives() -> None:
    async def main() -> tuple[bytes | None, FramePool[bool, bytes]]:
        ring, make = FrameRing.create(4, 64, 36), partial(large_answers, None)
        try:
            with FramePool(make, 1, 0.7, LoopClock(), "test") as pool:
                await pool.ready()
                asked = asyncio.ensure_future(pool.ask(ticket(ring, 1, 7), True))
                await asyncio.sleep(0)
                threading.Event().wait(1.0)  # nothing else has its turn meanwhile
                return await asked, pool
        finally:
            ring.close()

    answer, pool = real(main())
    assert answer is not None
    assert pool.replaced == 0


def test_an_answer_of_8_mb_comes_whole_while_others_have_their_turn() -> None:
    async def main() -> tuple[bytes | None, int]:
        ring, make = FrameRing.create(4, 64, 36), partial(large_answers, None)
        try:
            with FramePool(make, 1, 20.0, LoopClock(), "test") as pool:
                await pool.ready()
                asked = asyncio.ensure_future(pool.ask(ticket(ring, 1, 7), True))
                turns = await turns_until(asked, 0.0)
                return await asked, turns
        finally:
            ring.close()

    answer, turns = real(main())
    assert answer is not None
    assert len(answer) == LARGE_BYTES
    assert turns > 100
