"""How the simulated down camera's frames reach the daemon."""

from __future__ import annotations

import enum

from flightd.core.geometry import Lens
from flightd.sim.sensors.optics import SimCamera

_RTP_JPEG_STEP_PX, _RTP_JPEG_MOST_PX = 8, 2040
"""RTP tells a JPEG picture's sides in a byte each, in steps of 8 pixels (RFC 2435, section 3.1)."""


class CameraPath(enum.StrEnum):
    SHARED = "shared"
    """Shared memory, a notice for each frame."""
    MJPEG = "stream:mjpeg"
    """RTP with JPEG pictures."""
    H264 = "stream:h264"
    """RTP with H.264 in MPEG-TS."""

    @property
    def is_stream(self) -> bool:
        return self is not CameraPath.SHARED

    @property
    def late_frames(self) -> int:
        """By so many frame intervals decoding is late at least: that H.264 in MPEG-TS is whole is known when
        the next frames come."""
        return 2 if self is CameraPath.H264 else 0

    def latency_s(self, camera: SimCamera) -> float:
        """From mid-exposure to a frame that can be looked at, at least."""
        return camera.capture_delay_s + self.late_frames / camera.fps

    def url(self, port: int) -> str:
        """Where the daemon of this machine finds such a camera."""
        return f"stream:rtp://127.0.0.1:{port}" if self.is_stream else f"udp://127.0.0.1:{port}"

    def problem(self, lens: Lens) -> str:
        """Why it cannot carry frames of that size, in words; empty where it can."""
        sides = lens.width_px, lens.height_px
        if self is CameraPath.MJPEG and any(
            side % _RTP_JPEG_STEP_PX or side > _RTP_JPEG_MOST_PX for side in sides
        ):
            return f"in multiples of {_RTP_JPEG_STEP_PX} up to {_RTP_JPEG_MOST_PX}"
        if self is CameraPath.H264 and any(side % 2 for side in sides):
            return "of even numbers"
        return ""
