"""The camera that the configuration names."""

from __future__ import annotations

from collections.abc import Callable

from flightd.adapters.camera.capture import CaptureCamera, parse_source
from flightd.adapters.camera.shared import SharedCamera
from flightd.config.schema import CameraConfig
from flightd.ports import Camera, Clock
from flightd.runtime.ring import FrameTicket


def connect_camera(config: CameraConfig, clock: Clock, on_frame: Callable[[FrameTicket], None]) -> Camera:
    """Make the adapter; nothing is opened until its `run`.  Raises InputError for a wrong address."""
    if config.url.startswith("udp:"):
        return SharedCamera(
            config.url, (config.width_px, config.height_px), config.latency_s, clock, on_frame
        )
    source = parse_source(config.url, config.width_px, config.height_px, config.fps)
    return CaptureCamera(source, config.latency_s, clock, on_frame)
