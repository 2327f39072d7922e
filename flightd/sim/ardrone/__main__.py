"""An emulated AR.Drone 2.0 for anyone's client: `python -m flightd.sim.ardrone`.

It stands on the charging pad of a simulated warehouse, flies in real time and streams what its bottom
camera sees there and its front camera of the racks.  A client that insists on the drone's own
address can be given it: `ip address add 192.168.1.1/32 dev lo`, then `--host 192.168.1.1`.
"""

from __future__ import annotations

import argparse
import asyncio
import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from flightd.config.paths import shipped
from flightd.core.errors import InputError
from flightd.runtime.clock import LoopClock
from flightd.sim.appearance import DEFAULT
from flightd.sim.ardrone.drone import Drone
from flightd.sim.ardrone.front_camera import front_peer
from flightd.sim.ardrone.server import ArDroneServer, DronePorts
from flightd.sim.ardrone.video import VideoChannel
from flightd.sim.floor.renderer import Renderer
from flightd.sim.plant.airframe import Airframe
from flightd.sim.racks.appearance import RackAppearance
from flightd.sim.sensors.camera import CameraPeer
from flightd.sim.sensors.instruments import Sensors
from flightd.sim.sensors.optics import SimCamera
from flightd.site.site import Site
from flightd.site.site_file import load_site

_NOBODY = ("127.0.0.1", 9)


def main(arguments: Sequence[str] | None = None) -> int:
    """Serve until interrupted; 2 when a port or the site file cannot be had."""
    parser = argparse.ArgumentParser(prog="python -m flightd.sim.ardrone", description=__doc__)
    parser.add_argument("--host", default="127.0.0.1", help="address to listen on")
    names = ("AT", "NAVDATA", "VIDEO", "CONTROL")
    parser.add_argument(
        "--ports", type=int, nargs=4, default=[5556, 5554, 5555, 5559], metavar=names, help="the four ports"
    )
    parser.add_argument("--site", type=Path, help="site file (default: the demo site)")
    parser.add_argument("--seed", type=int, default=1, help="seed of wind, sensors and floor")
    parser.add_argument("--battery", type=float, default=1.0, help="charge at the start, 0..1")
    chosen = parser.parse_args(arguments)
    try:
        site = load_site(chosen.site or shipped("site-demo.toml"))
        ports = DronePorts(chosen.host, *chosen.ports)
        asyncio.run(_serve(site, ports, chosen.seed, chosen.battery))
    except KeyboardInterrupt:
        return 0
    except (InputError, OSError) as error:
        print(f"flightd.sim.ardrone: {error}", file=sys.stderr)
        return 2
    return 0


async def _serve(site: Site, ports: DronePorts, seed: int, battery_frac: float) -> None:
    clock = LoopClock()
    pad = site.nodes[site.home.node]
    airframe = Airframe(seed=seed, x_m=pad.x_m, y_m=pad.y_m, battery_frac=battery_frac)
    server = ArDroneServer(Drone(airframe, Sensors(seed=seed)), clock, ports)
    await server.open()
    print(f"AR.Drone 2.0 on {server.ports}", flush=True)
    optics = SimCamera()
    make = partial(Renderer, site, optics, DEFAULT, seed)
    show = partial(server.show, camera=VideoChannel.BOTTOM)
    camera = CameraPeer(optics, make, f"camera {seed}", _NOBODY, server.truth_at, clock, show)
    front = front_peer(server, site, RackAppearance(), seed, clock)
    async with asyncio.TaskGroup() as tasks:
        tasks.create_task(server.run(), name="drone")
        tasks.create_task(camera.run(), name="camera")
        tasks.create_task(front.run(), name="front camera")


if __name__ == "__main__":
    sys.exit(main())
