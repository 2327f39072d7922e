"""Charge pads that the station's drones share: who needs one is sent to a free one, and nobody to one that
another has or was promised."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any

import pytest

from flightd.core.types import Phase
from flightd.ground.fleet.fleet_memory import FleetMemory
from tests.rigs.paper_fleet import PaperFleet, fly, until

DOCKS = ("A5",)


def docks(fleet: PaperFleet) -> list[dict[str, Any]]:
    return list(fleet.state["docks"])


def holder(fleet: PaperFleet) -> tuple[str, bool]:
    (dock,) = docks(fleet)
    return dock["drone"], dock["taken"]


async def on_dock(fleet: PaperFleet, name: str) -> None:
    """It stands there, and traffic knows."""
    drone = fleet.drones[name]
    await until(lambda: drone.phase is Phase.PREFLIGHT and drone.stand == "A5", 200)
    await until(lambda: fleet.flown(name) and holder(fleet) == (name, True), 10)


def test_who_is_low_after_its_tour_charges_on_the_shared_pad_and_flies_again_from_there() -> None:
    async def go(fleet: PaperFleet) -> None:
        a = fleet.drones["a"]
        assert docks(fleet) == [{"pad": "dock-A5", "node": "A5", "drone": "", "taken": False}]
        a.battery_frac = 0.5
        fleet.own.ask(["A3"], "a")
        await until(lambda: holder(fleet) == ("a", False), 100)
        await on_dock(fleet, "a")
        assert ("goto A5 onto its pad", "a", "accepted", "") in fleet.written
        assert fleet.state["drones"]["a"]["charges_to"] == 0.8
        fleet.own.ask(["A4"], "a")
        await asyncio.sleep(30.0)
        assert a.phase is Phase.PREFLIGHT, "it is not charged yet"
        a.battery_frac = 0.85
        await until(lambda: "A4" in fleet.state["done"], 100)
        await until(lambda: a.phase is Phase.DONE, 100)
        assert (a.stand, holder(fleet)) == ("A5", ("", False)), (
            "down on its own pad, and the other one is free"
        )

    fly(go, "ab", docks=DOCKS)


def test_who_comes_down_there_is_charged_whatever_waits_for_it() -> None:
    async def go(fleet: PaperFleet) -> None:
        a = fleet.drones["a"]
        a.battery_frac = 0.5
        fleet.own.ask(["A3"], "a")
        await until(lambda: holder(fleet) == ("a", False), 100)
        fleet.own.ask(["A4"], "a")
        await on_dock(fleet, "a")
        await asyncio.sleep(30.0)
        assert (a.phase, fleet.state["open"]) == (Phase.PREFLIGHT, ["A4"])
        a.battery_frac = 0.85
        await until(lambda: "A4" in fleet.state["done"], 100)

    fly(go, "ab", docks=DOCKS)


def test_two_that_are_low_never_come_to_one_pad() -> None:
    async def go(fleet: PaperFleet) -> None:
        a, b = fleet.drones["a"], fleet.drones["b"]
        a.battery_frac = b.battery_frac = 0.5
        fleet.own.hand_over("c", to_manager=False)
        fleet.own.ask(["B4"], "c")  # that waits all the time
        fleet.own.ask(["A3"], "a")
        fleet.own.ask(["B3"], "b")
        await until(lambda: holder(fleet)[1], 300)
        first, _ = holder(fleet)
        other = fleet.drones["b" if first == "a" else "a"]
        await until(lambda: other.phase is Phase.DONE, 200)
        assert not any(
            what.endswith("onto its pad") for what, name, *_ in fleet.written if name == other.name
        )
        await asyncio.sleep(1.0)
        other.begin_anew()  # on its own pad, and still low
        await until(lambda: fleet.flown(other.name), 30)
        await asyncio.sleep(30.0)
        assert (other.phase, holder(fleet)) == (Phase.PREFLIGHT, (first, True))
        fleet.drones[first].charges_per_s = 0.02
        await until(lambda: fleet.drones[first].phase is Phase.DONE, 300)  # it made room
        await until(lambda: holder(fleet) == (other.name, True), 200)

    fly(go, "abc", docks=DOCKS)


def test_who_is_charged_and_may_not_be_sent_anywhere_keeps_the_pad_until_he_may() -> None:
    async def go(fleet: PaperFleet) -> None:
        a, b = fleet.drones["a"], fleet.drones["b"]
        a.battery_frac = 0.5
        fleet.own.ask(["A3"], "a")
        await on_dock(fleet, "a")
        a.battery_frac, a.obstacles = 0.9, ("the aisle is not closed",)
        b.battery_frac = 0.5
        fleet.own.ask(["B3"], "b")
        commands, plan = len(a.commands), []
        for _ in range(1200):
            await asyncio.sleep(0.1)
            plan += fleet.state["drones"]["a"]["plan"]
        assert (plan, len(a.commands), holder(fleet)) == ([], commands, ("a", True))
        assert "B3" in fleet.state["done"], "b was done, and low"
        a.obstacles = ()
        b.begin_anew()
        fleet.own.ask(["B4"], "b")
        await until(lambda: a.phase is Phase.DONE, 300)

    fly(go, "ab", docks=DOCKS)


def test_who_is_low_and_may_not_start_is_not_told_as_out_of_reach(caplog: pytest.LogCaptureFixture) -> None:
    async def go(fleet: PaperFleet) -> None:
        a = fleet.drones["a"]
        a.battery_frac, a.obstacles = 0.5, ("the aisle is not closed",)
        fleet.own.ask(["A3"], "a")
        await asyncio.sleep(30.0)
        assert (a.phase, fleet.state["open"]) == (Phase.PREFLIGHT, ["A3"])
        a.obstacles = ()
        await on_dock(fleet, "a")

    fly(go, "ab", docks=DOCKS)
    assert not [record.message for record in caplog.records if "reaches no dock" in record.message]


def test_what_a_drone_chooses_by_itself_frees_the_pad_that_was_promised() -> None:
    async def go(fleet: PaperFleet) -> None:
        a = fleet.drones["a"]
        a.battery_frac = 0.5
        fleet.own.ask(["A4"], "a")
        await until(lambda: holder(fleet) == ("a", False), 100)
        a.turn_home()
        await until(lambda: a.phase is Phase.DONE, 100)
        await until(lambda: holder(fleet) == ("", False), 20)
        assert a.stand == "A1"

    fly(go, "ab", docks=DOCKS)


def test_who_is_taken_on_its_way_down_and_given_back_there_still_has_the_pad() -> None:
    async def go(fleet: PaperFleet) -> None:
        a, b = fleet.drones["a"], fleet.drones["b"]
        a.battery_frac = 0.5
        fleet.own.ask(["A3"], "a")
        await until(lambda: a.phase is Phase.LAND, 200)
        fleet.own.hand_over("a", to_manager=False)
        await until(lambda: a.phase is Phase.PREFLIGHT and a.stand == "A5", 100)
        await asyncio.sleep(2.0)
        fleet.own.hand_over("a", to_manager=True)
        b.battery_frac = 0.5
        fleet.own.ask(["B3"], "b")
        await until(lambda: b.phase is Phase.DONE, 300)
        assert holder(fleet) == ("a", True)
        assert not any(what.endswith("onto its pad") for what, name, *_ in fleet.written if name == "b")

    fly(go, "ab", docks=DOCKS)


def test_who_is_low_takes_the_shared_pad_to_which_a_way_is_open() -> None:
    async def go(fleet: PaperFleet) -> None:
        a = fleet.drones["a"]
        await fleet.own.close("ann", nodes=("A4", "A5"))
        a.battery_frac = 0.5
        fleet.own.ask(["A3"], "a")
        await until(lambda: a.phase is Phase.PREFLIGHT and a.stand == "B5", 200)
        assert [dock["drone"] for dock in docks(fleet)] == ["", "a"]

    fly(go, "ab", docks=("A5", "B5"))


def test_who_is_cut_off_from_its_own_pad_waits_on_a_shared_one() -> None:
    async def go(fleet: PaperFleet) -> None:
        a = fleet.drones["a"]
        fleet.own.ask(["A3"], "a")
        await until(lambda: a.phase is Phase.HOVER and a.way[0] == "A3", 100)
        a.battery_frac = 0.5
        await fleet.own.close("ann", nodes=("A1", "A2"))
        await on_dock(fleet, "a")
        a.battery_frac = 0.9
        await fleet.own.open("A1, A2")
        fleet.own.ask(["A4"], "a")
        await until(lambda: "A4" in fleet.state["done"] and a.phase is Phase.DONE, 200)
        assert a.stand == "A5", "it came home from there"

    fly(go, "ab", docks=DOCKS)


def test_a_daemon_that_takes_no_other_pad_comes_home() -> None:
    async def go(fleet: PaperFleet) -> None:
        a = fleet.drones["a"]
        a.knows_docks, a.battery_frac = False, 0.5
        fleet.own.ask(["A3"], "a")
        await until(lambda: a.phase is Phase.DONE, 150)
        assert holder(fleet) == ("", False)

    fly(go, "ab", docks=DOCKS)


def test_a_daemon_that_is_started_anew_on_a_shared_pad_is_flown_once_a_person_put_it_on_its_own() -> None:
    async def go(fleet: PaperFleet) -> None:
        a = fleet.drones["a"]
        a.battery_frac = 0.5
        fleet.own.ask(["A3"], "a")
        await on_dock(fleet, "a")
        at = a.truth.x_m, a.truth.y_m
        a.begin_anew()
        a.truth.x_m, a.truth.y_m = at  # where it really stands still
        await until(lambda: not fleet.flown("a"), 10)
        assert "give it back" in fleet.state["drones"]["a"]["why"]
        fleet.drones["b"].battery_frac = 0.5
        fleet.own.ask(["B3"], "b")
        await until(lambda: fleet.drones["b"].phase is Phase.DONE, 200)
        assert not any(what.endswith("onto its pad") for what, name, *_ in fleet.written if name == "b")

    fly(go, "ab", docks=DOCKS)


def test_a_station_that_is_killed_knows_who_stands_where(tmp_path: Path) -> None:
    async def go(fleet: PaperFleet) -> None:
        a, b = fleet.drones["a"], fleet.drones["b"]
        a.battery_frac = 0.5
        fleet.own.ask(["A3"], "a")
        await until(lambda: holder(fleet) == ("a", False), 100)
        await fleet.kill()
        await asyncio.sleep(20.0)
        fleet.start_again()
        await until(lambda: fleet.state["flies"], 30)
        fleet.own.ask(["A4"], "a")
        await on_dock(fleet, "a")
        await fleet.kill()
        await asyncio.sleep(5.0)
        fleet.start_again()
        await until(lambda: fleet.state["flies"] and fleet.flown("a"), 30)
        assert holder(fleet) == ("a", True)
        b.battery_frac = 0.5
        fleet.own.ask(["B3"], "b")
        await until(lambda: b.phase is Phase.DONE, 200)
        assert holder(fleet) == ("a", True)

    fly(go, "ab", docks=DOCKS, memory=FleetMemory(tmp_path))
