"""A station that flies a fleet dies in the middle of it, and another one goes on: on paper."""

from __future__ import annotations

import asyncio
import random
import sqlite3
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from flightd.core.errors import InputError, UnavailableError
from flightd.core.types import CommandKind, Phase
from flightd.fleet.traffic.valued_work import UNKNOWN
from flightd.ground.fleet.fleet_memory import FILE, TOO_OLD, FleetMemory
from flightd.ground.fleet.own_fleet import OwnFleet
from flightd.ground.messages import Act
from flightd.ground.own_database import OwnDatabase
from tests.rigs.paper_drones import hall
from tests.rigs.paper_fleet import PaperFleet, at_rest, fly, on_way_to, until, until_done


async def die_with_work(fleet: PaperFleet) -> None:
    """The station was asked for A3, for which no drone starts."""
    for drone in fleet.drones.values():
        drone.never_starts = True
    fleet.own.ask(["A3"])
    await asyncio.sleep(5.0)
    await fleet.kill()


@pytest.mark.parametrize("seed", range(6))
def test_the_next_station_flies_on_who_is_in_the_air_and_what_was_asked_for(
    tmp_path: Path, seed: int
) -> None:
    rng = random.Random(seed)

    async def go(fleet: PaperFleet) -> None:
        fleet.own.ask(["A3", "A4", "B3", "B4"])
        for _ in range(3):
            await asyncio.sleep(rng.uniform(2.0, 25.0))
            await fleet.kill()
            await asyncio.sleep(rng.uniform(0.1, 20.0))
            fleet.start_again()
        await until_done(fleet, "A3 A4 B3 B4")

    fleet = fly(go, memory=FleetMemory(tmp_path))
    assert all("home" not in drone.commands for drone in fleet.drones.values()), "traffic brought them home"
    assert {drone.truth.z_m for drone in fleet.drones.values()} == {0.0}


def test_without_a_memory_nobody_is_flown_until_all_are_on_the_ground() -> None:
    async def go(fleet: PaperFleet) -> None:
        await on_way_to("B3", fleet)
        await fleet.kill()
        fleet.start_again()
        await asyncio.sleep(60.0)
        assert not fleet.state["flies"]
        assert fleet.drones["b"].phase is Phase.HOLD
        fleet.drones["b"].turn_home()
        await until(lambda: fleet.drones["b"].phase is Phase.DONE, 100)

    fly(go)


def test_what_is_ordered_stands_in_the_memory_before(tmp_path: Path) -> None:
    memory = FleetMemory(tmp_path)
    ordered: list[str] = []

    async def go(fleet: PaperFleet) -> None:
        for drone in fleet.drones.values():
            act = drone.act

            async def watched(order: Act, *, drone=drone, act=act, **how: Any):  # type: ignore[no-untyped-def]
                known = memory.read()
                assert known is not None
                if order.command is CommandKind.GOTO:
                    ordered.append(order.node)
                    assert any(order.node in way for way in known[1].drones[drone.name].ways)
                return await act(order, **how)

            drone.act = watched  # type: ignore[assignment, method-assign]
        fleet.own.ask(["A3", "B4"])
        await until(lambda: len(fleet.state["done"]) == 2 and at_rest(fleet), 300)

    fly(go, memory=memory)
    assert len(ordered) > 4


@pytest.mark.parametrize("while_away", [False, True])
def test_whom_a_person_took_stays_his(tmp_path: Path, while_away: bool) -> None:
    async def go(fleet: PaperFleet) -> None:
        b = fleet.drones["b"]
        await on_way_to("B3", fleet)
        if not while_away:
            await b.act(Act("by-ann-1", CommandKind.PAUSE))
            await until(lambda: not fleet.flown("b"))
        await fleet.kill()
        if while_away:
            await b.act(Act("by-ann-1", CommandKind.PAUSE))
        fleet.start_again()
        await until(lambda: fleet.state["flies"])
        await until(lambda: fleet.state["drones"]["b"]["why"] == "a person has it")
        assert fleet.pages["b", "manager"] == {"flies": False}
        commands = len(b.commands)
        fleet.own.ask(["B3"], "c")
        await asyncio.sleep(90.0)
        assert len(b.commands) == commands, "nothing was sent to it"
        assert fleet.state["done"] == [], "nobody flew into its air"
        b.turn_home()
        await until(lambda: b.phase is Phase.DONE, 200)

    fly(go, memory=FleetMemory(tmp_path))


def test_who_is_silent_when_the_next_station_begins_has_his_air_to_himself(tmp_path: Path) -> None:
    async def go(fleet: PaperFleet) -> None:
        b = fleet.drones["b"]
        await on_way_to("B3", fleet)
        b.heard = False
        await fleet.kill()
        for name in "ac":
            fleet.drones[name].welcome()
        fleet.start()  # b does not answer
        await until(lambda: fleet.state["flies"])
        fleet.own.ask(["B2"], "c")
        await asyncio.sleep(60.0)
        assert fleet.state["done"] == []
        b.heard = True
        b.welcome()
        await until_done(fleet, "B2 B3")

    fly(go, memory=FleetMemory(tmp_path))


@pytest.mark.parametrize("orderly", [False, True])
def test_who_was_halted_by_the_station_is_no_persons(tmp_path: Path, orderly: bool) -> None:
    async def go(fleet: PaperFleet) -> None:
        b = fleet.drones["b"]
        await on_way_to("B3", fleet)
        if orderly:
            await fleet.own.leave()
        else:
            fleet.drones["c"].sees = False  # b is paused before air in which c may be
            await asyncio.sleep(0.1)
        await fleet.kill()
        fleet.drones["c"].sees = True
        fleet.start_again()
        await until(lambda: fleet.state["flies"])
        await asyncio.sleep(2.0)
        assert fleet.state["drones"]["b"]["why"] != "a person has it"
        await until(lambda: b.phase is Phase.DONE, 200)

    fly(go, memory=FleetMemory(tmp_path))


def test_a_station_that_dies_before_it_hears_anybody_leaves_what_is_known(
    tmp_path: Path,
) -> None:
    async def go(fleet: PaperFleet) -> None:
        b = fleet.drones["b"]
        await on_way_to("B3", fleet)
        await fleet.kill()
        for drone in fleet.drones.values():
            drone.heard = False
        for _ in range(3):
            fleet.start()
            await asyncio.sleep(1.0)
            await fleet.kill()
        for drone in fleet.drones.values():
            drone.heard = True
        fleet.start_again()
        await until(lambda: fleet.state["flies"])
        await until(lambda: fleet.flown("b"), 60)
        await until_done(fleet, "B3")
        assert "home" not in b.commands

    fly(go, memory=FleetMemory(tmp_path))


def test_nobody_leaves_the_ground_for_what_a_station_before_was_asked_for(tmp_path: Path) -> None:
    async def go(fleet: PaperFleet) -> None:
        await die_with_work(fleet)
        for drone in fleet.drones.values():
            drone.never_starts = False
        fleet.start_again()
        await asyncio.sleep(30.0)
        assert fleet.state["open"] == ["A3"]
        assert {drone.phase for drone in fleet.drones.values()} == {Phase.PREFLIGHT}
        fleet.own.ask(["B3"])
        await until_done(fleet, "A3 B3")

    fly(go, memory=FleetMemory(tmp_path))


@pytest.mark.parametrize(
    "ask", [lambda own: own.ask(["B3", "A9"]), lambda own: own.take_run("run-1", {"A9": UNKNOWN})]
)
def test_nor_for_a_request_that_is_refused(tmp_path: Path, ask: Callable[[OwnFleet], None]) -> None:
    async def go(fleet: PaperFleet) -> None:
        await die_with_work(fleet)
        for drone in fleet.drones.values():
            drone.never_starts = False
        fleet.start_again()
        await until(lambda: fleet.state["flies"])
        with pytest.raises(InputError, match="no node is called A9"):
            ask(fleet.own)
        await asyncio.sleep(30.0)
        assert fleet.state["open"] == ["A3"]
        assert {drone.phase for drone in fleet.drones.values()} == {Phase.PREFLIGHT}

    fly(go, memory=FleetMemory(tmp_path))


def test_nor_once_the_drones_have_another_map(tmp_path: Path) -> None:
    async def go(fleet: PaperFleet) -> None:
        await die_with_work(fleet)
        fleet.start_again()
        await until(lambda: fleet.state["flies"])
        await until(lambda: all(fleet.flown(name) for name in fleet.drones))
        for name, drone in fleet.drones.items():
            drone.site, drone.never_starts = hall(name, "hall 2"), False
            drone.begin_anew()
        await until(lambda: fleet.own.site == "hall 2", 60)
        await asyncio.sleep(30.0)
        assert fleet.state["open"] == ["A3"]
        assert {drone.phase for drone in fleet.drones.values()} == {Phase.PREFLIGHT}
        fleet.own.ask(["B3"])
        await until_done(fleet, "A3 B3")

    fly(go, memory=FleetMemory(tmp_path))


def test_a_station_that_dies_as_it_begins_by_another_map_leaves_the_work(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def go(fleet: PaperFleet) -> None:
        for drone in fleet.drones.values():
            drone.never_starts = True
        fleet.own.ask(["A3"])
        await asyncio.sleep(5.0)
        with monkeypatch.context() as patched:
            fleet.hold_once_begun(patched)
            for name, drone in fleet.drones.items():
                drone.site = hall(name, "hall 2")
                drone.begin_anew()
            await until(lambda: fleet.deciding is not None, 60)
            await fleet.kill()
        fleet.deciding = None
        fleet.start_again()
        await until(lambda: fleet.state["flies"])
        assert (fleet.own.site, fleet.state["open"]) == ("hall 2", ["A3"])
        for drone in fleet.drones.values():
            drone.never_starts = False
        fleet.own.ask(["B3"])
        await until_done(fleet, "A3 B3")

    fly(go, memory=FleetMemory(tmp_path))


def test_a_map_that_cannot_be_written_down_as_the_fleet_begins_by_it_is_with_what_is_next(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def locked(database: OwnDatabase) -> None:
        refused.append(database.file)
        patched.undo()
        raise UnavailableError("database is locked")

    refused: list[Path] = []
    patched = pytest.MonkeyPatch()

    async def go(fleet: PaperFleet) -> None:
        await asyncio.sleep(5.0)
        with monkeypatch.context() as begins:
            begin = FleetMemory.begin

            def refuses(*of: Any, **more: Any) -> None:
                patched.setattr(OwnDatabase, "changed", locked)
                begin(*of, **more)

            begins.setattr(FleetMemory, "begin", refuses)
            for name, drone in fleet.drones.items():
                drone.site = hall(name, "hall 2")
                drone.begin_anew()
            await until(lambda: bool(refused) and fleet.state["flies"] and fleet.own.site == "hall 2", 60)
        await asyncio.sleep(5.0)
        await fleet.kill()
        fleet.start()  # nobody has told anything anew
        await until(lambda: fleet.state["flies"])
        assert (fleet.own.site, len(refused)) == ("hall 2", 1)

    fly(go, memory=FleetMemory(tmp_path))


def test_nobody_is_flown_on_while_one_is_not_heard_that_may_be_anywhere(tmp_path: Path) -> None:
    async def go(fleet: PaperFleet) -> None:
        a, b = fleet.drones["a"], fleet.drones["b"]
        fleet.own.ask(["A3"], "a")
        await until(lambda: a.phase is Phase.FOLLOW and a.way[0] == "A3", 100)
        b.heard = False  # it rests on its pad, for all that is known
        await fleet.kill()
        fleet.start_again()
        await until(lambda: a.phase is Phase.HOLD, 60)
        await asyncio.sleep(60.0)
        assert (a.phase, fleet.flown("a")) == (Phase.HOLD, False)
        b.heard = True
        await until_done(fleet, "A3")

    fly(go, memory=FleetMemory(tmp_path))


def test_work_that_waited_for_long_is_not_flown_by_a_station_that_nobody_expects_to(tmp_path: Path) -> None:
    now_s = 1_000_000.0

    async def go(fleet: PaperFleet) -> None:
        nonlocal now_s
        for drone in fleet.drones.values():
            drone.never_starts = True
        fleet.own.ask(["A3"])
        await asyncio.sleep(5.0)
        await fleet.kill()
        now_s += 3600.0
        for drone in fleet.drones.values():
            drone.never_starts = False
        fleet.start_again()
        await until(lambda: fleet.state["flies"])
        await asyncio.sleep(30.0)
        assert fleet.state["not_done"] == {"A3": TOO_OLD}
        assert {drone.phase for drone in fleet.drones.values()} == {Phase.PREFLIGHT}
        fleet.own.ask(["A3"])
        await until(lambda: fleet.state["done"] == ["A3"], 200)

    fly(go, memory=FleetMemory(tmp_path, lambda: now_s))


_SPOILT = {
    "another version": "UPDATE kept SET json = CAST(replace(json, 'version', 'older') AS BLOB)",
    "not readable": "UPDATE kept SET json = x'7B7D' WHERE name = 'fleet'",
}


@pytest.mark.parametrize("what", ["other drones", *_SPOILT])
def test_a_memory_that_is_of_no_use_is_told_and_the_fleet_begins_on_the_ground(
    tmp_path: Path, what: str, caplog: pytest.LogCaptureFixture
) -> None:
    def flown(names: str) -> None:
        async def go(fleet: PaperFleet) -> None:
            fleet.own.ask(["A3"])
            await until(lambda: fleet.state["done"] == ["A3"], 200)

        fly(go, names, memory=FleetMemory(tmp_path))

    flown("ab" if what == "other drones" else "abc")
    with sqlite3.connect(tmp_path / FILE) as kept:
        kept.execute(_SPOILT.get(what, "SELECT 1"))
    caplog.clear()
    flown("abc")
    told = [record.message for record in caplog.records if "before" in record.message]
    assert len(told) == 1, told
