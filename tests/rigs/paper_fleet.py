"""A station that flies several drones by traffic control: on paper, by virtual time, with a judge."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Callable, Coroutine, Mapping
from typing import Any, TypeVar, cast

import pytest

from flightd.core.types import Phase
from flightd.fleet.traffic.cells import CellSize
from flightd.fleet.vehicle.drone_factsheet import Measures
from flightd.ground.fleet.own_fleet import OwnFleet
from flightd.ground.hub import Hub
from flightd.ground.mqtt.managed_drone import OrderRules
from flightd.sim.fleet.judge import FleetJudge
from flightd.site.site import Site
from tests.rigs.event_loops import virtual
from tests.rigs.paper_drones import STEP_S, PaperDrone, hall

T = TypeVar("T")
BODY = Measures(3.0, 1.0, 1.0, 0.6, 0.6, 0.3)


async def until(condition: Callable[[], Any], within_s: float = 30.0) -> None:
    """Let them fly until it holds.  Fails when it does not in time."""
    for _ in range(round(within_s / STEP_S)):
        if condition():
            return
        await asyncio.sleep(STEP_S)
    pytest.fail(f"not within {within_s:g} s")


class PaperFleet:
    """Drones, who flies them, and a judge; as much of a hub as they need."""

    def __init__(self, sites: Mapping[str, Site], hold_s: float = 20.0) -> None:
        self.written: list[tuple[str, str, str, str]] = []
        self.own = OwnFleet(
            sites, BODY, OrderRules(hold_s, lambda *line: self.written.append(line)), self.aside
        )
        self.deciding: asyncio.Event | None = None
        """What is decided comes no sooner."""
        self.pages: dict[tuple[str, str], Any] = {}
        self.drones = {name: PaperDrone(name, site, self.own.tell) for name, site in sites.items()}
        self.judge = FleetJudge(CellSize(upright_m=100.0), 0.0)

    async def aside(self, work: Callable[[], T]) -> T:
        """At once, and what comes of it when a test wants it."""
        found = work()
        if self.deciding is not None:
            await self.deciding.wait()
        return found

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
        hub = cast(Hub, self)
        tasks = [asyncio.ensure_future(drone.run()) for drone in self.drones.values()]
        tasks += [asyncio.ensure_future(self.watch()), asyncio.ensure_future(self.own.run(hub))]
        try:
            await until(lambda: self.state["flies"])
            yield
            assert self.judge.faults == []
        finally:
            tasks[-1].cancel()
            await asyncio.wait(tasks[-1:])
            await self.own.leave()
            for task in tasks[:-1]:
                task.cancel()
            await asyncio.wait(tasks)


async def on_way_to(node: str, fleet: PaperFleet) -> None:
    """Drone b was asked for that, and is on the last leg there."""
    b = fleet.drones["b"]
    fleet.own.ask([node], "b")
    await until(lambda: b.phase is Phase.FOLLOW and b.way[0] == node, 100)


def fly(
    go: Callable[[PaperFleet], Coroutine[Any, Any, None]], names: str = "abc", *, counts: bool = False
) -> PaperFleet:
    """Do `go` while the fleet flies."""
    fleet = PaperFleet({name: hall(name) for name in names})
    for drone in fleet.drones.values():
        drone.counts = counts

    async def whole() -> None:
        async with fleet.flying():
            await go(fleet)

    virtual(whole())
    return fleet
