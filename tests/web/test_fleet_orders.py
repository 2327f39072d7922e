"""A fleet's manager flies a drone: the daemon's own tick and mission on a real ground link, a real broker."""

from __future__ import annotations

import json
from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import Any

import pytest

from flightd.adapters.ground_link.client import Address
from flightd.config.schema import load_config
from flightd.core.types import Phase
from flightd.fleet.vda5050.codec import Version, encoded
from flightd.fleet.vda5050.parts import BlockingType
from flightd.fleet.vehicle.drone_factsheet import Measures
from flightd.ground.mqtt.broker_address import read_broker
from flightd.ground.mqtt.fleet_link import FleetLink
from flightd.ground.mqtt.managed_drone import OrderRules
from flightd.site.site_file import load_site
from tests.rigs.brisk import BRISK
from tests.rigs.broker import Mosquitto, mosquitto
from tests.rigs.event_loops import real
from tests.rigs.waiting import until
from tests.sim.ideal.ideal_front import IdealFront, Stock
from tests.unit.fleet.vehicle_rig import instant, order, scan
from tests.unit.mission.shelves import FITTED, SIGHT
from tests.web.fleet_manager import Manager, and_a_turn
from tests.web.live_flight import LiveFlight
from tests.web.served import JSON, Station, served

CONFIGS = Path(__file__).parents[2] / "configs"
SITE = load_site(CONFIGS / "site-demo.toml")
CONFIG = load_config(CONFIGS / "sim.toml").with_values(
    mission={**BRISK, "autostart": False, "start_countdown_s": 0.0, "dwell_s": 1.0}
)
RACKS = load_site(CONFIGS / "site-racks-small.toml")
BODY = Measures(3.0, 1.0, 1.0, 0.6, 0.6, 0.3)


class Master(Manager):
    """It orders."""

    async def order(self, way: str, released: int = 99, **more: Any) -> None:
        await self.say("order", encoded(order(way, released, **more), self._version))

    async def instant(self, kind: str, name: str = "") -> None:
        await self.say("instantActions", encoded(instant(kind, name), self._version))

    @property
    def ahead(self) -> str:
        """The nodes ahead; those of the horizon in brackets."""
        nodes = self.last("state").get("nodeStates", [])
        return " ".join(one["nodeId"] if one["released"] else f"({one['nodeId']})" for one in nodes)

    @property
    def actions(self) -> dict[str, str]:
        """All actions, and how far they are."""
        state = self.last("state")
        told = [*state["actionStates"], *state.get("instantActionStates", ())]
        return {one["actionId"]: one["actionStatus"] for one in told}

    @property
    def mode(self) -> str:
        """Who is in control."""
        return str(self.last("state").get("operatingMode"))

    @property
    def errors(self) -> list[str]:
        """Their types."""
        return [one["errorType"] for one in self.last("state")["errors"]]

    def was(self, since: int, **told: Any) -> bool:
        """Some state from that number on told so: what passes may have passed before one looks."""
        return any(told.items() <= state.items() for state in self.of("state")[since:])

    def is_at(self, node: str) -> bool:
        """It was there last, and stands."""
        state = self.last("state")
        return state.get("lastNodeId") == node and not state["driving"]


async def hand_over(station: Station, *, to_manager: bool, drone: str = "demo") -> None:
    """By a person at the page."""
    body = json.dumps({"flies": to_manager}).encode()
    code, _ = await station.ask("POST", f"/drones/{drone}/manager", {"Origin": station.origin, **JSON}, body)
    assert code == (200 if drone == "demo" else 400)


def managed(
    folder: Path,
    flight: LiveFlight,
    go: Callable[[Station, Master, Mosquitto], Coroutine[Any, Any, None]],
    written: list[tuple[str, str, str, str]],
    hold_s: float = 60.0,
    version: Version = Version.V3_0,
) -> None:
    """Let the drone `demo` be flown by orders, of a master who does `go`."""

    async def whole(broker: Mosquitto) -> None:
        rules = OrderRules(hold_s, lambda *line: written.append(line))
        fleet = FleetLink(["demo"], read_broker(broker.url), version, BODY, rules)
        master = Master(version)
        demo = ("demo", Address("127.0.0.1", *flight.ports))
        async with master.watching(broker), served(demo, fleet=fleet) as station:
            await go(station, master, broker)

    with mosquitto(folder) as broker:
        real(and_a_turn(whole(broker)))


@pytest.mark.realtime(cores=0.7)
def test_a_manager_flies_a_drone_until_a_person_stops_it(tmp_path: Path) -> None:
    written: list[tuple[str, str, str, str]] = []

    async def go(flight: LiveFlight, station: Station, master: Master) -> None:
        between = (SITE.nodes["A4"].x_m + SITE.nodes["A5"].x_m) / 2
        await until(lambda: master.mode == "AUTOMATIC" and master.is_at("A1"))
        await master.order("A1 A2 A3 A4 A5", 4)
        await until(lambda: master.was(0, lastNodeId="A2"), 60)
        await until(lambda: master.is_at("A4") and flight.phase is Phase.HOLD, 60)
        assert (master.ahead, master.last("state")["newBaseRequest"]) == ("(A5)", True)

        await master.order("A4 A5 A6", number=1, first=6)
        await until(lambda: flight.x_m > between, 60)
        await master.instant("startPause")
        await until(lambda: master.last("state")["paused"] and flight.phase is Phase.HOLD, 60)
        await until(lambda: not master.last("state")["driving"], 60)
        assert (master.ahead, master.last("state")["lastNodeId"]) == ("A5 A6", "A4")
        paused = len(master.of("state"))
        await master.instant("stopPause")
        await until(lambda: master.was(paused, driving=True), 60)
        await master.instant("cancelOrder")
        await until(lambda: master.actions.get("cancelOrder") == "FINISHED", 60)
        assert (master.ahead, master.is_at("A5")) == ("", True)

        await master.order("A5 A4 A3", name="back", actions={"A5": [scan("shelf")]})
        await until(lambda: master.actions.get("shelf") == "FAILED", 60)
        (shelf,) = master.last("state")["actionStates"]
        assert shelf["actionResult"] == "this drone counts no shelves"
        counted = len(master.of("state"))
        await until(lambda: master.was(counted, driving=True), 60)
        await hand_over(station, to_manager=False)
        await until(lambda: master.mode == "MANUAL" and master.ahead == "")
        await master.order("A5 A4", name="refused")
        await until(lambda: master.errors == ["MOBILE_ROBOT_NOT_AVAILABLE"])
        await hand_over(station, to_manager=True, drone="other")
        await hand_over(station, to_manager=True)
        await until(lambda: master.mode == "AUTOMATIC" and flight.phase is Phase.HOLD, 60)

        assert (await station.act("demo", id="stop-0001", command="stop"))[0] == 200
        await until(lambda: master.mode == "MANUAL")
        await until(lambda: flight.phase in {Phase.LAND, Phase.ABORTED}, 60)

    with LiveFlight(SITE, CONFIG, speed=4.0) as flight:
        managed(tmp_path, flight, lambda station, master, _: go(flight, station, master), written)
    assert ("order o/1: A4 A5 A6", "demo", "accepted", "") in written
    assert ("goto A5", "demo", "accepted", "") in written
    refused = [(act, why.partition(":")[0]) for act, _, outcome, why in written if outcome == "refused"]
    assert refused == [("order refused/0: A5 A4", "MOBILE_ROBOT_NOT_AVAILABLE")]


@pytest.mark.realtime(cores=0.7)
def test_by_version_2_1_a_shelf_is_counted_and_without_a_broker_the_drone_holds_and_comes_home(
    tmp_path: Path,
) -> None:
    written: list[tuple[str, str, str, str]] = []

    async def go(flight: LiveFlight, master: Master, broker: Mosquitto) -> None:
        await until(lambda: master.mode == "AUTOMATIC" and master.is_at("A1"))
        await master.order("A1 A2 A3", 2, actions={"A2": [scan("shelf", levels=[1])]})
        await until(lambda: master.actions.get("shelf") == "FINISHED", 60)
        await until(lambda: flight.phase is Phase.HOLD, 60)
        assert (master.last("state")["lastNodeId"], master.ahead) == ("A2", "(A3)")
        broker.kill()  # its base is flown: it holds, and then comes home
        await until(lambda: ("home", "demo", "accepted", "") in written, 60)

    config = CONFIG.with_values(front_camera=FITTED)
    with LiveFlight(RACKS, config, speed=6.0, front=IdealFront(RACKS, SIGHT, Stock())) as flight:
        two = Version.V2_1
        managed(tmp_path, flight, lambda _, master, broker: go(flight, master, broker), written, 2.0, two)


@pytest.mark.realtime(cores=0.7)
def test_an_order_counts_at_each_node_the_side_and_levels_that_it_asks_for_there_and_nothing_else(
    tmp_path: Path,
) -> None:
    low, right = scan("low", levels=[1]), scan("right", levels=[1, 2], side="right")
    more = [scan("high", BlockingType.SOFT, levels=[2]), scan("all", BlockingType.SOFT, levels=[1, 2])]

    async def go(flight: LiveFlight, master: Master) -> None:
        await until(lambda: master.mode == "AUTOMATIC" and master.is_at("A1"))
        await master.order("A1 A2 A3", 2, actions={"A2": [low]})
        await until(lambda: master.actions.get("low") == "FINISHED", 60)
        assert flight.counted == hangs("A2", "left", 1)
        await master.order("A2 A3", number=1, first=2, actions={"A3": [right]})
        await until(lambda: master.actions.get("right") == "FINISHED", 60)
        two = hangs("A2", "left", 1) | hangs("A3", "right", 1, 2)
        assert flight.counted == two
        await until(lambda: flight.phase is Phase.HOLD, 60)
        await master.order("A3 A4", name="left of it", actions={"A3": more})
        await until(lambda: master.actions == {"high": "FINISHED", "all": "FINISHED"}, 60)
        assert flight.counted == two | hangs("A3", "left", 1, 2), "it is asked for where the drone is already"
        await until(lambda: master.is_at("A4") and flight.phase is Phase.HOLD, 60)
        assert flight.counted == two | hangs("A3", "left", 1, 2)

    def hangs(node: str, side: str, *levels: int) -> frozenset[str]:
        here = (one for one in RACKS.locations.values() if (one.node, one.side) == (node, side))
        return frozenset(one.code for one in here if one.level in levels)

    config = CONFIG.with_values(front_camera=FITTED)
    with LiveFlight(RACKS, config, speed=6.0, front=IdealFront(RACKS, SIGHT, Stock())) as flight:
        managed(tmp_path, flight, lambda _, master, __: go(flight, master), [])
