"""A camera that sends its frames over the network as video, each with the time of its exposure."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

import av

from flightd.core.geometry import Lens
from flightd.core.types import Image
from flightd.sim.sensors.camera_path import CameraPath

_MICROSECONDS = Fraction(1, 1_000_000)
_KEY_FRAMES_S = 0.5
"""Whoever begins to listen sees nothing before the next one."""
_JPEG_QUALITY = 2, 5
"""Least and most quantiser, of 31."""


@dataclass(frozen=True, slots=True)
class ExposedFrame:
    """A frame exposed at `stamp_ns` (the middle) has been sent."""

    stamp_ns: int


class CameraStream:
    """Sends to `address` (host, port; RTCP goes to the port above) as `path` says, whether or not anybody
    listens.  A stream is in order: a frame no newer than the last is left out."""

    def __init__(self, path: CameraPath, address: tuple[str, int], lens: Lens, fps: float) -> None:
        form = "rtp" if path is CameraPath.MJPEG else "rtp_mpegts"
        self._output = av.open("rtp://{}:{}".format(*address), "w", format=form)
        codec = "mjpeg" if path is CameraPath.MJPEG else "libx264"
        video = self._output.add_stream(codec, rate=round(fps))
        assert isinstance(video, av.VideoStream)
        self._video = video
        video.width, video.height = lens.width_px, lens.height_px
        context = video.codec_context
        context.time_base, context.thread_count = _MICROSECONDS, 1
        if path is CameraPath.MJPEG:
            video.pix_fmt = "yuvj420p"
            context.qmin, context.qmax = _JPEG_QUALITY
            video.options = {"huffman": "default"}  # RTP carries no tables of Huffman codes
        else:
            video.pix_fmt = "yuv420p"
            keys = str(max(round(fps * _KEY_FRAMES_S), 1))
            video.options = {"preset": "ultrafast", "tune": "zerolatency", "g": keys}
        self._began_ns: int | None = None
        self._newest_ns = -1

    def send(self, bgr: Image, exposed_ns: int) -> bool:
        """Encode and send; whether it was sent."""
        if exposed_ns <= self._newest_ns:
            return False
        if self._began_ns is None:
            self._began_ns = exposed_ns
        self._newest_ns = exposed_ns
        frame = av.VideoFrame.from_ndarray(bgr, format="bgr24").reformat(format=self._video.pix_fmt)
        frame.pts, frame.time_base = (exposed_ns - self._began_ns) // 1000, _MICROSECONDS
        self._output.mux(self._video.encode(frame))
        return True

    def close(self) -> None:
        self._output.close()
