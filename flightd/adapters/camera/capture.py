"""Cameras and recordings that OpenCV opens: a process of their own reads them into shared memory."""

from __future__ import annotations

import asyncio
import contextlib
import enum
import multiprocessing
import signal
import time
from collections.abc import Callable, Generator, Iterable, Iterator
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path

import cv2
import numpy as np

from flightd.adapters.camera.exposure import DeviceExposure
from flightd.core.errors import InputError, TransientError
from flightd.core.types import Image
from flightd.ports import Clock
from flightd.runtime.frame_ring import FrameRing, FrameTicket
from flightd.runtime.undisturbed_start import undisturbed

_SLOTS = 8
_GIVING_BACK_S = 1.0
"""So long a capture process may take to end by itself."""
_PICTURES = {".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".webp"}


class SourceKind(enum.StrEnum):
    DEVICE = "device"
    FILE = "file"
    FOLDER = "folder"


@dataclass(frozen=True, slots=True)
class Source:
    """Where pictures come from; recordings are played at `fps`, a device runs by itself."""

    kind: SourceKind
    path: Path
    width_px: int
    height_px: int
    fps: float


def parse_source(url: str, width_px: int, height_px: int, fps: float) -> Source:
    """A `device:`, `file:` or `folder:` address; InputError for another, or for what does not exist."""
    scheme, _, rest = url.partition(":")
    if scheme not in set(SourceKind) or not rest:
        raise InputError(
            f"camera.url {url!r}: expected udp://HOST:PORT, device:PATH, file:PATH or folder:PATH"
        )
    source = Source(SourceKind(scheme), Path(rest), width_px, height_px, fps)
    if source.kind is SourceKind.FOLDER and not source.path.is_dir():
        raise InputError(f"camera.url {url}: no such folder")
    if source.kind is SourceKind.FILE and not source.path.is_file():
        raise InputError(f"camera.url {url}: no such file")
    return source


class CaptureCamera:
    """Hands the ticket of each picture to `on_frame`.

    `run` raises TransientError when the source cannot be opened, ends or gives pictures of another size;
    started again it tries anew.
    """

    def __init__(
        self, source: Source, latency_s: float, clock: Clock, on_frame: Callable[[FrameTicket], None]
    ) -> None:
        self._source = source
        self._latency_ns = round(latency_s * 1e9)
        self._clock = clock
        self._on_frame = on_frame
        self._exposure = 1.0
        self._process: Connection | None = None
        self._asked = False
        self.frames = 0

    def expose(self, part: float) -> None:
        """Ask the device for pictures of this part of its usual exposure; recordings are as they are."""
        if part != self._exposure:
            self._exposure = part
            self._ask()

    async def run(self) -> None:
        source, loop = self._source, asyncio.get_running_loop()
        ring = FrameRing.create(_SLOTS, source.width_px, source.height_px)
        context = multiprocessing.get_context("forkserver")
        ours, theirs = context.Pipe()
        process = context.Process(target=_capture, args=(source, ring.name, theirs), daemon=True)
        over: asyncio.Future[str] = loop.create_future()

        def readable() -> None:
            try:
                message = ours.recv()
            except (EOFError, OSError):
                message = "the capture process died"
            if isinstance(message, str):
                loop.remove_reader(ours.fileno())
                if not over.done():
                    over.set_result(message)
                return
            self._deliver(ring, *message)

        try:
            self._asked = False
            with undisturbed():
                process.start()
            theirs.close()
            loop.add_reader(ours.fileno(), readable)
            self._process = ours
            if self._exposure != 1.0:
                self._ask()
            raise TransientError(f"camera {source.kind}:{source.path}: {await over}")
        finally:
            self._process = None
            loop.remove_reader(ours.fileno())
            ours.close()
            try:
                if self._asked:  # the process gives the device's own exposure back
                    await asyncio.to_thread(process.join, _GIVING_BACK_S)
            finally:
                process.kill()
                process.join(1.0)
                ring.close()

    def _ask(self) -> None:
        if self._process is not None and self._source.kind is SourceKind.DEVICE:
            self._asked = True
            with contextlib.suppress(OSError):  # the process has died: `run` tells
                self._process.send(self._exposure)

    def _deliver(self, ring: FrameRing, slot: int, seq: int, age_ns: int, exposure: float) -> None:
        arrival_ns = self._clock.now_ns()
        self.frames += 1
        stamp_ns = arrival_ns - age_ns - self._latency_ns
        self._on_frame(
            FrameTicket(
                ring.name,
                slot,
                _SLOTS,
                seq,
                stamp_ns,
                arrival_ns,
                ring.width_px,
                ring.height_px,
                exposure,
            )
        )


def _capture(source: Source, ring_name: str, conn: Connection) -> None:
    """The process's life: read, write into the ring, tell; it ends with a text that says why."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    ring = FrameRing.attach(ring_name, _SLOTS, source.width_px, source.height_px)
    over = "cannot be opened, or gives no picture"
    try:
        with contextlib.closing(pictures_of(source, conn)) as pictures:
            for seq, (picture, exposure) in enumerate(pictures):
                over = "no more pictures"
                grabbed_ns = time.monotonic_ns()
                if picture.shape != (source.height_px, source.width_px, 3) or picture.dtype != np.uint8:
                    size = f"{picture.shape[1]}x{picture.shape[0]}"
                    wanted = f"{source.width_px}x{source.height_px}"
                    conn.send(f"pictures are {size}, the configuration says {wanted}")
                    return
                slot = ring.begin(seq)
                np.copyto(ring.pixels(slot), picture)
                ring.publish(slot, seq, grabbed_ns)
                conn.send((slot, seq, time.monotonic_ns() - grabbed_ns, exposure))
        conn.send(over)
    except (ConnectionError, EOFError):
        return


def pictures_of(source: Source, conn: Connection) -> Generator[tuple[Image, float], None, None]:
    """Pictures and the part of the usual exposure that each was taken with, as `conn` asks for."""
    if source.kind is SourceKind.FOLDER:
        paths = sorted(path for path in source.path.iterdir() if path.suffix.lower() in _PICTURES)
        yield from ((picture, 1.0) for picture in _paced(map(_read, paths), source.fps))
    elif source.kind is SourceKind.FILE:
        video = _video(cv2.VideoCapture(str(source.path)))
        yield from ((picture, 1.0) for picture in _paced(video, source.fps))
    else:
        capture = cv2.VideoCapture(str(source.path), cv2.CAP_V4L2)
        capture.set(cv2.CAP_PROP_FRAME_WIDTH, source.width_px)
        capture.set(cv2.CAP_PROP_FRAME_HEIGHT, source.height_px)
        capture.set(cv2.CAP_PROP_FPS, source.fps)
        capture.set(cv2.CAP_PROP_BUFFERSIZE, 1)
        exposure = DeviceExposure(capture)
        try:
            for picture in _video(capture):
                yield picture, exposure.of_next_picture()
                while conn.poll():
                    exposure.ask(conn.recv())
        finally:
            exposure.give_back()


def _read(path: Path) -> Image | None:
    picture = cv2.imread(str(path), cv2.IMREAD_COLOR)
    return None if picture is None else np.asarray(picture, dtype=np.uint8)


def _video(capture: cv2.VideoCapture) -> Iterator[Image]:
    while True:
        good, picture = capture.read()
        if not good:
            return
        yield np.asarray(picture, dtype=np.uint8)


def _paced(pictures: Iterable[Image | None], fps: float) -> Iterator[Image]:
    """Recorded pictures at their rate; unreadable ones are left out."""
    due_s = time.monotonic()
    for picture in pictures:
        if picture is None:
            continue
        due_s += 1.0 / fps
        time.sleep(max(due_s - time.monotonic(), 0.0))
        yield picture
