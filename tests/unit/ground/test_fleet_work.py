"""What a station's drones do not do is done by others, or told with its reason: on paper, by virtual time."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from flightd.adapters.ground_link.floor_status import floor_status
from flightd.core.errors import InputError, RunError, UnavailableError
from flightd.core.types import CommandKind, Phase
from flightd.fleet.traffic.cells import CellSize
from flightd.fleet.traffic.dispatcher import Dispatcher
from flightd.fleet.vda5050.parts import Action
from flightd.fleet.vda5050.state import ActionStatus
from flightd.fleet.vehicle.signals import Progress
from flightd.ground.fleet.fleet_floor import FleetFloor
from flightd.ground.mqtt.shelf_counts import ShelfCounts
from tests.rigs.paper_drones import hall
from tests.rigs.paper_fleet import PaperFleet, fly, until


def test_where_traffic_fails_everybody_ends_his_base_and_is_flown_on_from_there(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async def go(fleet: PaperFleet) -> None:
        a, b = fleet.drones["a"], fleet.drones["b"]
        fleet.own.ask(["A3", "B3"])
        await until(lambda: a.phase is Phase.HOVER and a.way[0] == "A2", 100)
        with monkeypatch.context() as patched:
            patched.setattr(Dispatcher, "step", lambda *_: 1 / 0)
            await until(lambda: not fleet.state["flies"])
            assert fleet.state["trouble"] == "it failed: division by zero"
            await until(lambda: a.phase is Phase.HOLD and b.phase is Phase.HOLD)
            assert (fleet.state["given"], fleet.state["done"]) == ({"A3": "a", "B3": "b"}, [])
        await until(lambda: a.phase is Phase.DONE and b.phase is Phase.DONE, 300)
        assert {*fleet.state["done"], *fleet.state["open"]} == {"A3", "B3"}, "the work is kept"
        await asyncio.sleep(1.0)
        a.begin_anew()
        await until(lambda: set(fleet.state["done"]) == {"A3", "B3"}, 300)

    fly(go, "ab")


def test_work_over_which_traffic_fails_again_and_again_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    async def go(fleet: PaperFleet) -> None:
        fleet.own.ask(["A3"])
        monkeypatch.setattr(Dispatcher, "_give_tour", lambda *_: 1 / 0)
        await until(lambda: fleet.state["not_done"] == {"A3": "traffic failed over it"}, 20)
        await until(lambda: fleet.state["flies"], 20)
        await asyncio.sleep(10.0)
        assert fleet.state["flies"]

    fly(go, "a")


def test_a_drone_that_counts_is_not_sent_on_before_its_count_is_over() -> None:
    async def go(fleet: PaperFleet) -> None:
        a = fleet.drones["a"]
        fleet.own.ask(["A2", "A3"])
        await until(lambda: a.phase is Phase.HOVER and a.way[0] == "A2", 100)
        await asyncio.sleep(4.0)
        assert (fleet.state["done"], a.phase) == ([], Phase.HOVER)
        await until(lambda: fleet.state["done"] == ["A2"], 10)
        await until(lambda: a.phase is Phase.DONE, 300)
        assert fleet.state["done"] == ["A2", "A3"]

    fly(go, "a", counts=True)


def test_what_a_drone_does_not_fly_to_because_it_would_not_come_home_is_told_and_it_comes_home() -> None:
    async def go(fleet: PaperFleet) -> None:
        b = fleet.drones["b"]
        fleet.own.ask(["B3"], "b")
        await until(lambda: b.phase is Phase.FOLLOW and b.way[0] == "B2", 100)
        b.left_s = 9.0
        await until(lambda: b.phase is Phase.DONE, 200)
        assert fleet.state["not_done"] == {"B3": "b: the drone would not come home from B3; it holds before"}
        assert "home" not in b.commands

    fly(go, "b")


def test_what_one_drone_refuses_is_done_by_another_one() -> None:
    async def go(fleet: PaperFleet) -> None:
        b = fleet.drones["b"]
        fleet.own.ask(["B3"])
        await until(lambda: fleet.state["given"] == {"B3": "b"} and b.phase is Phase.TAKE_OFF, 100)
        b.refuses[CommandKind.GOTO] = RunError("goto refused: a shelf has fallen over")
        fleet.own.ask(["B2"], "b")
        await until(lambda: not fleet.flown("b"), 60)
        b.refuses.clear()
        await until(lambda: b.phase is Phase.DONE and fleet.state["done"] == ["B3"], 300)

    fly(go, "bc")


def test_what_a_drone_refuses_that_alone_may_do_it_has_its_reason() -> None:
    async def go(fleet: PaperFleet) -> None:
        b = fleet.drones["b"]
        fleet.own.ask(["B3"], "b")
        await until(lambda: b.phase is Phase.TAKE_OFF, 100)
        b.refuses[CommandKind.GOTO] = RunError("refused: a shelf has fallen over")
        await until(lambda: not fleet.flown("b"), 60)
        b.refuses.clear()
        await until(lambda: b.phase is Phase.DONE, 200)
        assert (fleet.state["open"], fleet.state["not_done"]) == ([], {"B3": "b: a shelf has fallen over"})

    fly(go, "b")


def test_a_count_that_fails_is_not_done_and_says_why(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(_: ShelfCounts, action: Action, *__: Any, **___: Any) -> Progress:
        return Progress(action.action_id, ActionStatus.FAILED, "no front camera")

    async def go(fleet: PaperFleet) -> None:
        monkeypatch.setattr(ShelfCounts, "begin", fails)
        fleet.own.ask(["A2"])
        await until(lambda: fleet.drones["a"].phase is Phase.DONE, 200)
        assert (fleet.state["done"], fleet.state["not_done"]) == ([], {"A2": "a: no front camera"})

    fly(go, "a", counts=True)


def test_what_a_drone_has_that_does_not_start_is_given_to_another_one() -> None:
    async def go(fleet: PaperFleet) -> None:
        fleet.drones["a"].never_starts = True
        fleet.own.ask(["A2"])
        await until(lambda: fleet.state["given"] == {"A2": "a"})
        await until(lambda: fleet.state["done"] == ["A2"], 200)
        assert (fleet.drones["a"].phase, fleet.drones["b"].flies) == (Phase.PREFLIGHT, True)

    fly(go, "ab")


def test_a_drone_with_little_left_is_sent_nowhere() -> None:
    async def go(fleet: PaperFleet) -> None:
        fleet.drones["a"].left_s = 30.0
        await asyncio.sleep(1.0)
        fleet.own.ask(["A2"])
        await asyncio.sleep(30.0)
        assert (fleet.state["open"], fleet.drones["a"].commands) == (["A2"], [])

    fly(go, "a")


def test_who_charges_on_his_pad_takes_new_work_once_he_is_charged_and_others_do_it_meanwhile() -> None:
    async def go(fleet: PaperFleet) -> None:
        a, b = fleet.drones["a"], fleet.drones["b"]
        a.battery_frac = 0.79
        fleet.own.ask(["A2"])
        fleet.own.ask(["A3"], "a")
        await until(lambda: fleet.state["done"] == ["A2"] and b.phase is Phase.DONE, 200)
        assert (a.commands, fleet.state["drones"]["a"]["charges_to"]) == ([], 0.8)
        a.battery_frac = 0.8
        await until(lambda: a.phase is Phase.FOLLOW, 60)
        a.battery_frac = 0.5
        await until(lambda: fleet.state["done"] == ["A2", "A3"] and a.phase is Phase.DONE, 200)
        assert fleet.state["drones"]["a"]["charges_to"] is None, "its flight is over"

    fly(go, "ab", charged_frac=0.8)


def test_who_has_another_pad_after_a_start_is_flown_once_all_rest_and_round_it_until_then() -> None:
    async def go(fleet: PaperFleet) -> None:
        a, c = fleet.drones["a"], fleet.drones["c"]
        fleet.own.ask(["A3"], "a")
        await until(lambda: a.phase is Phase.FOLLOW, 100)
        c.site = hall("c", pad="A5")
        c.begin_anew()
        await until(lambda: not fleet.flown("c"))
        assert fleet.state["drones"]["c"]["why"] == "it has another pad than before: at A5"
        fleet.own.ask(["A4"], "a")
        fleet.own.ask(["B4"], "c")
        await until(lambda: a.phase is Phase.DONE, 200)
        assert fleet.state["done"] == ["A3"], "it stands beside A4"
        await asyncio.sleep(1.0)
        a.begin_anew()
        await until(lambda: fleet.flown("c"), 20)
        await until(lambda: "B4" in fleet.state["done"] and c.phase is Phase.DONE, 300)
        assert c.truth.x_m == c.site.nodes["A5"].x_m

    fly(go, "ac")


def test_who_flies_by_another_map_after_a_start_is_not_flown_and_the_others_are() -> None:
    async def go(fleet: PaperFleet) -> None:
        c = fleet.drones["c"]
        c.site = hall("c", "shed")
        c.begin_anew()
        await until(lambda: fleet.state["drones"]["c"]["why"] == "it flies by another map: shed")
        await until(lambda: fleet.state["trouble"] != "")
        fleet.own.ask(["A3"])
        await until(lambda: fleet.state["done"] == ["A3"], 200)
        c.site = hall("c")
        c.begin_anew()
        await until(lambda: fleet.flown("c"))

    fly(go, "ac")


def test_nodes_and_drones_that_are_not_there_are_refused() -> None:
    async def go(fleet: PaperFleet) -> None:
        with pytest.raises(InputError, match="no node is called A9"):
            fleet.own.ask(["A2", "A9"])
        with pytest.raises(InputError, match="no drone of the fleet is called z"):
            fleet.own.ask(["A2"], "z")

    fly(go, "a")
    with pytest.raises(UnavailableError, match="does not fly"):
        PaperFleet({"a": hall("a")}).own.ask(["A2"])


def test_drones_of_different_maps_or_with_one_pad_are_not_flown_together() -> None:
    a, b, cell = floor_status(hall("a")), floor_status(hall("b")), CellSize()
    assert FleetFloor({"a": a, "b": b}, {"a": "A1", "b": "B1"}, cell).pads.keys() == {"a", "b"}
    refused = [
        ({"a": a, "b": floor_status(hall("b", "shed"))}, "B1", "a and b fly by different maps: hall, shed"),
        ({"a": a, "b": a}, "A1", "the pads of a and b are 0.0 m apart"),
        ({"a": a, "b": b}, "A1", "b stands on the pad at A1 and comes home to that at B1"),
    ]
    for floors, stands, why in refused:
        with pytest.raises(InputError, match=why):
            FleetFloor(floors, {"a": "A1", "b": stands}, cell)
