"""A camera that sends its frames over the network, each with the time of its exposure drawn in it.

`python -m tests.rigs.video_stream URL FORMAT CODEC RATE_HZ` sends until it is ended."""

from __future__ import annotations

import asyncio
import contextlib
import sys
import time
from collections.abc import AsyncIterator
from fractions import Fraction

import av
import numpy as np

from flightd.core.types import Image

WIDTH_PX, HEIGHT_PX = 320, 200
_CELL_PX = 20
_COLUMNS, _BITS = WIDTH_PX // _CELL_PX, 64
_LATE = 0.2
"""A frame that this machine is late for by such a part of its interval is left out."""
_MICROSECONDS = Fraction(1, 1_000_000)


def drawn(time_ns: int) -> Image:
    """A frame exposed at that time of the machine's monotonic clock, to the microsecond."""
    bits = [(time_ns // 1000) >> bit & 1 for bit in range(_BITS)]
    cells = np.full((HEIGHT_PX // _CELL_PX, _COLUMNS), 0.25)
    cells[2 : 2 + _BITS // _COLUMNS] = np.reshape(bits, (-1, _COLUMNS))
    grey = np.kron(cells * 200.0 + 20.0, np.ones((_CELL_PX, _CELL_PX)))
    return np.repeat(grey.astype(np.uint8)[:, :, None], 3, axis=2)


def read_time_ns(bgr: Image) -> int:
    """The time that is drawn in a frame."""
    middle = _CELL_PX // 2
    cells = bgr[middle::_CELL_PX, middle::_CELL_PX, 1][2 : 2 + _BITS // _COLUMNS] > 128
    return 1000 * sum(int(bit) << place for place, bit in enumerate(cells.ravel()))


def send(url: str, form: str, codec: str, rate_hz: float) -> None:
    """For ever, or until nobody takes it."""
    output = av.open(url, "w", format=form, options={"flush_packets": "1", "muxdelay": "0"})
    video = output.add_stream(codec, rate=round(rate_hz))
    assert isinstance(video, av.VideoStream)
    video.width, video.height = WIDTH_PX, HEIGHT_PX
    video.pix_fmt = "yuvj420p" if codec == "mjpeg" else "yuv420p"
    if codec == "mjpeg":
        # RTP carries no other tables, nor the restart markers between slices of several threads
        video.options = {"huffman": "default"}
        video.thread_count = 1
    else:
        video.options = {"tune": "zerolatency", "preset": "ultrafast", "g": str(round(rate_hz / 2))}
    video.codec_context.time_base = _MICROSECONDS
    began_ns = due_ns = time.monotonic_ns()
    with contextlib.suppress(OSError):
        while True:
            due_ns += round(1e9 / rate_hz)
            time.sleep(max(due_ns - time.monotonic_ns(), 0) * 1e-9)  # noqa: TID251 - a process of its own
            exposed_ns = time.monotonic_ns()
            if exposed_ns - due_ns > _LATE / rate_hz * 1e9:  # no camera bunches its exposures
                continue
            frame = av.VideoFrame.from_ndarray(drawn(exposed_ns), format="bgr24").reformat(
                format=video.pix_fmt
            )
            frame.pts, frame.time_base = (exposed_ns - began_ns) // 1000, _MICROSECONDS
            output.mux(video.encode(frame))


@contextlib.asynccontextmanager
async def sending(url: str, form: str, codec: str, rate_hz: float) -> AsyncIterator[None]:
    """Such a camera in a process of its own, meanwhile."""
    arguments = ("-m", "tests.rigs.video_stream", url, form, codec, str(rate_hz))
    process = await asyncio.create_subprocess_exec(
        sys.executable, *arguments, stderr=asyncio.subprocess.DEVNULL
    )
    try:
        yield
    finally:
        process.kill()
        await process.wait()


if __name__ == "__main__":
    send(sys.argv[1], sys.argv[2], sys.argv[3], float(sys.argv[4]))
