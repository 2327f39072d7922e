"""What people closed is a place of the hall: by which maps it is found, and what is flown where it is not."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from pathlib import Path

import msgspec
import pytest

from flightd.adapters.ground_link.floor_status import floor_status
from flightd.adapters.ground_link.messages.floor import FloorStatus, FloorWay
from flightd.core.errors import InputError
from flightd.core.types import Phase
from flightd.fleet.traffic.cells import CellSize
from flightd.fleet.traffic.closures import Closure
from flightd.ground.fleet import own_fleet
from flightd.ground.fleet.closed_ways import aisle_closure, closure_between, on_map, places_of
from flightd.ground.fleet.fleet_floor import WHOLE_AIR_M, FleetFloor, with_all_pads
from flightd.ground.fleet.fleet_memory import FleetMemory, KeptClosure
from tests.rigs import paper_drones
from tests.rigs.paper_drones import PADS, hall
from tests.rigs.paper_fleet import PaperFleet, at_rest, closure, fly, on_way_to, until, until_done

ELSEWHERE = Closure("X", (("A2", "X1"),), "what is between A2, X1 is closed")
"""Of which the map has one end only."""


def test_nobody_is_flown_by_a_map_that_lacks_what_is_closed(tmp_path: Path) -> None:
    memory = FleetMemory(tmp_path)

    async def go(fleet: PaperFleet) -> None:
        await fleet.kill()
        before = Closure("A", (("A2", "A2b"), ("A2b", "A3")), "aisle A is closed")
        memory.keep_closures((KeptClosure(before, "ann", 0.0),))
        fleet.start_again()
        await until(lambda: fleet.state["flies"], 10)
        fleet.own.ask(["B3"])
        await asyncio.sleep(30.0)
        assert fleet.state["not_done"] == {"B3": f"{before.why}, but on another map (fleet.db)"}
        assert {drone.phase for drone in fleet.drones.values()} == {Phase.PREFLIGHT}
        await fleet.own.open("A")
        await until_done(fleet, "B3")

    fly(go, memory=memory)


def test_a_map_that_lacks_what_is_closed_is_flown_by_once_that_is_open(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async def go(fleet: PaperFleet) -> None:
        await fleet.own.close("ann", nodes=["A4", "A5"])
        monkeypatch.setattr(paper_drones, "_STEPS_M", (2.0, 1.6, 1.6))
        monkeypatch.setattr(paper_drones, "PADS", {"a": "A1", "b": "B1"})
        for name, drone in fleet.drones.items():
            drone.site = hall(name)
            drone.begin_anew()
        await until(lambda: "but on another map" in fleet.state["trouble"], 30)
        await asyncio.sleep(10.0)
        assert not any(map(fleet.flown, "ab"))
        await fleet.own.open("A4, A5")
        await until(lambda: all(map(fleet.flown, "ab")), 30)
        assert fleet.state["trouble"] == ""

    fly(go, "ab")


def test_what_is_closed_on_the_old_map_as_the_next_one_begins_grounds_all_and_loses_no_work(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    async def go(fleet: PaperFleet) -> None:
        for drone in fleet.drones.values():
            drone.never_starts = True
        fleet.own.ask(["B3"])
        await asyncio.sleep(5.0)

        fleet.hold_once_begun(monkeypatch)
        monkeypatch.setattr(paper_drones, "_STEPS_M", (2.0, 1.6, 1.6))
        monkeypatch.setattr(paper_drones, "PADS", {"a": "A1", "b": "B1"})
        for name, drone in fleet.drones.items():
            drone.site, drone.never_starts = hall(name), False
            drone.begin_anew()
        await until(lambda: fleet.deciding is not None, 60)
        closing = asyncio.ensure_future(fleet.own.close("ann", nodes=["A4", "A5"]))
        await asyncio.sleep(0.1)
        assert fleet.deciding is not None
        fleet.deciding.set()
        await closing
        await until(lambda: fleet.state["flies"] and closure(fleet)["inside"] == ())
        await asyncio.sleep(180.0)
        why = "what is between A4, A5 is closed, but on another map (fleet.db)"
        assert (fleet.state["trouble"], fleet.state["not_done"]) == ("", {"B3": why})
        assert closure(fleet)["why"] == why
        assert {drone.phase for drone in fleet.drones.values()} == {Phase.PREFLIGHT}
        told = [one.message for one in caplog.records if why in one.message]
        assert told == [f"nobody flies: {why}; open it, and close it again"]
        await fleet.own.open("A4, A5")
        fleet.own.ask(["B3"])
        await until_done(fleet, "B3")

    fly(go, "ab", memory=FleetMemory(tmp_path))


def test_where_what_is_closed_is_not_on_the_map_who_flies_comes_home(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(own_fleet, "closure_between", lambda *_: ELSEWHERE)

    async def go(fleet: PaperFleet) -> None:
        b = fleet.drones["b"]
        await on_way_to("B4", fleet)
        await fleet.own.close("ann", nodes=["A2", "X1"])
        await until(lambda: "b" in (closure(fleet)["inside"] or ()), 5)
        await until(lambda: b.phase is Phase.DONE and at_rest(fleet), 200)
        assert (b.truth.x_m, "home" in b.commands) == (0.0, False)
        assert fleet.state["not_done"] == {"B4": f"{ELSEWHERE.why}, but on another map (fleet.db)"}
        await until(lambda: closure(fleet)["inside"] == (), 5)
        await fleet.own.open("X")
        await until_done(fleet, "B4")

    fly(go, "ab")


def test_the_next_station_brings_home_who_flies_where_what_is_closed_is_not_on_the_map(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(own_fleet, "closure_between", lambda *_: ELSEWHERE)

    async def go(fleet: PaperFleet) -> None:
        b = fleet.drones["b"]
        await on_way_to("B4", fleet)
        await fleet.own.close("ann", nodes=["A2", "X1"])
        await fleet.kill()
        fleet.start_again()
        await until(lambda: b.phase is Phase.DONE and at_rest(fleet), 200)
        assert (b.truth.x_m, "home" in b.commands) == (0.0, False)
        assert fleet.state["not_done"] == {"B4": f"{ELSEWHERE.why}, but on another map (fleet.db)"}
        await fleet.own.open("X")
        await until_done(fleet, "B4")

    fly(go, memory=FleetMemory(tmp_path))


def test_what_is_not_there_is_refused_and_a_pads_own_way_is_not_of_its_aisle() -> None:
    floor = floor_status(hall("a"))
    assert aisle_closure(floor, "B").ways == (("B2", "B3"), ("B3", "B4"))
    assert closure_between(floor, ["A4", "B4", "A2", "A3"]).ways == (("A2", "A3"), ("A3", "A4"), ("A4", "B4"))
    with pytest.raises(InputError, match="no aisle is called Z"):
        aisle_closure(floor, "Z")
    with pytest.raises(InputError, match="no node is called Z1"):
        closure_between(floor, ["A2", "Z1"])
    with pytest.raises(InputError, match="no way leads between"):
        closure_between(floor, ["A2", "A4"])
    shut = tuple(FloorWay(f"A{i}", f"A{i + 1}", closed=True) for i in (2, 3, 4))
    spur = msgspec.structs.replace(floor, ways=shut)
    with pytest.raises(InputError, match="but to pads"):
        aisle_closure(spur, "A")

    b2_b4 = aisle_closure(floor, "B")
    at = places_of(floor, b2_b4)
    on_map(msgspec.structs.replace(floor, ways=(FloorWay("B2", "B3", closed=True),)), b2_b4, at)
    nodes = tuple(node for node in floor.nodes if node.id != "B3")
    with pytest.raises(InputError, match="aisle B is closed, but on another map"):
        on_map(msgspec.structs.replace(floor, nodes=nodes), b2_b4, at)

    async def go(fleet: PaperFleet) -> None:
        with pytest.raises(InputError, match="nothing is closed that is called A"):
            await fleet.own.open("A")

    fly(go, "a")


def numbered_anew(floor: FloorStatus, off_m: float = 0.0) -> FloorStatus:
    """Aisle B is counted from its other end; B3 is so far off."""
    places = {node.id: (node.x_m, node.y_m) for node in floor.nodes}
    nodes = []
    for node in floor.nodes:
        x_m, y_m = places[f"B{6 - int(node.id[1])}" if node.aisle == "B" else node.id]
        nodes.append(msgspec.structs.replace(node, x_m=x_m + off_m * (node.id == "B3"), y_m=y_m))
    return msgspec.structs.replace(floor, nodes=tuple(nodes))


def test_what_is_closed_stays_where_it_is_whatever_the_map_calls_it() -> None:
    floor = floor_status(hall("a"))
    near = closure_between(floor, ["B2", "B3"])
    at = places_of(floor, near)
    assert on_map(floor, near, at) == near
    assert on_map(numbered_anew(floor), near, at).ways == (("B3", "B4"),)
    assert on_map(numbered_anew(floor, 0.1), near, at).ways == (("B3", "B4"),)
    with pytest.raises(InputError, match=r"is closed, but on another map \(fleet.db\)"):
        on_map(numbered_anew(floor, 0.5), near, at)
    assert on_map(numbered_anew(floor), near, {}).ways == near.ways, "a flightd of before knew names alone"


def test_work_that_was_asked_for_is_not_done_at_another_node_that_is_called_so_now() -> None:
    async def go(fleet: PaperFleet) -> None:
        for drone in fleet.drones.values():
            drone.never_starts = True
        fleet.own.ask(["A3", "A4"])
        before = hall("a").nodes["A3"]
        moved = replace(before, x_m=before.x_m + 0.5)
        for name, drone in fleet.drones.items():
            drone.site = replace(hall(name), nodes={**hall(name).nodes, "A3": moved})
            drone.begin_anew()
        await until(lambda: "A3" in fleet.state["not_done"], 60)
        assert fleet.state["not_done"] == {"A3": "the drones' map has it no more"}

    fly(go, "ab")


def test_every_drone_comes_home_out_of_a_closed_aisle_where_each_map_has_its_own_pad_alone() -> None:
    floors = [floor_status(hall(drone)) for drone in "abc"]
    alone = [
        msgspec.structs.replace(floor, pads=tuple(pad for pad in floor.pads if pad.id == "home"))
        for floor in floors
    ]
    made = FleetFloor(dict(zip("abc", alone, strict=True)), PADS, CellSize(upright_m=WHOLE_AIR_M))
    assert aisle_closure(made.map, "B") == aisle_closure(floors[0], "B")
    assert aisle_closure(alone[0], "B").ways == (("B1", "B2"), ("B2", "B3"), ("B3", "B4"), ("B4", "B5"))
    elsewhere = msgspec.structs.replace(alone[1], name="shed")
    assert with_all_pads([alone[0], elsewhere, alone[2]]).pads == (*alone[0].pads, *alone[2].pads)
