"""Drones of a station that are not heard for a moment, or do not know where they are: on paper, by virtual
time."""

from __future__ import annotations

import asyncio
import random

import pytest

from flightd.core.types import Phase
from tests.rigs.paper_drones import PaperDrone
from tests.rigs.paper_fleet import PaperFleet, fly, on_way_to, until


async def decide_while_silent(drone: PaperDrone, fleet: PaperFleet) -> None:
    """What is decided by now comes while the drone is not heard; it is heard before anything else is."""
    assert fleet.deciding is not None
    drone.heard = False
    await asyncio.sleep(0.3)
    fleet.deciding.set()
    fleet.deciding = None
    await asyncio.sleep(0.05)
    drone.heard = True


def test_a_start_that_was_decided_while_a_drone_was_not_heard_is_decided_anew() -> None:
    async def go(fleet: PaperFleet) -> None:
        b = fleet.drones["b"]
        fleet.deciding = asyncio.Event()
        await asyncio.sleep(1.0)
        fleet.own.ask(["B3"], "b")
        fleet.deciding.set()
        fleet.deciding = asyncio.Event()
        await until(lambda: fleet.state["given"] == {"B3": "b"})
        await decide_while_silent(b, fleet)
        await until(lambda: b.phase is Phase.DONE, 100)
        assert fleet.state["done"] == ["B3"]

    fly(go, "b")


def test_what_a_drone_in_the_air_was_released_to_while_it_was_not_heard_is_decided_anew() -> None:
    async def go(fleet: PaperFleet) -> None:
        b = fleet.drones["b"]
        fleet.own.ask(["B3", "B4"], "b")
        await until(lambda: b.phase is Phase.FOLLOW and b.way[0] == "B2", 100)
        fleet.deciding = asyncio.Event()
        await until(lambda: b.phase is Phase.HOLD, 60)
        decided, fleet.deciding = fleet.deciding, asyncio.Event()
        decided.set()
        await asyncio.sleep(1.0)
        await decide_while_silent(b, fleet)
        await until(lambda: b.phase is Phase.DONE, 200)
        await asyncio.sleep(1.0)
        b.begin_anew()
        await until(lambda: fleet.state["done"] == ["B3", "B4"], 200)

    fly(go, "b")


def test_who_was_started_anew_flies_by_nothing_of_before_however_long_is_decided() -> None:
    async def go(fleet: PaperFleet) -> None:
        b = fleet.drones["b"]
        await on_way_to("B3", fleet)
        fleet.deciding = asyncio.Event()
        await asyncio.sleep(1.0)
        b.begin_anew()
        b.commands.clear()
        await asyncio.sleep(10.0)
        fleet.deciding.set()
        fleet.deciding = None
        await until(lambda: not fleet.flown("b"))
        assert b.commands == []

    fly(go, "b")


def test_a_drone_that_is_silent_for_long_is_called_off_once_it_is_heard() -> None:
    async def go(fleet: PaperFleet) -> None:
        b = fleet.drones["b"]
        await on_way_to("B3", fleet)
        b.heard, b.paused = False, True
        await asyncio.sleep(100.0)
        b.heard = True
        await asyncio.sleep(1.0)
        assert [what.split()[0] for what, *_ in fleet.written].count("cancelOrder") == 1

    fly(go, "b")


@pytest.mark.parametrize("sigmas_m", [(None, 0.02), (0.02, None), (None, None)])
def test_who_knows_its_place_along_one_axis_alone_keeps_others_away(
    sigmas_m: tuple[float | None, float | None],
) -> None:
    async def go(fleet: PaperFleet) -> None:
        b = fleet.drones["b"]
        await on_way_to("B3", fleet)
        b.sigmas_m = sigmas_m
        await asyncio.sleep(1.0)
        fleet.own.ask(["A3"], "a")
        await asyncio.sleep(60.0)
        assert (fleet.state["drones"]["b"]["doubt_m"], fleet.state["done"]) == (3.0, ["B3"])
        b.sigmas_m = 0.02, 0.02
        fleet.drones["a"].begin_anew()
        await until(lambda: {*fleet.state["done"]} == {"A3", "B3"}, 200)

    fly(go, "ab")


@pytest.mark.parametrize("seed", [1, 7, 10])
def test_links_that_blink_as_something_is_decided_lose_no_node(seed: int) -> None:
    rng = random.Random(seed)
    nodes = {f"{aisle}{i}" for aisle in "AB" for i in (2, 3, 4)}

    async def begin_anew(drone: PaperDrone) -> None:
        while True:
            await until(lambda: drone.phase is Phase.DONE, 2000)
            await asyncio.sleep(10.0)
            drone.begin_anew()

    async def go(fleet: PaperFleet) -> None:
        loop, drones = asyncio.get_running_loop(), [*fleet.drones.values()]

        def decides_s() -> float:
            takes_s = rng.choice([0.5, 1.0, 3.0])
            if rng.random() < 0.2:
                drone = rng.choice(drones)
                loop.call_later(takes_s - 0.3, setattr, drone, "heard", False)
                loop.call_later(takes_s + 0.05, setattr, drone, "heard", True)
            return takes_s

        fleet.decides_s = decides_s
        tasks = [asyncio.ensure_future(begin_anew(drone)) for drone in drones]
        try:
            fleet.own.ask(sorted(nodes))
            await until(lambda: {*fleet.state["done"]} == nodes, 1500)
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.wait(tasks)

    fly(go)
