"""One emulated drone and its adapter on loopback sockets, in virtual time."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Awaitable, Callable
from typing import Any, TypeVar

from flightd.adapters.vehicle.ardrone.settings import ArDroneSettings
from flightd.adapters.vehicle.ardrone.vehicle import ArDroneVehicle
from flightd.core.types import AttitudeSetpoint, Demand, VehicleState
from flightd.runtime.clock import LoopClock
from flightd.runtime.within import Within
from flightd.sim.ardrone.at_commands import DroneCommand, parse
from flightd.sim.ardrone.drone import Drone
from flightd.sim.ardrone.server import ArDroneServer, DronePorts
from flightd.sim.ardrone.states import DroneOptions
from flightd.sim.autopilot.radio import PERFECT, RadioParams
from flightd.sim.plant.airframe import Airframe
from flightd.sim.sensors.instruments import SensorParams, Sensors
from tests.rigs.waiting import until

T = TypeVar("T")

ANY_PORTS = DronePorts(at=0, navdata=0, video=0, control=0)


def make_drone(
    options: DroneOptions | None = None, *, battery_frac: float = 1.0, sensors: SensorParams | None = None
) -> Drone:
    return Drone(Airframe(seed=1, battery_frac=battery_frac), Sensors(sensors, seed=1), options)


class Ear:
    """Writes down every command that reaches the drone, and may swallow some."""

    def __init__(self, drone: Drone, lose: Callable[[DroneCommand], bool] = lambda _command: False) -> None:
        self.commands: list[tuple[int, DroneCommand]] = []
        obey = drone.command

        def hear(datagram: bytes, now_ns: int) -> None:
            self.commands += [(now_ns, command) for command in parse(datagram)]
            if not any(lose(command) for command in parse(datagram)):
                obey(datagram, now_ns)

        drone.command = hear  # type: ignore[method-assign]

    def named(self, *names: str) -> list[DroneCommand]:
        return [command for _, command in self.commands if command.name in names]


class Bench:
    """The running pair, and the daemon's 50 Hz tick."""

    def __init__(self, server: ArDroneServer, vehicle: ArDroneVehicle, clock: LoopClock) -> None:
        self.server = server
        self.drone = server.drone
        self.vehicle = vehicle
        self.clock = clock
        self.sent: list[bool] = []

    @property
    def state(self) -> VehicleState:
        state = self.vehicle.state()
        assert state is not None
        return state

    async def until(self, condition: Callable[[], Any], limit_s: float = 20.0) -> float:
        """Wait for the condition; the seconds it took.  Fails when it takes longer than `limit_s`."""
        return await until(condition, limit_s)

    async def steer(
        self,
        duration_s: float,
        *,
        roll_rad: float = 0.0,
        pitch_rad: float = 0.0,
        yaw_rate_radps: float = 0.0,
        climb_mps: float = 0.0,
        while_: Callable[[], Any] = lambda: True,
    ) -> None:
        """Send one setpoint every 20 ms for so long."""
        end_ns = self.clock.now_ns() + round(duration_s * 1e9)
        while self.clock.now_ns() < end_ns and while_():
            setpoint = AttitudeSetpoint(self.clock.now_ns(), roll_rad, pitch_rad, yaw_rate_radps, climb_mps)
            self.sent.append(self.vehicle.send(setpoint))
            await asyncio.sleep(0.02)

    async def configured(self) -> None:
        self.vehicle.demand(Demand.STANDBY)
        await self.until(lambda: self.vehicle.camera_since_ns is not None)

    async def hovering(self) -> None:
        """Take off and wait until the drone hovers."""
        await self.configured()
        self.vehicle.demand(Demand.FLY)
        await self.until(lambda: self.vehicle.state() is not None and self.state.mode == "hovering")


@contextlib.asynccontextmanager
async def bench(
    drone: Drone | None = None, air: RadioParams = PERFECT, **settings: Any
) -> AsyncIterator[Bench]:
    """A served drone and a running adapter; both end with the block."""
    clock = LoopClock()
    async with ArDroneServer(drone or make_drone(), clock, ANY_PORTS, air=air) as server:
        vehicle = ArDroneVehicle(settings_for(server, **settings), clock)
        tasks = [asyncio.create_task(server.run()), asyncio.create_task(vehicle.run())]
        try:
            yield Bench(server, vehicle, clock)
        finally:
            await ended(tasks[1])
            await ended(tasks[0])


def settings_for(server: ArDroneServer, **more: Any) -> ArDroneSettings:
    ports = server.ports
    return ArDroneSettings(
        host=ports.host,
        at_port=ports.at,
        navdata_port=ports.navdata,
        video_port=ports.video,
        control_port=ports.control,
        **more,
    )


async def ended(task: asyncio.Task[None]) -> None:
    """Cancel and await; what the task died of comes out here."""
    task.cancel()
    with contextlib.suppress(asyncio.CancelledError):
        await task


async def settled(awaitable: Awaitable[T], limit_s: float = 10.0) -> T:
    async with Within(limit_s):
        return await awaitable
