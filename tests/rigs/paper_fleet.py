"""A station that flies several drones by traffic control: on paper, by virtual time, with a judge."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Callable, Coroutine, Mapping, Sequence
from typing import Any, TypeVar, cast

import pytest

from flightd.core.types import Phase
from flightd.fleet.traffic.cells import CellSize
from flightd.fleet.vehicle.drone_factsheet import Measures
from flightd.ground.fleet.fleet_memory import FleetMemory
from flightd.ground.fleet.own_fleet import OwnFleet
from flightd.ground.hub import Hub
from flightd.ground.mqtt.managed_drone import OrderRules
from flightd.sim.fleet.judge import FleetJudge
from flightd.site.site import Site
from tests.rigs.event_loops import virtual
from tests.rigs.paper_drones import STEP_S, PaperDrone, hall

T = TypeVar("T")
BODY = Measures(3.0, 1.0, 1.0, 0.6, 0.6, 0.3)
_RESTS = {Phase.DONE, Phase.PREFLIGHT}


async def until(condition: Callable[[], Any], within_s: float = 30.0) -> None:
    """Let them fly until it holds.  Fails when it does not in time."""
    for _ in range(round(within_s / STEP_S)):
        if condition():
            return
        await asyncio.sleep(STEP_S)
    pytest.fail(f"not within {within_s:g} s")


class PaperFleet:
    """Drones, who flies them, and a judge; as much of a hub as they need."""

    def __init__(
        self,
        sites: Mapping[str, Site],
        hold_s: float = 20.0,
        memory: FleetMemory | None = None,
        charged_frac: float = 0.0,
    ) -> None:
        self._charged_frac = charged_frac
        self.written: list[tuple[str, str, str, str]] = []
        self._sites, self._memory = sites, memory
        self._rules = OrderRules(hold_s, lambda *line: self.written.append(line))
        self.own = self._station()
        self._running: asyncio.Future[None] | None = None
        self.deciding: asyncio.Event | None = None
        """What is decided comes no sooner."""
        self.decides_s: Callable[[], float] = lambda: 0.0
        """How long it takes."""
        self.pages: dict[tuple[str, str], Any] = {}
        self.drones = {name: PaperDrone(name, site, self._hear) for name, site in sites.items()}
        self.judge = FleetJudge(CellSize(upright_m=100.0), 0.0)

    def _station(self) -> OwnFleet:
        return OwnFleet(self._sites, BODY, self._rules, self.aside, self._memory, self._charged_frac)

    def _hear(self, drone: str, topic: str, value: Any) -> None:
        self.own.tell(drone, topic, value)

    def start(self) -> None:
        """The station, from the beginning."""
        self._running = asyncio.ensure_future(self.own.run(cast(Hub, self)))

    async def kill(self) -> None:
        """The station dies where it stands; nobody is told to hold."""
        assert self._running is not None
        self._running.cancel()
        await asyncio.wait([self._running])
        for drone in self.drones.values():
            drone.on_person = lambda: None
        self.own = self._station()

    def start_again(self) -> None:
        """Another station, which connects to all drones."""
        for drone in self.drones.values():
            drone.welcome()
        self.start()

    async def aside(self, work: Callable[[], T]) -> T:
        """At once, and what comes of it when a test wants it."""
        found = work()
        if (takes_s := self.decides_s()) > 0.0:
            await asyncio.sleep(takes_s)
        if self.deciding is not None:
            await self.deciding.wait()
        return found

    def hold_once_begun(self, patched: pytest.MonkeyPatch) -> None:
        """Nothing more is decided once the fleet has begun by the next map: `deciding` is there by then."""
        begin = FleetMemory.begin

        def begins(*of: Any, **more: Any) -> None:
            begin(*of, **more)
            self.deciding = asyncio.Event()

        patched.setattr(FleetMemory, "begin", begins)

    def tell(self, drone: str, topic: str, value: Any) -> None:
        """As the hub tells its pages."""
        self.pages[drone, topic] = value

    @property
    def state(self) -> dict[str, Any]:
        return self.own.document()

    def flown(self, name: str) -> bool:
        """By traffic."""
        return bool(self.state["drones"][name]["flown"])

    async def watch(self) -> None:
        """Nobody meets anybody, at any time."""
        loop = asyncio.get_running_loop()
        while True:
            self.judge.see(loop.time(), [drone.truth for drone in self.drones.values()], work_left=False)
            await asyncio.sleep(STEP_S)

    @contextlib.asynccontextmanager
    async def flying(self) -> AsyncIterator[None]:
        """The station runs meanwhile."""
        tasks = [asyncio.ensure_future(drone.run()) for drone in self.drones.values()]
        tasks.append(asyncio.ensure_future(self.watch()))
        self.start()
        try:
            await until(lambda: self.state["flies"])
            yield
            assert self.judge.faults == []
        finally:
            assert self._running is not None
            self._running.cancel()
            await asyncio.wait([self._running])
            await self.own.leave()
            for task in tasks:
                task.cancel()
            await asyncio.wait(tasks)


async def on_way_to(node: str, fleet: PaperFleet) -> None:
    """Drone b was asked for that, and is on the last leg there."""
    b = fleet.drones["b"]
    fleet.own.ask([node], "b")
    await until(lambda: b.phase is Phase.FOLLOW and b.way[0] == node, 100)


def at_rest(fleet: PaperFleet) -> bool:
    return all(drone.phase in _RESTS for drone in fleet.drones.values())


async def until_done(fleet: PaperFleet, nodes: str) -> None:
    """All these nodes; who was seen to be done with its flight is made ready for the next one, and what is
    left once nobody flies is asked for again."""
    wanted = set(nodes.split())
    for _ in range(400):
        await asyncio.sleep(1.0)
        if set(fleet.state["done"]) == wanted and at_rest(fleet):
            return
        for name, drone in fleet.drones.items():
            if drone.phase is Phase.DONE and not fleet.flown(name):
                drone.begin_anew()
        if fleet.state["open"] and all(drone.phase is Phase.PREFLIGHT for drone in fleet.drones.values()):
            fleet.own.ask(fleet.state["open"])
    pytest.fail(f"done are {fleet.state['done']}")


def closure(fleet: PaperFleet) -> dict[str, Any]:
    """The only one there is, as the station tells it."""
    (only,) = fleet.state["closed"]
    return dict(only)


def fly(
    go: Callable[[PaperFleet], Coroutine[Any, Any, None]],
    names: str = "abc",
    *,
    counts: bool = False,
    memory: FleetMemory | None = None,
    charged_frac: float = 0.0,
    docks: Sequence[str] = (),
    unattended: bool = False,
) -> PaperFleet:
    """Do `go` while the fleet flies."""
    sites = {name: hall(name, docks=docks, unattended=unattended) for name in names}
    fleet = PaperFleet(sites, memory=memory, charged_frac=charged_frac)
    for drone in fleet.drones.values():
        drone.counts = counts

    async def whole() -> None:
        async with fleet.flying():
            await go(fleet)

    virtual(whole())
    return fleet
