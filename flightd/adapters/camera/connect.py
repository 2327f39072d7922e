"""The camera that the configuration names."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import nullcontext

from flightd.adapters.camera.capture import CaptureCamera
from flightd.adapters.camera.shared_memory import SharedCamera
from flightd.adapters.camera.source import parse_source
from flightd.adapters.vehicle.ardrone.camera import ArDroneCamera
from flightd.adapters.vehicle.ardrone.settings import DroneCamera
from flightd.adapters.vehicle.ardrone.vehicle import ArDroneVehicle
from flightd.config.camera import CameraConfig
from flightd.config.front_camera import FrontCameraConfig
from flightd.core.errors import InputError
from flightd.ports import Camera, Clock, Vehicle
from flightd.runtime.clock import Hold
from flightd.runtime.frame_ring import FrameTicket

ARDRONE_URL = "ardrone:"
"""The camera of the AR.Drone that is the vehicle."""


def connect_camera(
    config: CameraConfig | FrontCameraConfig,
    clock: Clock,
    on_frame: Callable[[FrameTicket], None],
    on_trouble: Callable[[str], None],
    vehicle: Vehicle | None = None,
    url: str | None = None,
    hold: Hold = nullcontext,
) -> Camera:
    """Make the adapter; nothing is opened until its `run`.  Raises InputError for a wrong address.

    `on_trouble` hears, now and then, in a line for a person, why frames are refused or of doubtful time.
    `url` is where its frames come from, unless that is the configuration's; time is held by `hold`
    while threads work."""
    url = config.url if url is None else url
    if url == ARDRONE_URL:
        if isinstance(config, FrontCameraConfig):
            raise InputError(f"front_camera.url {ARDRONE_URL!r}: the AR.Drone sends one camera at a time")
        if not isinstance(vehicle, ArDroneVehicle):
            raise InputError(f'camera.url {ARDRONE_URL!r} needs vehicle.kind = "ardrone"')
        return ArDroneCamera(vehicle, config.latency_s, clock, {DroneCamera.DOWN: on_frame}, hold)
    if url.startswith("udp:"):
        size_px = config.width_px, config.height_px
        return SharedCamera(url, size_px, config.latency_s, clock, on_frame, on_trouble)
    source = parse_source(url, config.width_px, config.height_px, config.fps, config.exposure_order())
    return CaptureCamera(source, config.latency_s, clock, on_frame, on_trouble)
