"""Frames of real streams have the time of their exposure, whatever the daemon's loop, or the process that
reads them, is busy with.  What was exposed when is drawn in the frames themselves."""

from __future__ import annotations

import asyncio
import contextlib
import os
import signal
import threading
from collections.abc import AsyncIterator
from dataclasses import dataclass, field
from itertools import pairwise

import pytest

from flightd.adapters.camera.capture import CaptureCamera
from flightd.adapters.camera.source import parse_source
from flightd.core.errors import TransientError
from flightd.runtime.clock import LoopClock
from flightd.runtime.frame_ring import FrameRing, FrameTicket
from flightd.runtime.free_ports import free_port
from tests.rigs.event_loops import real
from tests.rigs.video_stream import HEIGHT_PX, WIDTH_PX, read_time_ns, sending
from tests.rigs.waiting import until

pytestmark = pytest.mark.realtime(cores=0.5)

RATE_HZ = 20.0
INTERVAL_NS = round(1e9 / RATE_HZ)
STALL_S = 0.6
"""Twelve frames."""


@dataclass(frozen=True)
class Stream:
    """Where it is opened and sent to, the port left open; `late` is the path's least delay in frames: a
    decoder of H.264 knows that a frame is whole when the next ones come."""

    opened: str
    sent: str
    form: str
    codec: str
    late: int


STREAMS = {
    "h264 in mpeg-ts by udp": Stream(
        "udp://127.0.0.1:{}", "udp://127.0.0.1:{}?pkt_size=1316", "mpegts", "libx264", 2
    ),
    "h264 by rtp": Stream("rtp://127.0.0.1:{}", "rtp://127.0.0.1:{}", "rtp_mpegts", "libx264", 2),
    "mjpeg by rtp": Stream("rtp://127.0.0.1:{}", "rtp://127.0.0.1:{}", "rtp", "mjpeg", 0),
    "mjpeg by tcp": Stream("tcp://127.0.0.1:{}", "tcp://127.0.0.1:{}?listen=1", "nut", "mjpeg", 0),
}


@dataclass
class Delivered:
    """What a camera delivered: each frame's stamp, what is drawn in it, and when it was handed over."""

    clock: LoopClock
    frames: list[tuple[int, int, int]] = field(default_factory=list)
    troubles: list[str] = field(default_factory=list)

    def take(self, ticket: FrameTicket) -> None:
        ring = FrameRing.attach(ticket.ring, ticket.slots, ticket.width_px, ticket.height_px)
        picture = ring.pixels(ticket.slot).copy()
        # frames that waited come in one rush and run round the ring: a reader must look whether this one is
        # still there, as the daemon's do
        with contextlib.suppress(TransientError):
            ring.check(ticket.slot, ticket.seq)
            self.frames.append((ticket.stamp_ns, read_time_ns(picture), self.clock.now_ns()))
        ring.close()


@contextlib.asynccontextmanager
async def watching(name: str) -> AsyncIterator[tuple[CaptureCamera, Delivered]]:
    """A camera of such a stream, delivering."""
    stream, port = STREAMS[name], free_port()
    async with sending(stream.sent.format(port), stream.form, stream.codec, RATE_HZ):
        clock = LoopClock()
        delivered = Delivered(clock)
        source = parse_source(f"stream:{stream.opened.format(port)}", WIDTH_PX, HEIGHT_PX, RATE_HZ)
        camera = CaptureCamera(
            source, stream.late / RATE_HZ, clock, delivered.take, delivered.troubles.append
        )
        running = asyncio.ensure_future(opened(camera))
        try:
            await until(lambda: len(delivered.frames) >= 10)
            yield camera, delivered
        finally:
            running.cancel()
            await asyncio.wait([running])


async def opened(camera: CaptureCamera) -> None:
    """Again and again, as the daemon does it: the sender may not listen yet."""
    while True:
        with contextlib.suppress(TransientError):
            await camera.run()
        await asyncio.sleep(0.1)


def assert_true(delivered: Delivered) -> None:
    stamps = [stamp for stamp, _, _ in delivered.frames]
    assert all(before < after for before, after in pairwise(stamps)), "distinct, and in order"
    errors_ns = [stamp - exposed for stamp, exposed, _ in delivered.frames]
    assert max(map(abs, errors_ns)) < INTERVAL_NS, "true to a frame's interval"
    assert max(at - stamp for stamp, _, at in delivered.frames) < 2e9


@pytest.mark.parametrize("stream", STREAMS)
def test_frames_that_waited_for_a_stalled_loop_keep_the_time_of_their_exposure(stream: str) -> None:
    async def main() -> tuple[Delivered, int]:
        async with watching(stream) as (_, delivered):
            before = len(delivered.frames)
            threading.Event().wait(STALL_S)  # nothing else has its turn meanwhile
            await until(lambda: len(delivered.frames) >= before + 12)
            return delivered, before

    delivered, before = real(main())
    assert_true(delivered)
    waited = [at - stamp for stamp, _, at in delivered.frames[before:]]
    assert max(waited) > 2 * INTERVAL_NS, "what is old is told so"


def test_frames_that_waited_for_the_process_that_reads_them_do_too() -> None:
    async def main() -> Delivered:
        async with watching("mjpeg by tcp") as (camera, delivered):
            before, pid = len(delivered.frames), camera.pid
            assert pid is not None
            os.kill(pid, signal.SIGSTOP)
            await asyncio.sleep(STALL_S)
            os.kill(pid, signal.SIGCONT)
            await until(lambda: len(delivered.frames) >= before + 12)
            return delivered

    assert_true(real(main()))


def test_frames_that_waited_too_long_are_refused() -> None:
    async def main() -> tuple[Delivered, int]:
        async with watching("mjpeg by tcp") as (camera, delivered):
            before, refused = len(delivered.frames), camera.refused
            threading.Event().wait(3 * STALL_S)
            await until(lambda: len(delivered.frames) >= before + 12)
            return delivered, camera.refused - refused

    delivered, refused = real(main())
    assert_true(delivered)
    assert refused > 3, "their memory has been used anew"
    assert any("refused so far" in trouble for trouble in delivered.troubles)
