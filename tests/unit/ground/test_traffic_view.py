"""What the page Fleet is told of the station's traffic: what each drone is to do and did, and closed air."""

from __future__ import annotations

import itertools
from typing import Any

from flightd.core.types import Phase
from flightd.ground.fleet.traffic_view import MOST_AHEAD, MOST_DONE
from tests.rigs.paper_fleet import PaperFleet, fly, on_way_to, until


def test_what_is_planned_stands_against_time_and_what_is_done_is_told_after_it() -> None:
    seen: list[dict[str, Any]] = []

    async def go(fleet: PaperFleet) -> None:
        assert fleet.state["drones"]["a"] | {"plan": [], "past": [], "tour": []} == fleet.state["drones"]["a"]
        assert (fleet.state["drones"]["a"]["pad"], fleet.state["drones"]["a"]["rests"]) == ("A1", True)
        fleet.own.ask(["A3"], "a")
        await until(lambda: fleet.state["drones"]["a"]["plan"])
        seen.append(fleet.state["drones"]["a"])
        await until(lambda: fleet.state["done"] == ["A3"], 100)
        seen.append(fleet.state["drones"]["a"])

    fly(go)
    first, later = seen
    plan = first["plan"]
    assert [(one["act"], one["node"]) for one in plan] == [
        ("take off", "A1"), ("fly", "A2"), ("fly", "A3"), ("count", "A3"), ("turn", "A3"), ("fly", "A2"),
        ("fly", "A1"), ("land", "A1"),
    ]  # fmt: skip
    assert first["tour"] == ["A3"]
    assert all(0.0 <= one["begin_s"] < one["end_s"] for one in plan)
    assert all(one["end_s"] <= after["begin_s"] for one, after in itertools.pairwise(plan))
    assert [one["released"] for one in plan] == sorted((one["released"] for one in plan), reverse=True)
    assert len([one for one in plan if one["released"]]) == len(first["base"]) > 0
    assert later["tour"] == []
    assert [one["act"] for one in later["past"]][:4] == ["take off", "fly", "fly", "count"]
    assert all(one["begin_s"] <= one["end_s"] <= 0.0 for one in later["past"])
    assert len(later["plan"]) <= MOST_AHEAD
    assert len(later["past"]) <= MOST_DONE


def test_the_air_of_a_drone_that_a_person_took_is_told_as_closed() -> None:
    async def go(fleet: PaperFleet) -> None:
        assert fleet.state["drones"]["b"]["closed"] == {"nodes": [], "ways": []}
        await on_way_to("B3", fleet)
        fleet.own.hand_over("b", to_manager=False)
        await until(lambda: not fleet.flown("b"))
        told = fleet.state["drones"]["b"]
        assert told["why"] == "a person has it"
        assert {"B1", "B2", "B3"} <= {*told["closed"]["nodes"]}
        assert ["B1", "B2"] in [list(ends) for ends in told["closed"]["ways"]]
        assert not {"A1", "A4"} & {*told["closed"]["nodes"]}

    fly(go)


def test_whose_flight_is_over_is_told_to_rest_and_what_it_waits_for() -> None:
    async def go(fleet: PaperFleet) -> None:
        fleet.own.ask(["A2"], "a")
        await until(lambda: fleet.drones["a"].phase is Phase.DONE, 100)
        await until(lambda: fleet.state["drones"]["a"]["rests"])
        told = fleet.state["drones"]["a"]
        assert not told["flown"]
        assert told["why"] == "its flight is over: it flies the next one once its flightd was started anew"

    fly(go)
