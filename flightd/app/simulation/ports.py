"""Where the peers of a simulated flight meet the daemon, and which of them there are."""

from __future__ import annotations

import socket
from dataclasses import dataclass

from flightd.adapters.camera.connect import ARDRONE_URL
from flightd.config.schema import Config
from flightd.core.errors import UnavailableError
from flightd.site.site import Site


@dataclass(frozen=True, slots=True)
class WorldPorts:
    """UDP ports of one simulation's peers; `front_camera` None without one."""

    vehicle: tuple[int, ...]
    camera: int
    front_camera: int | None


def has_front_camera(config: Config, site: Site) -> bool:
    """Whether a front camera is simulated: where there are racks to look at, or one is configured.  An
    AR.Drone carries no second computer to see them with."""
    return config.front_camera.is_fitted or (bool(site.locations) and config.vehicle.kind != "ardrone")


def fitted(config: Config, site: Site) -> Config:
    """The configuration with a front camera where one is simulated."""
    if config.front_camera.is_fitted or not has_front_camera(config, site):
        return config
    front = config.front_camera.model_copy(update={"url": "udp://127.0.0.1:5601"})
    return config.model_copy(update={"front_camera": front})


def free_ports(config: Config, site: Site) -> WorldPorts:
    """Ports for the vehicle (one, or the AR.Drone's four) and the cameras."""
    vehicle = tuple(free_port() for _ in range(4 if config.vehicle.kind == "ardrone" else 1))
    return WorldPorts(vehicle, free_port(), free_port() if has_front_camera(config, site) else None)


def connected(config: Config, ports: WorldPorts) -> Config:
    """The configuration with the addresses of this simulation's peers."""
    vehicle_url, camera_url = f"udpout://127.0.0.1:{ports.vehicle[0]}", f"udp://127.0.0.1:{ports.camera}"
    if config.vehicle.kind == "ardrone":
        query = "at={}&navdata={}&video={}&control={}".format(*ports.vehicle)
        vehicle_url, camera_url = f"ardrone://127.0.0.1?{query}", ARDRONE_URL
    front_url = "" if ports.front_camera is None else f"udp://127.0.0.1:{ports.front_camera}"
    return config.model_copy(
        update={
            "vehicle": config.vehicle.model_copy(update={"url": vehicle_url}),
            "camera": config.camera.model_copy(update={"url": camera_url}),
            "front_camera": config.front_camera.model_copy(update={"url": front_url}),
        }
    )


def free_port() -> int:
    """A UDP port of the loopback interface that nobody uses now."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind(("127.0.0.1", 0))
        except OSError as err:
            raise UnavailableError(f"no free UDP port on 127.0.0.1: {err.strerror}") from err
        return int(probe.getsockname()[1])
