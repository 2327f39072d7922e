"""A vehicle adapter and its simulated peer, joined by real loopback sockets, in virtual time."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Protocol

from flightd.adapters.vehicle.ardrone.vehicle import ArDroneVehicle
from flightd.adapters.vehicle.mavlink.ardupilot import ArduPilotVehicle
from flightd.adapters.vehicle.mavlink.px4 import Px4Vehicle
from flightd.adapters.vehicle.mavsdk.vehicle import MavsdkVehicle
from flightd.core.types import AttitudeSetpoint, Demand, VehicleState
from flightd.ports import Vehicle
from flightd.runtime.clock import LoopClock
from flightd.sim.ardrone.drone import Drone
from flightd.sim.ardrone.server import ArDroneServer
from flightd.sim.autopilot.autopilot import PeerConfig
from flightd.sim.autopilot.copter import ArduCopterPeer, CopterMode
from flightd.sim.autopilot.px4 import Px4Mode, Px4Peer
from flightd.sim.plant.airframe import Airframe
from flightd.sim.plant.kinematics import Kinematics
from flightd.sim.plant.wind import WindParams
from flightd.sim.sensors.instruments import Sensors
from tests.rigs.ardrone import ANY_PORTS, settings_for
from tests.rigs.waiting import until

CALM = WindParams(gust_rms_mps=0.0, vertical_gust_rms_mps=0.0)


class Peer(Protocol):
    """What the contract needs of a simulated vehicle, whatever its kind."""

    airframe: Airframe

    def truth(self) -> Kinematics: ...

    async def run(self) -> None: ...


@dataclass
class Rig:
    """One adapter under test, and the levers of the world behind it."""

    vehicle: Vehicle
    peer: Any
    take_over: Callable[[], None]
    """The pilot moves his switch."""
    cut: Callable[[bool], None]
    """Cut the link, or join it again."""
    attitudes_hz: float = 50.0
    """Rate of the attitude samples."""
    alone_s: float = 6.0
    """How long the vehicle stays up when we let go of it in the air."""
    gap_s: float = 4.0
    """A radio gap after which the vehicle still obeys."""
    late_s: float = 0.0
    """How much later than by its own code it may come, on a busy machine, by a library's own clock."""
    tells_rates: bool = True
    """Whether the vehicle tells what its gyros feel."""
    has_pilot: bool = True
    """Whether someone besides us can command it: an AR.Drone has one client only."""
    texts: Callable[[], list[str] | None] = lambda: None
    """What the vehicle was given to show; None where it shows nothing."""
    flying_task: asyncio.Task[None] | None = None
    patience: Mapping[str, float] = field(default_factory=dict)
    """Parameters that the vehicle is given in the air: how long it waits for us before it lands by itself."""

    def known(self) -> VehicleState:
        state = self.vehicle.state()
        assert state is not None
        return state

    async def until(self, condition: Callable[[], bool], within_s: float = 10.0) -> float:
        """Seconds until the condition held; fails when it does not in time."""
        return await until(condition, within_s)

    async def stream(self, duration_s: float, hz: float = 50.0, **setpoint: float) -> list[bool]:
        """Send one setpoint at a steady rate; what each `send` said."""
        sent = []
        clock = LoopClock()
        due_ns = clock.now_ns()
        for _ in range(round(duration_s * hz)):
            sent.append(self.vehicle.send(AttitudeSetpoint(clock.now_ns(), **setpoint)))
            due_ns += round(1e9 / hz)
            await asyncio.sleep((due_ns - clock.now_ns()) * 1e-9)
        return sent

    async def take_off(self, height_m: float = 1.5) -> None:
        """Demand FLY and climb to a height by setpoints, then stop there."""
        await self.until(lambda: self.vehicle.state() is not None)
        self.vehicle.demand(Demand.FLY)
        await self.until(lambda: self.known().armed and self.known().in_control)
        climb_until = asyncio.get_running_loop().time() + 20.0
        while self.peer.truth().height_m < height_m:
            assert asyncio.get_running_loop().time() < climb_until, "does not climb"
            await self.stream(0.1, climb_mps=0.5)
        for name, value in self.patience.items():
            self.peer.parameters[name] = value
        await self.stream(1.0)


async def _ended(tasks: list[asyncio.Task[None]]) -> None:
    """Cancel and await; what one of them died of fails the test."""
    for task in tasks:
        task.cancel()
    results = await asyncio.gather(*tasks, return_exceptions=True)
    failures = [result for result in results if isinstance(result, Exception)]
    assert not failures, failures


@asynccontextmanager
async def mavlink_rig(
    make_peer: type[ArduCopterPeer | Px4Peer],
    make_vehicle: Callable[[str, LoopClock], Vehicle],
    pilots_mode: int,
    config: PeerConfig | None = None,
    *,
    peer_runs: bool = True,
    patience: Mapping[str, float] | None = None,
) -> AsyncIterator[Rig]:
    clock = LoopClock()
    peer = make_peer(clock, Airframe(wind=CALM), config or PeerConfig(ready_s=0.5))
    host, port = await peer.open()
    vehicle = make_vehicle(f"udpout://{host}:{port}", clock)

    def take_over() -> None:
        assert peer.pilot_mode(pilots_mode)

    def cut(apart: bool) -> None:
        peer.link.muted = apart

    late_s = 1.0 if isinstance(vehicle, MavsdkVehicle) else 0.0
    rig = Rig(
        vehicle, peer, take_over, cut, late_s=late_s, texts=lambda: list(peer.texts), patience=patience or {}
    )
    tasks = [asyncio.create_task(vehicle.run(), name="vehicle")]
    if peer_runs:
        tasks.append(asyncio.create_task(peer.run(), name="peer"))
    rig.flying_task = tasks[0]
    try:
        yield rig
    finally:
        await _ended(tasks)


ardupilot_rig = partial(mavlink_rig, ArduCopterPeer, ArduPilotVehicle, CopterMode.ALT_HOLD)
px4_rig = partial(mavlink_rig, Px4Peer, Px4Vehicle, Px4Mode.ALTCTL)
mavsdk_rig = partial(mavlink_rig, Px4Peer, MavsdkVehicle, Px4Mode.ALTCTL)

_RAW_THRUST = PeerConfig(ready_s=0.5, parameters={"GUID_OPTIONS": 8})
PATIENT_COPTER: dict[str, float] = {"GUID_TIMEOUT": 3.0, "FS_GCS_TIMEOUT": 6.5}
PATIENT_PX4: dict[str, float] = {"COM_OF_LOSS_T": 6.5}
"""It waits through the contract's radio gap; what it does as it is shipped has its own tests."""


@asynccontextmanager
async def ardrone_rig(**settings: Any) -> AsyncIterator[Rig]:
    clock = LoopClock()
    drone = Drone(Airframe(wind=CALM), Sensors())
    async with ArDroneServer(drone, clock, ANY_PORTS) as server:
        vehicle = ArDroneVehicle(settings_for(server, **settings), clock)

        def cut(apart: bool) -> None:
            server.radio = not apart

        rate = 200.0 if settings.get("full_navdata") else 15.0
        rig = Rig(
            vehicle,
            server,
            lambda: None,
            cut,
            rate,
            alone_s=1.5,
            gap_s=1.5,
            tells_rates=False,
            has_pilot=False,
        )
        rig.flying_task = asyncio.create_task(vehicle.run(), name="vehicle")
        tasks = [rig.flying_task, asyncio.create_task(server.run(), name="peer")]
        try:
            yield rig
        finally:
            await _ended(tasks)


RIGS: dict[str, Callable[[], Any]] = {
    "ardupilot": partial(ardupilot_rig, patience=PATIENT_COPTER),
    "ardupilot raw thrust": partial(ardupilot_rig, _RAW_THRUST, patience=PATIENT_COPTER),
    "px4": partial(px4_rig, patience=PATIENT_PX4),
    "mavsdk": partial(mavsdk_rig, patience=PATIENT_PX4),
    "ardrone": ardrone_rig,
    "ardrone full navdata": partial(ardrone_rig, full_navdata=True),
}
"""Every adapter that keeps the contract."""


REAL_TIME = frozenset({"mavsdk"})
"""Those whose library keeps its own clock."""
