"""People close an aisle to a station's drones, and open it: on paper, by virtual time."""

from __future__ import annotations

import asyncio
import contextlib
import math
import os
import random
import sqlite3
from pathlib import Path

import pytest

from flightd.core.errors import UnavailableError
from flightd.core.types import CommandKind, Phase
from flightd.ground.fleet.fleet_memory import FILE, FleetMemory
from flightd.ground.messages import Act
from tests.rigs.paper_fleet import PaperFleet, at_rest, closure, fly, on_way_to, until, until_done

SEEDS = int(os.environ.get("FLIGHTD_WALKS", "4"))
_TO_NEXT_NODE_S = 4.0
_CROSSINGS_M = (2.0, 5.2)
"""Aisle A lies between these, at y = 0."""


def entered(fleet: PaperFleet) -> set[str]:
    """The drones that are within aisle A, beyond its crossings, now."""
    low_m, high_m = _CROSSINGS_M
    return {
        name
        for name, drone in fleet.drones.items()
        if drone.truth.z_m > 0.0 and low_m + 0.2 < drone.truth.x_m < high_m - 0.2 and drone.truth.y_m < 0.5
    }


async def stays_empty(fleet: PaperFleet) -> None:
    """Look until cancelled."""
    while True:
        assert entered(fleet) == set()
        await asyncio.sleep(0.1)


def test_nobody_flies_into_a_closed_aisle_until_it_is_opened() -> None:
    async def go(fleet: PaperFleet) -> None:
        assert await fleet.own.close("ann", aisle="A") == "A"
        assert closure(fleet)["inside"] is None, "not looked yet"
        fleet.own.ask(["A3", "B3"])
        watching = asyncio.ensure_future(stays_empty(fleet))
        await until(lambda: fleet.state["done"] == ["B3"] and at_rest(fleet), 200)
        watching.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await watching
        assert fleet.state["not_done"] == {"A3": "aisle A is closed"}
        told = closure(fleet)
        assert (told["name"], told["by"], told["inside"]) == ("A", "ann", ())
        assert set(told["ways"]) == {("A2", "A3"), ("A3", "A4"), ("A4", "A5")}, "who stands on A1 comes home"
        await fleet.own.open("A")
        await until(lambda: fleet.state["closed"] == [])
        await until_done(fleet, "A3 B3")

    fly(go)


def test_who_is_in_it_turns_at_the_next_node_and_leaves() -> None:
    async def go(fleet: PaperFleet) -> None:
        a = fleet.drones["a"]
        fleet.own.ask(["A4"], "a")
        await until(lambda: a.phase is Phase.FOLLOW and a.way[0] == "A3" and entered(fleet), 100)
        await fleet.own.close("ann", aisle="A")
        await until(lambda: closure(fleet)["inside"] == ("a",), 5)
        furthest_m = 0.0
        while a.phase is not Phase.DONE:
            furthest_m = max(furthest_m, a.truth.x_m)
            await asyncio.sleep(0.1)
        assert (a.truth.x_m, furthest_m) == (0.0, a.site.nodes["A3"].x_m)
        assert "home" not in a.commands
        assert "A4" in fleet.state["not_done"]
        await until(lambda: closure(fleet)["inside"] == (), 5)

    fly(go, "ab")


def test_who_is_in_it_turns_whatever_is_still_to_be_decided() -> None:
    async def go(fleet: PaperFleet) -> None:
        a = fleet.drones["a"]
        fleet.own.ask(["A4"], "a")
        await until(lambda: a.phase is Phase.FOLLOW and a.way[0] == "A3" and entered(fleet), 100)
        await fleet.own.close("ann", aisle="A")
        fleet.deciding = asyncio.Event()
        await asyncio.sleep(30.0)
        assert (a.phase, a.truth.x_m) == (Phase.HOLD, a.site.nodes["A3"].x_m)
        fleet.deciding.set()
        await until(lambda: a.phase is Phase.DONE, 100)

    fly(go, "a")


def test_who_was_only_released_into_it_does_not_go_in() -> None:
    async def go(fleet: PaperFleet) -> None:
        a = fleet.drones["a"]
        fleet.own.ask(["A3"], "a")
        await until(lambda: a.phase is Phase.FOLLOW and a.way[0] == "A2", 100)
        assert "A3" in fleet.state["drones"]["a"]["base"]
        await fleet.own.close("ann", aisle="A")
        watching = asyncio.ensure_future(stays_empty(fleet))
        await until(lambda: a.phase is Phase.DONE, 100)
        watching.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await watching
        assert fleet.state["not_done"] == {"A3": "aisle A is closed"}

    fly(go, "ab")


def test_it_stays_closed_over_the_end_of_stations_and_who_was_in_it_leaves(tmp_path: Path) -> None:
    memory = FleetMemory(tmp_path)

    async def go(fleet: PaperFleet) -> None:
        a = fleet.drones["a"]
        fleet.own.ask(["A3"], "a")
        await until(lambda: a.phase is Phase.FOLLOW and entered(fleet), 100)
        await fleet.own.close("ann", aisle="A")
        await fleet.kill()
        fleet.start_again()
        await until(lambda: fleet.state["flies"])
        await until(lambda: a.phase is Phase.DONE and a.truth.x_m == 0.0, 100)
        assert closure(fleet)["by"] == "ann"
        await asyncio.sleep(1.0)
        a.begin_anew()
        fleet.own.ask(["A3", "B3"])
        await until(lambda: fleet.state["done"] == ["B3"] and at_rest(fleet), 200)
        await asyncio.sleep(1.0)
        assert fleet.state["not_done"] == {"A3": "aisle A is closed"}
        await fleet.kill()
        fleet.start_again()
        await until(lambda: fleet.state["flies"])
        await fleet.own.open("A")
        await fleet.kill()
        fleet.start_again()
        await until(lambda: fleet.state["flies"])
        assert fleet.state["closed"] == []
        fleet.own.ask(["A3"])
        await until_done(fleet, "A3 B3")

    fly(go, memory=memory)


@pytest.mark.parametrize("seed", range(SEEDS))
def test_whatever_happens_nobody_enters_what_is_closed_and_all_come_home(tmp_path: Path, seed: int) -> None:
    rng = random.Random(seed)

    async def go(fleet: PaperFleet) -> None:
        closed_s = math.inf
        inside: set[str] = set()

        async def looks() -> None:
            nonlocal inside
            while True:
                now = entered(fleet)
                if asyncio.get_running_loop().time() - closed_s > _TO_NEXT_NODE_S:
                    assert now <= inside, "it came in"
                inside = now
                await asyncio.sleep(0.1)

        looking = asyncio.ensure_future(looks())
        fleet.own.ask(["A2", "A3", "A4", "B3", "B4"])
        for _ in range(4):
            await asyncio.sleep(rng.uniform(2.0, 20.0))
            await fleet.own.close("ann", aisle="A")
            closed_s = asyncio.get_running_loop().time()
            if rng.random() < 0.5:
                await asyncio.sleep(rng.uniform(0.0, 10.0))
                await fleet.kill()
                await asyncio.sleep(rng.uniform(0.1, 10.0))
                fleet.start_again()
            await asyncio.sleep(rng.uniform(20.0, 60.0))
            assert not looking.done(), looking.result()
            closed_s = math.inf
            await fleet.own.open("A")
        await until_done(fleet, "A2 A3 A4 B3 B4")
        looking.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await looking

    fleet = fly(go, memory=FleetMemory(tmp_path))
    assert {drone.truth.z_m for drone in fleet.drones.values()} == {0.0}


def test_it_stays_closed_for_another_fleet_and_another_flightd(tmp_path: Path) -> None:
    async def close(fleet: PaperFleet) -> None:
        await fleet.own.close("ann", aisle="A")

    fly(close, "ab", memory=FleetMemory(tmp_path))
    with sqlite3.connect(tmp_path / FILE) as kept:
        kept.execute(
            "UPDATE kept SET json = CAST(replace(json, 'version', 'older') AS BLOB) WHERE name = 'floor'"
        )

    async def go(fleet: PaperFleet) -> None:
        assert closure(fleet)["name"] == "A"
        fleet.own.ask(["A3", "B3"])
        await until(lambda: fleet.state["done"] == ["B3"], 200)
        assert fleet.state["not_done"] == {"A3": "aisle A is closed"}

    fly(go, "abc", memory=FleetMemory(tmp_path))


def test_what_cannot_be_kept_is_closed_and_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuses(*_: object) -> None:
        raise UnavailableError("the disk is full")

    async def go(fleet: PaperFleet) -> None:
        monkeypatch.setattr(FleetMemory, "keep_closures", refuses)
        with pytest.raises(UnavailableError, match="the disk is full"):
            await fleet.own.close("ann", aisle="A")
        await until(lambda: closure(fleet)["inside"] == ())

    fly(go, "ab", memory=FleetMemory(tmp_path))


def test_nobody_is_flown_before_it_is_known_what_is_closed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuses(*_: object) -> None:
        raise UnavailableError("the file is locked")

    async def go(fleet: PaperFleet) -> None:
        await fleet.own.close("ann", aisle="A")
        await fleet.kill()
        with monkeypatch.context() as locked:
            locked.setattr(FleetMemory, "closures", refuses)
            fleet.start_again()
            await asyncio.sleep(30.0)
            assert not fleet.state["flies"]
            assert fleet.state["trouble"] == "what people closed cannot be read: the file is locked"
            with pytest.raises(UnavailableError, match="the file is locked"):
                await fleet.own.open("A")
        await until(lambda: fleet.state["flies"], 60)
        assert closure(fleet)["name"] == "A"
        fleet.own.ask(["A3", "B3"])
        await until(lambda: fleet.state["done"] == ["B3"], 200)

    fly(go, memory=FleetMemory(tmp_path))


def test_a_file_that_tells_of_nothing_closed_any_more_flies_nobody_until_a_person_puts_it_away(
    tmp_path: Path,
) -> None:
    async def go(fleet: PaperFleet) -> None:
        await fleet.kill()
        (tmp_path / FILE).write_text("something else, of no use to a station at all")
        fleet.start_again()
        await asyncio.sleep(30.0)
        assert not fleet.state["flies"]
        assert "not the fleet of a ground station" in fleet.state["trouble"]
        (tmp_path / FILE).unlink()
        await until(lambda: fleet.state["flies"], 10)

    fly(go, memory=FleetMemory(tmp_path))


def test_what_lies_behind_what_is_closed_is_told_and_flown_once_that_is_open() -> None:
    async def go(fleet: PaperFleet) -> None:
        await fleet.own.close("ann", nodes=["A2", "A3"])
        await fleet.own.close("ben", nodes=["B2", "A2"])
        name = await fleet.own.close("ben", nodes=["A4", "B4"])
        fleet.own.ask(["A5"])
        await until(lambda: fleet.state["not_done"] == {"A5": "there is no way there"}, 20)
        await fleet.own.open(name)
        await until(lambda: fleet.state["done"] == ["A5"], 300)
        assert fleet.drones["a"].commands == [], "it does not come out"

    fly(go)


def test_who_is_cut_off_from_his_pad_holds_and_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    async def go(fleet: PaperFleet) -> None:
        b = fleet.drones["b"]
        fleet.own.ask(["B3"], "b")
        await until(lambda: b.phase is Phase.HOVER and b.way[0] == "B3", 100)
        await fleet.own.close("ann", nodes=["B1", "B2"])
        await until(lambda: fleet.flown("b") and fleet.state["drones"]["b"]["cut_off"], 60)
        await asyncio.sleep(60.0)
        assert (b.phase, "home" in b.commands) == (Phase.HOLD, False)
        await fleet.own.open("B1, B2")
        await until(lambda: b.phase is Phase.DONE, 200)
        assert fleet.state["done"] == ["B3"]

    fly(go, "abc")


def test_who_is_given_back_between_two_nodes_comes_not_home_through_it() -> None:
    async def go(fleet: PaperFleet) -> None:
        b = fleet.drones["b"]
        await on_way_to("B4", fleet)
        await b.act(Act("by-ann-1", CommandKind.PAUSE))
        await until(lambda: b.phase is Phase.HOLD and not fleet.flown("b"))
        await fleet.own.close("ann", nodes=["B2", "B3"])
        fleet.own.hand_over("b", to_manager=True)
        await asyncio.sleep(60.0)
        assert (b.phase, b.commands[-1]) == (Phase.HOLD, "pause")
        await fleet.own.open("B2, B3")
        await until(lambda: b.phase is Phase.DONE, 200)

    fly(go, "b")
