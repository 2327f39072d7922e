"""Where the peers of a simulated flight meet the daemon, and which of them there are."""

from __future__ import annotations

import socket
from dataclasses import dataclass

from flightd.adapters.camera.connect import ARDRONE_URL
from flightd.app.build import Peers
from flightd.config.schema import Config
from flightd.core.errors import UnavailableError


@dataclass(frozen=True, slots=True)
class WorldPorts:
    """UDP ports of one simulation's peers; `front_camera` None without one."""

    vehicle: tuple[int, ...]
    camera: int
    front_camera: int | None


def free_ports(config: Config) -> WorldPorts:
    """Ports for the vehicle (one, or the AR.Drone's four) and the cameras."""
    vehicle = tuple(free_port() for _ in range(4 if config.vehicle.kind == "ardrone" else 1))
    return WorldPorts(vehicle, free_port(), free_port() if config.front_camera.is_fitted else None)


def peers_at(ports: WorldPorts, config: Config) -> Peers:
    """Where the daemon reaches this simulation's peers."""
    front_url = "" if ports.front_camera is None else f"udp://127.0.0.1:{ports.front_camera}"
    if config.vehicle.kind == "ardrone":
        query = "at={}&navdata={}&video={}&control={}".format(*ports.vehicle)
        return Peers(f"ardrone://127.0.0.1?{query}", ARDRONE_URL, front_url)
    vehicle_url = f"udpout://127.0.0.1:{ports.vehicle[0]}"
    return Peers(vehicle_url, f"udp://127.0.0.1:{ports.camera}", front_url)


def free_port() -> int:
    """A UDP port of the loopback interface that nobody uses now."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind(("127.0.0.1", 0))
        except OSError as err:
            raise UnavailableError(f"no free UDP port on 127.0.0.1: {err.strerror}") from err
        return int(probe.getsockname()[1])
