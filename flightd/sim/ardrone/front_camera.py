"""The drone's front camera before the racks: 92 degrees across the diagonal, 640x360 in its video."""

from __future__ import annotations

import math
from contextlib import nullcontext
from functools import partial

from flightd.ports import Clock
from flightd.runtime.clock import Hold
from flightd.sim.ardrone.server import ArDroneServer
from flightd.sim.ardrone.video import HEIGHT_PX, WIDTH_PX, VideoChannel
from flightd.sim.racks.appearance import RackAppearance
from flightd.sim.racks.front_camera import FrontCamera, front_lens
from flightd.sim.racks.renderer import FrontRenderer
from flightd.sim.sensors.camera import CameraPeer
from flightd.site.site import Site

_FOCAL_PX = math.hypot(WIDTH_PX, HEIGHT_PX) / 2 / math.tan(math.radians(92.0) / 2)
_FPS = 10.0
"""The drone films 30 a second; so many are drawn."""
_NOBODY = ("127.0.0.1", 9)


def front_peer(
    server: ArDroneServer, site: Site, look: RackAppearance, seed: int, clock: Clock, hold: Hold = nullcontext
) -> CameraPeer:
    """What the video shows while its channel is the front camera; nothing is drawn for the other one."""
    camera = FrontCamera(lens=front_lens(WIDTH_PX, HEIGHT_PX, _FOCAL_PX), fps=_FPS)
    return CameraPeer(
        camera,
        partial(FrontRenderer, site, camera, look, seed),
        f"ardrone front camera {seed}",
        _NOBODY,
        server.truth_at,
        clock,
        partial(server.show, camera=VideoChannel.FRONT),
        lambda: server.watched and server.channel is VideoChannel.FRONT,
        hold,
        "front camera",
    )
