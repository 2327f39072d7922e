"""The world in a box: warehouse, airframe, autopilot and camera, as peers on sockets.

It knows nothing of the daemon but the address that its camera reports to.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable
from dataclasses import dataclass, field

from flightd.core.topics import Topic
from flightd.grid.site import Site
from flightd.ports import Clock, Recorder
from flightd.sim.airframe import Airframe
from flightd.sim.appearance import DEFAULT, Appearance
from flightd.sim.autopilot.copter import ArduCopterPeer
from flightd.sim.autopilot.peer import PeerConfig
from flightd.sim.camera import CameraPeer
from flightd.sim.kinematics import Kinematics
from flightd.sim.optics import SimCamera
from flightd.sim.wind import Draught

_TRUTH_PERIOD_S = 0.02


@dataclass(frozen=True, slots=True)
class WorldSpec:
    """Everything that makes one simulated world; `vehicle_port` 0 takes any free port."""

    site: Site
    seed: int
    camera_address: tuple[str, int]
    vehicle_port: int = 0
    start_yaw_rad: float = 0.0
    camera: SimCamera = field(default_factory=SimCamera)
    appearance: Appearance = DEFAULT
    draught: Draught = field(default_factory=Draught)
    battery_frac: float = 1.0


class World:
    """The running peers.  `open` binds the vehicle's port, `run` lives until cancelled."""

    def __init__(self, spec: WorldSpec, clock: Clock, recorder: Recorder) -> None:
        self._clock = clock
        self._recorder = recorder
        pad = spec.site.nodes[spec.site.home.node]
        airframe = Airframe(
            draught=spec.draught,
            seed=spec.seed,
            x_m=pad.x_m,
            y_m=pad.y_m,
            yaw_rad=spec.start_yaw_rad,
            battery_frac=spec.battery_frac,
        )
        self.autopilot = ArduCopterPeer(clock, airframe, PeerConfig(port=spec.vehicle_port, seed=spec.seed))
        self.camera = CameraPeer(
            spec.site,
            spec.camera,
            spec.appearance,
            spec.seed,
            spec.camera_address,
            self.autopilot.truth_at,
            clock,
        )

    async def open(self) -> tuple[str, int]:
        """Bind the vehicle's socket; the address to which a daemon connects."""
        return await self.autopilot.open()

    async def run(self, opened: Callable[[], None] = lambda: None) -> None:
        async with asyncio.TaskGroup() as tasks:
            tasks.create_task(self.autopilot.run(), name="autopilot")
            tasks.create_task(self.camera.run(), name="camera")
            tasks.create_task(self._log_truth(), name="truth")
            opened()

    async def _log_truth(self) -> None:
        while True:
            truth: Kinematics = self.autopilot.truth()
            self._recorder.record(Topic.TRUTH, truth.stamp_ns, truth)
            await asyncio.sleep(_TRUTH_PERIOD_S)


def start_yaw(degrees: float) -> float:
    """Heading on the pad in radians."""
    return math.radians(degrees)
