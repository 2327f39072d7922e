"""The drone's live video: connect, cut into frames, decode, keep the newest picture.

Delay is the enemy: what waits to be decoded is thrown away up to the newest IDR, of a batch only the
last picture is converted, and a stream that stands still for a second is opened anew.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

from flightd.adapters.vehicle.ardrone.clock_counters import WrappingCounter
from flightd.adapters.vehicle.ardrone.pave import CODEC_H264, Control, FrameType, PaveFrame, PaveParser
from flightd.core.extras import missing_extra
from flightd.core.types import Image
from flightd.ports import Clock
from flightd.runtime.clock import Hold
from flightd.runtime.within import Within
from flightd.tracking.device_clock import DeviceClock

_log = logging.getLogger(__name__)

SILENCE_S = 1.0
RETRY_S = 0.5
MAX_BACKLOG = 60
_CHUNK_BYTES = 64 * 1024
_COUNTER_WRAP_MS = 1 << 32


@dataclass(frozen=True, slots=True)
class DecodedFrame:
    """One decoded picture: (H, W, 3) uint8 BGR; `stamp_ns` mid-exposure by the encoder's own clock less
    the least delay, `arrival_ns` when its last byte was here."""

    number: int
    stamp_ns: int
    arrival_ns: int
    bgr: Image


class Backlog:
    """Frames waiting for the decoder.

    Nothing counts until the first IDR; an IDR makes everything before it superfluous; a gap in the
    numbers means that the drone dropped frames, and what leans on them is unusable until the next IDR.
    """

    def __init__(self) -> None:
        self._frames: list[tuple[PaveFrame, int]] = []
        self._number: int | None = None
        self.dropped = 0

    def add(self, frame: PaveFrame, arrival_ns: int) -> None:
        """Take one frame as it arrived."""
        header = frame.header
        if header.control != Control.DATA or header.video_codec != CODEC_H264 or not frame.payload:
            return
        if header.frame_type == FrameType.IDR:
            self.dropped += len(self._frames)
            self._frames.clear()
        elif self._number is None or header.frame_number - self._number not in (0, 1):
            self.reset()
            self.dropped += 1
            return
        self._number = header.frame_number
        self._frames.append((frame, arrival_ns))
        if len(self._frames) > MAX_BACKLOG:
            self.reset()

    def take(self) -> list[tuple[PaveFrame, int]]:
        """All that waits, in order."""
        frames, self._frames = self._frames, []
        return frames

    def reset(self) -> None:
        """Wait for the next IDR."""
        self.dropped += len(self._frames)
        self._frames.clear()
        self._number = None


class Decoder:
    """H.264 to BGR by PyAV; used by one worker thread at a time."""

    def __init__(self) -> None:
        try:
            import av  # noqa: PLC0415 - an optional extra
        except ImportError as error:
            raise missing_extra("ardrone", "the AR.Drone's video") from error
        self._av: Any = av
        self._context: Any = None
        self.restart()

    def restart(self) -> None:
        """Forget all reference pictures."""
        self._context = self._av.CodecContext.create("h264", "r")
        self._context.thread_count = 1
        self._context.options = {"flags": "low_delay"}

    def newest(self, payloads: list[bytes]) -> Image | None:
        """Decode all, return the last picture; None when none came out.  A broken stream restarts the
        decoder and raises `ValueError`."""
        last: Any = None
        try:
            for payload in payloads:
                for picture in self._context.decode(self._av.Packet(payload)):
                    last = picture
        except self._av.FFmpegError as error:
            self.restart()
            raise ValueError(f"undecodable video: {error}") from error
        if last is None:
            return None
        bgr: Image = last.to_ndarray(format="bgr24")
        bgr.flags.writeable = False
        return bgr


class VideoStream:
    """Hands every picture, the newest when several wait, to `show`; runs until cancelled.  `latency_s` is
    the least delay from mid-exposure to arrival; time is held by `hold` while a picture is decoded.

    Counts: `pictures` shown, `dropped` frames never decoded, `broken` batches, frames `out_of_order` by the
    encoder's clock, `connections` made.
    """

    def __init__(
        self,
        address: tuple[str, int],
        latency_s: float,
        clock: Clock,
        show: Callable[[DecodedFrame], None],
        hold: Hold = contextlib.nullcontext,
    ) -> None:
        self._address = address
        self._clock = clock
        self._show = show
        self._hold = hold
        self._backlog = Backlog()
        self._arrived = asyncio.Event()
        self._decoder = Decoder()
        self._device = DeviceClock(round(latency_s * 1e9))
        self._counter = WrappingCounter(_COUNTER_WRAP_MS)
        self.pictures = 0
        self.broken = 0
        self.out_of_order = 0
        self.connections = 0

    @property
    def dropped(self) -> int:
        return self._backlog.dropped

    async def run(self) -> None:
        """Connect, and reconnect for ever."""
        with ThreadPoolExecutor(1, "ardrone video") as worker:
            async with asyncio.TaskGroup() as tasks:
                tasks.create_task(self._receive(), name="ardrone video receiver")
                tasks.create_task(self._decode(worker), name="ardrone video decoder")

    async def _receive(self) -> None:
        while True:
            try:
                await self._connection()
            except (OSError, TimeoutError) as error:
                _log.info("video of the drone interrupted (%s): connecting again", error or "silence")
            self._backlog.reset()
            await asyncio.sleep(RETRY_S)

    async def _connection(self) -> None:
        """One connection, until it ends or falls silent."""
        async with Within(SILENCE_S):
            reader, writer = await asyncio.open_connection(*self._address)
        self.connections += 1
        parser = PaveParser()
        try:
            while True:
                async with Within(SILENCE_S):
                    chunk = await reader.read(_CHUNK_BYTES)
                if not chunk:
                    return
                arrival_ns = self._clock.now_ns()
                for frame in parser.feed(chunk):
                    self._backlog.add(frame, arrival_ns)
                    self._arrived.set()
        finally:
            writer.close()
            with contextlib.suppress(OSError):
                await writer.wait_closed()

    async def _decode(self, worker: ThreadPoolExecutor) -> None:
        loop = asyncio.get_running_loop()
        while True:
            await self._arrived.wait()
            self._arrived.clear()
            batch = self._backlog.take()
            if not batch:
                continue
            try:
                with self._hold():
                    bgr = await loop.run_in_executor(
                        worker, self._decoder.newest, [frame.payload for frame, _ in batch]
                    )
            except ValueError as error:
                self.broken += 1
                self._backlog.reset()
                _log.info("%s: waiting for the next whole picture", error)
                continue
            if bgr is not None:
                frame, arrival_ns = batch[-1]
                self._hand_on(frame, arrival_ns, bgr)

    def _hand_on(self, frame: PaveFrame, arrival_ns: int, bgr: Image) -> None:
        device_ns = self._counter.unwrap(frame.header.timestamp_ms) * 1_000_000
        stamp_ns = self._device.to_ours(device_ns, arrival_ns)
        if stamp_ns is None:
            self.out_of_order += 1
            return
        self.pictures += 1
        self._show(DecodedFrame(frame.header.frame_number, stamp_ns, arrival_ns, bgr))
