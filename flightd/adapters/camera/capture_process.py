"""The process that reads a camera by OpenCV into shared memory, and what it tells of each frame.

It does nothing else, so that a frame's arrival is known here whatever the daemon's own loop is busy with.
"""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Generator, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from flightd.adapters.camera.exposure import DeviceExposure
from flightd.adapters.camera.exposure_times import ExposureTimes, TimeSource
from flightd.adapters.camera.grabbed import Grabbed
from flightd.adapters.camera.held_exposure import HeldExposure
from flightd.adapters.camera.picamera import frames_of_picamera, open_picamera
from flightd.adapters.camera.source import Source, SourceKind
from flightd.adapters.camera.v4l2_controls import controls_of
from flightd.core.errors import UnavailableError
from flightd.core.types import Image
from flightd.runtime.frame_ring import FrameRing
from flightd.runtime.message_channel import ChildEnd

SLOTS = 8
_IMAGES = {".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".webp"}
_OPEN_MS, _READ_MS = 5000, 2000
"""A stream that does not open, or stands still, for so long has ended."""
_DOUBTFUL_NS = 4_000_000_000
"""A live source without one frame to fly by for so long is opened anew."""
_FFMPEG = {
    # as little as possible waits in buffers; what a stream of damaged packets says goes nowhere
    "OPENCV_FFMPEG_CAPTURE_OPTIONS": "fflags;nobuffer|flags;low_delay|probesize;200000"
    "|analyzeduration;500000",
    "OPENCV_FFMPEG_LOGLEVEL": "8",
}


@dataclass(frozen=True, slots=True)
class Captured:
    """A frame lies in the ring.  `stamp_ns` is mid-exposure, as `arrival_ns` by the machine's monotonic
    clock; `refused` frames so far had no time that can be believed."""

    slot: int
    seq: int
    stamp_ns: int
    arrival_ns: int
    exposure: float
    gain: float
    refused: int


@dataclass(frozen=True, slots=True)
class CaptureOver:
    """No more frames: why."""

    reason: str


def capture(parent: ChildEnd, source: Source, ring_name: str, latency_ns: int) -> None:
    """The process's life.  Sends `Captured`, a `TimeSource` when it is known what tells of exposures, an
    `ExposureState` whenever a camera that can be told is read back to be in another, and `CaptureOver` at the
    end."""
    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_ERROR)  # what cannot be opened is told
    try:
        ring = FrameRing.attach(ring_name, SLOTS, source.width_px, source.height_px)
    except UnavailableError as err:
        parent.send(CaptureOver(str(err)))
        return
    try:
        reason = _reason_of_end(parent, source, ring, latency_ns)
    except UnavailableError as err:
        reason = str(err)
    parent.send(CaptureOver(reason))


def _reason_of_end(parent: ChildEnd, source: Source, ring: FrameRing, latency_ns: int) -> str:
    reason, refused = "cannot be opened, or gives no frame", 0
    times = ExposureTimes(latency_ns, round(1e9 / source.fps)) if source.kind.is_live else None
    told: TimeSource | None = None
    good_ns: int | None = None
    with contextlib.closing(frames_of(source, parent)) as frames:
        for seq, frame in enumerate(frames):
            reason = "no more frames"
            if frame.bgr.shape != (source.height_px, source.width_px, 3) or frame.bgr.dtype != np.uint8:
                size = f"{frame.bgr.shape[1]}x{frame.bgr.shape[0]}"
                return f"frames are {size}, the configuration says {source.width_px}x{source.height_px}"
            stamp_ns = _stamp_of(frame, times, latency_ns)
            if times is not None and times.source not in {None, told}:
                told = times.source
                parent.send(told)
            good_ns = good_ns or frame.arrival_ns
            if stamp_ns is None:
                refused += 1
                if frame.arrival_ns - good_ns > _DOUBTFUL_NS:
                    return "frames come, but none of a time that can be believed"
                continue
            good_ns = frame.arrival_ns
            slot = ring.begin(seq)
            np.copyto(ring.pixels(slot), frame.bgr)
            ring.publish(slot, seq, stamp_ns)
            how = frame.exposure, frame.gain
            parent.send(Captured(slot, seq, stamp_ns, frame.arrival_ns, *how, refused))
    return reason


def _stamp_of(frame: Grabbed, times: ExposureTimes | None, latency_ns: int) -> int | None:
    """Mid-exposure; a recording's frames are exposed when they are due."""
    if times is None:
        return frame.arrival_ns - latency_ns
    return times.of(frame.device_ns, frame.arrival_ns)


def frames_of(source: Source, parent: ChildEnd) -> Generator[Grabbed, None, None]:
    """The source's frames as they come, exposed as `parent` asks for where that can be set."""
    if source.kind is SourceKind.FOLDER:
        paths = sorted(path for path in Path(source.place).iterdir() if path.suffix.lower() in _IMAGES)
        yield from _paced(map(_read, paths), source.fps)
    elif source.kind is SourceKind.FILE:
        video = _grabbed(cv2.VideoCapture(source.place))
        yield from _paced((frame.bgr for frame in video), source.fps)
    elif source.kind is SourceKind.STREAM:
        patience = [cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, _OPEN_MS, cv2.CAP_PROP_READ_TIMEOUT_MSEC, _READ_MS]
        with _environment(_FFMPEG):
            stream = cv2.VideoCapture(source.place, cv2.CAP_FFMPEG, [*patience, cv2.CAP_PROP_N_THREADS, 1])
        yield from _grabbed(stream)
    elif source.kind is SourceKind.PICAMERA:
        yield from frames_of_picamera(source, open_picamera(int(source.place)), parent)
    else:
        yield from _of_device(source, parent)


@contextlib.contextmanager
def _environment(settings: Mapping[str, str]) -> Iterator[None]:
    """These meanwhile; whatever else this process opens later is opened as before."""
    before = {name: os.environ.get(name) for name in settings}
    os.environ.update(settings)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _of_device(source: Source, parent: ChildEnd) -> Iterator[Grabbed]:
    device = cv2.VideoCapture(source.place, cv2.CAP_V4L2)
    if not device.isOpened():  # a process that a killed daemon left may have it, and gives its setting back
        return
    device.set(cv2.CAP_PROP_FRAME_WIDTH, source.width_px)
    device.set(cv2.CAP_PROP_FRAME_HEIGHT, source.height_px)
    device.set(cv2.CAP_PROP_FPS, source.fps)
    device.set(cv2.CAP_PROP_BUFFERSIZE, 1)
    with controls_of(source.place) as controls:
        held = HeldExposure(controls, source.order, parent.send)
        exposure = DeviceExposure(device)
        try:
            for frame in _grabbed(device):
                part = exposure.of_next_frame()
                yield Grabbed(frame.bgr, frame.arrival_ns, frame.device_ns, part)
                held.look(exposure.is_usual)
                while parent.has_news():
                    part, _ = parent.receive()  # a driver's gain is a number of no known scale
                    exposure.ask(part)
        finally:
            exposure.give_back()
            held.give_back()


def _grabbed(video: cv2.VideoCapture) -> Iterator[Grabbed]:
    """Frames with the time of their buffer (V4L2) or their presentation time (a stream): OpenCV tells both as
    the position, 0 where there is none."""
    while video.grab():
        arrival_ns = time.monotonic_ns()
        position_ms = video.get(cv2.CAP_PROP_POS_MSEC)
        good, bgr = video.retrieve()
        if not good:
            return
        device_ns = round(position_ms * 1e6) if position_ms >= 0.0 else None
        yield Grabbed(np.asarray(bgr, dtype=np.uint8), arrival_ns, device_ns)


def _read(path: Path) -> Image | None:
    bgr = cv2.imread(str(path), cv2.IMREAD_COLOR)
    return None if bgr is None else np.asarray(bgr, dtype=np.uint8)


def _paced(recorded: Iterable[Image | None], fps: float) -> Iterator[Grabbed]:
    """Recorded frames at their rate; unreadable ones are left out."""
    due_s = time.monotonic()
    for bgr in recorded:
        if bgr is None:
            continue
        due_s += 1.0 / fps
        time.sleep(max(due_s - time.monotonic(), 0.0))
        yield Grabbed(bgr, time.monotonic_ns())
