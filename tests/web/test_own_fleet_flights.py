"""The station flies drones of one hall by traffic control: the daemon's own tick and mission on real ground
links."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from flightd.adapters.ground_link.client import Address
from flightd.core.types import Phase
from flightd.ground.access.audit import newest_entries
from tests.rigs.event_loops import in_real_time, real
from tests.rigs.paper_drones import hall
from tests.rigs.waiting import until
from tests.web.live_flight import LiveFlight
from tests.web.own_fleet_rig import flown, waiting
from tests.web.served import JSON, served

_SPEED = 5.0


@pytest.mark.realtime(cores=0.8)
def test_a_drone_visits_its_nodes_round_one_that_a_person_took_and_one_that_fell_silent() -> None:
    written: list[tuple[str, str, str, str]] = []

    async def go(flights: dict[str, LiveFlight]) -> None:
        a, b, c = (flights[name] for name in "abc")
        async with flown(flights, _SPEED, written) as fleet:
            await fleet.until_told("flies", lambda flies: flies)
            for drone, nodes in (("b", ["B3"]), ("c", ["B4"]), ("a", ["A3"])):
                asked = await fleet.ask("POST", "/api/fleet/tour", {"nodes": nodes, "drone": drone})
                assert asked == (200, {})
            await until(lambda: c.phase is Phase.FOLLOW and c.at_m[0] < 7.0, 90)
            c.fall_silent()
            await until(lambda: b.phase is Phase.FOLLOW and b.at_m[0] > 2.1, 90)
            b.pace(0.5)  # it comes to B3 no sooner than the act to it
            a.pace(0.5)  # nor is it home before the station knows that the others are not flown
            assert (await fleet.station.act("b", id="by-ann-1", command="pause"))[0] == 200
            await fleet.until_told("drones", lambda told: [n for n in told if told[n]["flown"]] == ["a"])
            a.pace(_SPEED)
            await fleet.until_told("done", lambda done: done == ["A3"])
            await until(lambda: a.phase is Phase.DONE, 120)
            assert "A3" in fleet.passed["a"]
            assert b.phase is Phase.HOLD
            assert (await fleet.ask("POST", "/api/fleet/stop"))[0] == 200
            await until(lambda: b.phase in {Phase.LAND, Phase.ABORTED}, 60)
            assert fleet.judge.faults == []

    with waiting("abc") as flights:
        real(go(flights))
    flown_by = {drone for what, drone, outcome, _ in written if (what, outcome) == ("start", "accepted")}
    assert flown_by == {"a", "b", "c"}


@pytest.mark.realtime(cores=0.8)
def test_two_low_drones_share_a_charge_pad_and_one_flies_on_from_there() -> None:
    async def go(flights: dict[str, LiveFlight]) -> None:
        a, b = (flights[name] for name in "ab")
        a.faults.battery, b.faults.battery = 0.6, 0.9
        async with flown(flights, _SPEED, []) as fleet:

            def has(drone: str, *, taken: bool) -> Callable[[list[dict[str, Any]]], bool]:
                dock = {"pad": "dock-A5", "node": "A5", "drone": drone, "taken": taken}
                return lambda told: told == [dock]

            await fleet.until_told("docks", has("", taken=False))
            assert (await fleet.ask("POST", "/api/fleet/tour", {"nodes": ["A4"], "drone": "a"}))[0] == 200
            await fleet.until_told("docks", has("a", taken=False))
            assert (await fleet.ask("POST", "/api/fleet/tour", {"nodes": ["B3"], "drone": "b"}))[0] == 200
            await until(lambda: b.phase is Phase.FOLLOW, 60)
            b.faults.battery = 0.6
            await fleet.until_told("docks", has("a", taken=True))
            await until(lambda: a.phase is Phase.PREFLIGHT, 60)
            x_m, y_m, z_m = a.at_m
            dock = hall("a").nodes["A5"]
            assert (x_m, y_m) == pytest.approx((dock.x_m, dock.y_m), abs=0.25)
            assert z_m < 0.2
            await until(lambda: b.phase is Phase.DONE, 120)
            assert b.at_m[0] == pytest.approx(0.0, abs=0.25), "on its own pad, for the other one is taken"
            a.faults.battery = 0.9
            assert (await fleet.ask("POST", "/api/fleet/tour", {"nodes": ["A3"]}))[0] == 200
            await fleet.until_told("done", lambda done: "A3" in done)
            await until(lambda: a.phase is Phase.DONE, 120)
            await fleet.until_told("docks", has("", taken=False))
            assert fleet.judge.faults == []

    with waiting("ab", docks=["A5"]) as flights:
        real(go(flights))


@pytest.mark.realtime(cores=0.5)
def test_the_end_of_the_station_leaves_a_drone_that_holds() -> None:
    async def go(flights: dict[str, LiveFlight]) -> None:
        (drone,) = flights.values()
        async with flown(flights, _SPEED, []) as fleet:
            await fleet.until_told("flies", lambda flies: flies)
            assert (await fleet.ask("POST", "/api/fleet/tour", {"nodes": ["A3"]})) == (200, {})
            await until(lambda: drone.phase is Phase.FOLLOW and drone.at_m[0] > 0.3, 90)
        await until(lambda: drone.phase is Phase.HOLD, 60)

    with waiting("a") as flights:
        real(go(flights))


@in_real_time
async def test_without_a_fleet_nothing_is_flown_and_stop_is_there_for_all(tmp_path: Path) -> None:
    nobody = ("north", Address("127.0.0.1", 1, 2))
    async with served(nobody, state=tmp_path) as station:
        own = {"Origin": station.origin, **JSON}
        none = "the station flies no fleet; start it with --fleet"
        assert await station.ask("GET", "/api/fleet") == (
            404,
            json.dumps({"refused": none}, separators=(",", ":")),
        )
        body = json.dumps({"nodes": ["A1"]}).encode()
        assert none in (await station.ask("POST", "/api/fleet/tour", own, body))[1]
        code, said = await station.ask("POST", "/api/fleet/tour", own, b'{"nodes": []}')
        assert (code, "not a tour" in said) == (400, True)
        both = await station.ask("POST", "/api/fleet/value", own, b'{"nodes": 2, "aisles": 1}')
        assert (both[0], "nodes and aisles are given; leave one out" in both[1]) == (400, True)
        code, said = await station.ask("POST", "/api/fleet/stop", own)
        assert (code, "north cannot be reached" in json.loads(said)["refused"]["north"]) == (200, True)
    lines = newest_entries(tmp_path, 9)
    assert [(line["act"], line["target"], line["outcome"]) for line in lines if line["act"] == "stop"] == [
        ("stop", "north", "refused")
    ]
