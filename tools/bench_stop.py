"""How long an emergency stop takes from the client's call to the setpoint on the wire, how far apart the
setpoints are, and how late the loop is: undisturbed, and while workers are stopped, killed and answer with
8 MB, as ratios to the undisturbed share of the same process.

A client on real loopback sockets, the ground link, the pilot's own tick at 50 Hz amid a leg, limits, pump
and a UDP socket with a listener.  Each stop is taken by a fresh copy of the same flying pilot.  Detectors and
label readers are processes of the daemon's own pools; the troubles take turns, so that each meets the
machine's other load.

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
from tools.worker_trouble import BusyWorkers, Trouble

CONFIGS = Path(__file__).parents[1] / "configs"
TICK_S = 0.02
WARM_S = 0.3
PROBE_S = 0.01
TURN = 10
"""So many stops with each trouble before the next one has its turn."""


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


class Measured:
    """What was measured with one trouble."""

    def __init__(self, peer: UdpVehicle, clock: ShiftedClock) -> None:
        self.pump = SetpointPump(peer, clock, lambda *_: None)
        self.taken_ms: list[float] = []
        self.late_ms: list[float] = []

    async def probe(self) -> None:
        """How late a timer of the loop is, every 10 ms."""
        loop = asyncio.get_running_loop()
        while True:
            due_s = loop.time() + PROBE_S
            await asyncio.sleep(PROBE_S)
            self.late_ms.append((loop.time() - due_s) * 1e3)

    def figures(self) -> dict[str, dict[str, float]]:
        return {
            "order_to_wire_ms": _quantiles(self.taken_ms),
            "setpoint_interval_ms": self.pump.interval_quantiles_ms(),
            "loop_late_ms": _quantiles(self.late_ms),
        }


def _quantiles(values: list[float]) -> dict[str, float]:
    cuts = statistics.quantiles(values, n=100, method="inclusive")
    return {"p50": round(cuts[49], 2), "p99": round(cuts[98], 2), "max": round(max(values), 2)}


async def _measure(stops: int) -> dict[str, Any]:
    flown = _flying()
    loop = asyncio.get_running_loop()
    transport, listener = await loop.create_datagram_endpoint(Listener, local_addr=("127.0.0.1", 0))
    clock, peer = ShiftedClock(), UdpVehicle(transport.get_extra_info("sockname"))
    config = GroundConfig(listen="127.0.0.1", status_port=0, command_port=0)
    site = load_site(CONFIGS / "site-demo.toml")
    measured = {trouble: Measured(peer, clock) for trouble in Trouble}
    workers = BusyWorkers()
    with ZmqGround(config, site, LoopClock()) as link:
        status_port, command_port = (int(endpoint.rpartition(":")[2]) for endpoint in link.endpoints)
        async with (
            workers.open(),
            GroundClient(Address("127.0.0.1", status_port, command_port), timeout_s=10.0) as client,
            asyncio.TaskGroup() as tasks,
        ):
            serving = tasks.create_task(link.run())
            for first in range(0, stops, TURN):
                for trouble, into in measured.items():
                    async with workers.asked(trouble):
                        for _ in range(min(TURN, stops - first)):
                            await _one_stop(into, flown, clock, link, client, listener)
            serving.cancel()
    transport.close()
    told = {trouble.value: into.figures() for trouble, into in measured.items()}
    return {
        "stops": stops,
        **told,
        "ratios": {name: _ratios(each, told[Trouble.NONE]) for name, each in told.items()},
        "workers": dict(sorted(workers.counts.items())),
        "load": os.getloadavg()[0],
    }


def _ratios(
    figures: dict[str, dict[str, float]], undisturbed: dict[str, dict[str, float]]
) -> dict[str, dict[str, float]]:
    return {
        figure: {share: round(value / undisturbed[figure][share], 2) for share, value in values.items()}
        for figure, values in figures.items()
    }


async def _one_stop(
    into: Measured,
    flown: tuple[Pilot, int, VehicleState],
    clock: ShiftedClock,
    link: ZmqGround,
    client: GroundClient,
    listener: Listener,
) -> None:
    pilot, flown_ns, vehicle = flown
    loop = asyncio.get_running_loop()
    into.pump.set(None)
    flying = copy.deepcopy(pilot)
    clock.set(flown_ns)
    listener.stopped = loop.create_future()
    async with asyncio.TaskGroup() as tasks:
        running = [
            tasks.create_task(_tick(flying, vehicle, link, into.pump, clock)),
            tasks.create_task(into.pump.run()),
            tasks.create_task(into.probe()),
        ]
        await asyncio.sleep(WARM_S + TICK_S * random.random())
        asked_s = loop.time()
        await client.order(CommandKind.STOP, order_id=os.urandom(8).hex())
        async with Within(5.0):
            into.taken_ms.append((await listener.stopped - asked_s) * 1e3)
        for task in running:
            task.cancel()


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
