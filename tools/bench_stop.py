"""How long an emergency stop takes from the client's call to the setpoint on the wire.

A client on real loopback sockets, the ground link, the pilot's own tick at 50 Hz amid a leg, limits, pump
and a UDP socket with a listener.  Each stop is taken by a fresh copy of the same flying pilot.

python -m tools.bench_stop [--stops N]
"""

from __future__ import annotations

import argparse
import asyncio
import copy
import json
import os
import random
import socket
import statistics
import struct
from dataclasses import replace
from pathlib import Path
from typing import Any

from flightd.adapters.ground_link.client import Address, GroundClient
from flightd.adapters.ground_link.link import ZmqGround
from flightd.app.setpoint_pump import SetpointPump
from flightd.config.ground import GroundConfig
from flightd.config.schema import load_config
from flightd.core.tick import TickInput
from flightd.core.types import Attitude, AttitudeSetpoint, CommandKind, Demand, Event, Phase, VehicleState
from flightd.pilot import Pilot
from flightd.runtime.clock import LoopClock
from flightd.runtime.within import Within
from flightd.site.site_file import load_site
from tests.sim.ideal.ideal_flight import IdealFlight

CONFIGS = Path(__file__).parents[1] / "configs"
TICK_S = 0.02
WARM_S = 0.06


class ShiftedClock:
    """The loop's clock, set to any time."""

    def __init__(self) -> None:
        self._clock = LoopClock()
        self._shift_ns = 0

    def now_ns(self) -> int:
        return self._clock.now_ns() + self._shift_ns

    def set(self, now_ns: int) -> None:
        self._shift_ns = now_ns - self._clock.now_ns()


class UdpVehicle:
    """Sends each setpoint as a datagram."""

    def __init__(self, to: tuple[str, int]) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.connect(to)

    async def run(self) -> None: ...

    def state(self) -> VehicleState | None:
        return None

    def attitudes(self) -> list[Attitude]:
        return []

    def demand(self, demand: Demand) -> None: ...

    def send(self, setpoint: AttitudeSetpoint) -> bool:
        self._socket.send(struct.pack("<3d", setpoint.roll_rad, setpoint.pitch_rad, setpoint.climb_mps))
        return True

    def notify(self, event: Event) -> None: ...


class Listener(asyncio.DatagramProtocol):
    """The vehicle's end: when the first level and sinking setpoint after `listen` came."""

    def __init__(self) -> None:
        self.stopped: asyncio.Future[float] | None = None

    def datagram_received(self, data: bytes, _addr: object) -> None:
        roll_rad, pitch_rad, climb_mps = struct.unpack("<3d", data)
        level = roll_rad == pitch_rad == 0.0 and climb_mps < 0.0
        if level and self.stopped is not None and not self.stopped.done():
            self.stopped.set_result(asyncio.get_running_loop().time())


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", maxsplit=1)[0])
    parser.add_argument("--stops", type=int, default=200)
    print(json.dumps(asyncio.run(_measure(parser.parse_args().stops)), indent=1))


def _flying() -> tuple[Pilot, int, VehicleState]:
    """A pilot amid a leg, its time and what it last heard from the vehicle."""
    site = load_site(CONFIGS / "site-demo.toml")
    flight = IdealFlight(site, load_config(CONFIGS / "sim.toml"), visits=("A4",))
    step = flight.pilot.step
    last: list[TickInput] = []

    def watch(tick: TickInput) -> Any:
        last[:] = [tick]
        return step(tick)

    flight.pilot.step = watch  # type: ignore[method-assign]
    while flight.pilot.mission.phase is not Phase.FOLLOW or flight.airframe.x_m < 1.0:
        flight.fly(1.0)
    del flight.pilot.step
    vehicle = last[0].vehicle
    assert vehicle is not None
    return flight.pilot, last[0].now_ns, vehicle


async def _measure(stops: int) -> dict[str, Any]:
    pilot, flown_ns, vehicle = _flying()
    loop = asyncio.get_running_loop()
    transport, listener = await loop.create_datagram_endpoint(Listener, local_addr=("127.0.0.1", 0))
    clock, peer = ShiftedClock(), UdpVehicle(transport.get_extra_info("sockname"))
    config = GroundConfig(listen="127.0.0.1", status_port=0, command_port=0)
    site = load_site(CONFIGS / "site-demo.toml")
    taken_ms = []
    with ZmqGround(config, site, LoopClock()) as link:
        status_port, command_port = (int(endpoint.rpartition(":")[2]) for endpoint in link.endpoints)
        pump = SetpointPump(peer, clock, lambda *_: None)
        async with (
            GroundClient(Address("127.0.0.1", status_port, command_port), timeout_s=10.0) as client,
            asyncio.TaskGroup() as tasks,
        ):
            services = [tasks.create_task(link.run()), tasks.create_task(pump.run())]
            for _ in range(stops):
                pump.set(None)
                flying = copy.deepcopy(pilot)
                clock.set(flown_ns)
                listener.stopped = loop.create_future()
                ticking = tasks.create_task(_tick(flying, vehicle, link, pump, clock))
                await asyncio.sleep(WARM_S + TICK_S * random.random())
                asked_s = loop.time()
                await client.order(CommandKind.STOP, order_id=os.urandom(8).hex())
                async with Within(5.0):
                    taken_ms.append((await listener.stopped - asked_s) * 1e3)
                ticking.cancel()
            for service in services:
                service.cancel()
    transport.close()
    cuts = statistics.quantiles(taken_ms, n=100)
    return {
        "stops": stops,
        "order_to_wire_ms": {
            "p50": round(cuts[49], 2),
            "p99": round(cuts[98], 2),
            "max": round(max(taken_ms), 2),
        },
        "load": os.getloadavg()[0],
    }


async def _tick(
    pilot: Pilot, vehicle: VehicleState, link: ZmqGround, pump: SetpointPump, clock: ShiftedClock
) -> None:
    """The daemon's tick, the vehicle standing still in the air."""
    loop = asyncio.get_running_loop()
    due_s = loop.time()
    while True:
        due_s += TICK_S
        await asyncio.sleep(due_s - loop.time())
        now_ns = clock.now_ns()
        attitude = replace(vehicle.attitude, stamp_ns=now_ns)
        state = replace(vehicle, attitude=attitude, height_stamp_ns=now_ns, heartbeat_ns=now_ns)
        output = pilot.step(TickInput(now_ns, (), state, (attitude,), tuple(link.take_commands())))
        pump.set(output.setpoint)


if __name__ == "__main__":
    main()
