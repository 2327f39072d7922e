"""Drones of one hall, each with a pad of its own on a spur, in flight on real ground links."""

from __future__ import annotations

import asyncio
import contextlib
import json
import random
import time
from collections.abc import AsyncIterator, Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from flightd.adapters.ground_link.client import Address
from flightd.config.schema import Config, load_config
from flightd.core.types import Phase
from flightd.fleet.traffic.cells import CellSize
from flightd.fleet.vehicle.drone_factsheet import Measures
from flightd.ground.fleet.own_fleet import OwnFleet
from flightd.ground.mqtt.managed_drone import OrderRules
from flightd.sim.fleet.judge import FleetJudge
from flightd.sim.fleet.world import FleetDrone
from tests.rigs.paper_drones import hall
from tests.web.live_flight import LiveFlight
from tests.web.served import JSON, Station, served

CONFIG = load_config(Path(__file__).parents[2] / "configs" / "sim.toml").with_values(
    mission={"autostart": False, "start_countdown_s": 0.0, "dwell_s": 0.5}
)
_LOOK_S = 0.01
_RESTS = frozenset({Phase.PREFLIGHT, Phase.HOLD, Phase.DONE})
BODY = Measures(3.0, 1.0, 1.0, 0.6, 0.6, 0.3)


class Watched:
    """The drones, and a judge who knows where they are."""

    def __init__(self, flights: dict[str, LiveFlight], speed: float) -> None:
        self._speed = speed
        self.flights = flights
        self.judge = FleetJudge(CellSize(upright_m=100.0), 0.0)
        self.passed: dict[str, set[str]] = {name: set() for name in flights}
        """Nodes over which each really was."""
        self._nodes = hall("a").nodes.values()

    async def watch(self) -> None:
        """Look where they are until cancelled.  Who waits flies slowly: that costs, too."""
        loop = asyncio.get_running_loop()
        rested: dict[str, bool] = {}
        while True:
            seen = []
            for name, flight in self.flights.items():
                if rested.get(name) is not (rests := flight.phase in _RESTS):
                    rested[name] = rests
                    flight.pace(1.0 if rests else self._speed)
                drone = FleetDrone(name, 0, random.Random(0))
                drone.x_m, drone.y_m, drone.z_m = flight.at_m
                seen.append(drone)
                if drone.z_m > 1.0:
                    self.passed[name] |= {
                        node.id
                        for node in self._nodes
                        if max(abs(node.x_m - drone.x_m), abs(node.y_m - drone.y_m)) < 0.3
                    }
            self.judge.see(loop.time(), seen, work_left=False)
            await asyncio.sleep(_LOOK_S)


class Fleet(Watched):
    """The same, and a station that flies them."""

    def __init__(self, flights: dict[str, LiveFlight], station: Station, speed: float) -> None:
        super().__init__(flights, speed)
        self.station = station

    async def ask(self, method: str, path: str, told: Any = None) -> tuple[int, dict[str, Any]]:
        """The station's answer."""
        body = b"" if told is None else json.dumps(told).encode()
        code, text = await self.station.ask(method, path, {"Origin": self.station.origin, **JSON}, body)
        return code, json.loads(text)

    async def until_told(self, key: str, holds: Callable[[Any], bool], within_s: float = 120.0) -> None:
        """The station tells it so of its fleet.  Fails where it does not in time."""
        last_s = time.monotonic() + within_s
        while not holds((told := await self.state())[key]):
            assert time.monotonic() < last_s, f"{key} in {within_s:g} s: {told}"
            await asyncio.sleep(30 * _LOOK_S)

    async def state(self) -> dict[str, Any]:
        """As the station tells it."""
        return (await self.ask("GET", "/api/fleet"))[1]


@contextlib.asynccontextmanager
async def flown(
    flights: dict[str, LiveFlight], speed: float, written: list[tuple[str, str, str, str]]
) -> AsyncIterator[Fleet]:
    """A station flies them meanwhile."""
    own = OwnFleet(flights, BODY, OrderRules(60.0, lambda *line: written.append(line)))
    drones = [(name, Address("127.0.0.1", *flight.ports)) for name, flight in flights.items()]
    async with served(*drones, own_fleet=own) as station:
        fleet = Fleet(flights, station, speed)
        watching = asyncio.ensure_future(fleet.watch())
        try:
            yield fleet
        finally:
            watching.cancel()


@contextlib.contextmanager
def waiting(
    names: Sequence[str], config: Config = CONFIG, docks: Sequence[str] = ()
) -> Iterator[dict[str, LiveFlight]]:
    """The drones, on their pads; those at the nodes `docks` they share."""
    with contextlib.ExitStack() as stack:
        sites = {name: hall(name, docks=docks) for name in names}
        yield {name: stack.enter_context(LiveFlight(site, config, speed=1.0)) for name, site in sites.items()}
