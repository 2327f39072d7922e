"""A station in a thread of its own beside the browser, whose drones fly on paper."""

from __future__ import annotations

import asyncio
import contextlib
import math
import threading
from collections.abc import AsyncIterator, Callable, Iterator, Sequence
from pathlib import Path
from typing import Any
from unittest import mock

from flightd.adapters.ground_link.client import Address
from flightd.adapters.ground_link.messages.answers import Accepted, Planned, Welcome
from flightd.adapters.ground_link.messages.published import StatusReport
from flightd.core.errors import UnavailableError
from flightd.fleet.vda5050.codec import Version
from flightd.fleet.vehicle.drone_factsheet import Measures
from flightd.ground.drone_link import Pages
from flightd.ground.fleet.own_fleet import OwnFleet
from flightd.ground.ground_store.store import GroundStore
from flightd.ground.messages import Act
from flightd.ground.mqtt.broker_address import read_broker
from flightd.ground.mqtt.fleet_link import FleetLink
from flightd.ground.mqtt.managed_drone import OrderRules
from tests.rigs.broker import Mosquitto
from tests.rigs.event_loops import real
from tests.rigs.paper_drones import PaperDrone, hall
from tests.web.served import Station, served

BODY = Measures(3.0, 1.0, 1.0, 0.6, 0.6, 0.3)
_READY_S = 30.0


class HeldDrone(PaperDrone):
    """It takes every order, and while it is `held` comes no further, whatever the machine's speed."""

    held = True

    def _fly(self) -> None:
        if not self.held:
            super()._fly()


class PaperLink:
    """`DroneLink` to a drone on paper, which is held at first."""

    def __init__(self, name: str, pages: Pages, docks: Sequence[str]) -> None:
        def tell(drone: str, topic: str, value: Any) -> None:
            pages.tell(drone, topic, {"cameras": (), **value} if topic == "welcome" else value)

        self.name = name
        self.drone = HeldDrone(name, hall(name, docks=docks), tell)
        self.on_plan: object = None
        self.attends_run = False
        self.is_reached = True
        self.by_person_at_s = -math.inf
        self.welcome: Welcome | None = None
        self.heard: StatusReport | None = None

    @property
    def on_person(self) -> Callable[[], None]:
        return self.drone.on_person

    @on_person.setter
    def on_person(self, hear: Callable[[], None]) -> None:
        self.drone.on_person = hear

    @property
    def flies(self) -> bool:
        return self.drone.flies

    async def run(self) -> None:
        await self.drone.run()

    async def act(self, act: Act, **how: Any) -> Accepted:
        if not self.is_reached:
            raise UnavailableError(f"{self.name} cannot be reached: no answer")
        return await self.drone.act(act, **how)

    async def plan_flight(self, *asked: Any, **how: Any) -> Planned:
        return await self.drone.plan_flight(*asked, **how)

    async def inventory(self) -> tuple[dict[str, str], ...]:
        return await self.drone.inventory()


class PaperStation:
    """Where it is, and its drones by their names."""

    def __init__(self, docks: Sequence[str] = ()) -> None:
        self._docks = docks
        self.url = ""
        self.links: dict[str, PaperLink] = {}
        self.own: OwnFleet | None = None
        self.ready = threading.Event()
        self.loop: asyncio.AbstractEventLoop | None = None

    def link(self, name: str, _address: Address, pages: Pages) -> PaperLink:
        found = self.links[name] = PaperLink(name, pages, self._docks)
        return found


@contextlib.contextmanager
def paper_station(
    names: Sequence[str],
    folder: Path,
    *,
    fleet: bool = True,
    login: bool = False,
    speed: float = 1.0,
    store: GroundStore | None = None,
    docks: Sequence[str] = (),
) -> Iterator[PaperStation]:
    """It serves meanwhile; `fleet`: it flies its drones itself, which share the pads at `docks`."""
    station = PaperStation(docks)
    ending: list[Callable[[], object]] = []

    async def serving() -> None:
        over = asyncio.Event()
        station.loop = loop = asyncio.get_running_loop()
        ending.append(lambda: loop.call_soon_threadsafe(over.set))
        own = OwnFleet(names, BODY, OrderRules(60.0, lambda *_: None)) if fleet else None
        drones = [(name, Address("127.0.0.1", 1, 2)) for name in names]
        station.own = own
        async with served(
            *drones, folder=folder, state=folder / "state", login=login, own_fleet=own, store=store
        ) as where:
            station.url = _url(where)
            station.ready.set()
            await over.wait()

    with mock.patch("flightd.ground.hub.DroneLink", station.link):
        thread = threading.Thread(target=lambda: real(serving(), speed), name="station", daemon=True)
        thread.start()
        try:
            assert station.ready.wait(_READY_S)
            yield station
        finally:
            for end in ending:
                end()
            thread.join(_READY_S)
            assert not thread.is_alive()


@contextlib.asynccontextmanager
async def managed_drone(broker: Mosquitto, version: Version) -> AsyncIterator[HeldDrone]:
    """The drone `a` on paper, not held, of a station in this loop, which flies it by a manager's orders."""
    station = PaperStation()
    fleet = FleetLink(["a"], read_broker(broker.url), version, BODY, OrderRules(60.0, lambda *_: None))
    with mock.patch("flightd.ground.hub.DroneLink", station.link):
        async with served(("a", Address("127.0.0.1", 1, 2)), fleet=fleet):
            drone = station.links["a"].drone
            drone.held = False
            yield drone


def _url(station: Station) -> str:
    return station.origin
