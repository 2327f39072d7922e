"""Where the peers of a simulated flight meet the daemon, and which of them there are."""

from __future__ import annotations

from dataclasses import dataclass

from flightd.adapters.camera.connect import ARDRONE_URL
from flightd.app.build import Peers
from flightd.config.schema import Config
from flightd.core.errors import UnavailableError
from flightd.runtime.free_ports import free_ports as free_port_numbers
from flightd.sim.sensors.camera_path import CameraPath


@dataclass(frozen=True, slots=True)
class WorldPorts:
    """UDP ports of one simulation's peers; `front_camera` None without one."""

    vehicle: tuple[int, ...]
    camera: int
    front_camera: int | None


def free_ports(config: Config) -> WorldPorts:
    """Ports for the vehicle (one, or the AR.Drone's four) and the cameras, which nobody uses now."""
    vehicles = 4 if config.vehicle.kind == "ardrone" else 1
    try:
        ports = free_port_numbers(vehicles + 1 + config.front_camera.is_fitted)
    except OSError as err:
        raise UnavailableError(f"no free UDP port on 127.0.0.1: {err.strerror}") from err
    front = ports[vehicles + 1] if config.front_camera.is_fitted else None
    return WorldPorts(tuple(ports[:vehicles]), ports[vehicles], front)


def peers_at(ports: WorldPorts, config: Config, camera: CameraPath) -> Peers:
    """Where the daemon reaches this simulation's peers, the down camera by its path."""
    front_url = "" if ports.front_camera is None else f"udp://127.0.0.1:{ports.front_camera}"
    if config.vehicle.kind == "ardrone":
        query = "at={}&navdata={}&video={}&control={}".format(*ports.vehicle)
        return Peers(f"ardrone://127.0.0.1?{query}", ARDRONE_URL, front_url)
    vehicle_url = f"udpout://127.0.0.1:{ports.vehicle[0]}"
    return Peers(vehicle_url, camera.url(ports.camera), front_url)
