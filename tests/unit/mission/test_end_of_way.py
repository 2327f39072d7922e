"""A way that ends by holding: who is done with it waits to be told where to fly on, and never sets out for
home because nothing came."""

from __future__ import annotations

import pytest

from flightd.config.hazards import LossAction
from flightd.config.schema import Config
from flightd.core.types import CommandKind, EventLevel, Phase
from tests.unit.mission import shelves
from tests.unit.mission.driven import Flight
from tests.unit.mission.states import PARAMS, flight_of, losing, start

GOTO, PLAN, RESUME, HOME = CommandKind.GOTO, CommandKind.PLAN, CommandKind.RESUME, CommandKind.HOME
WAITS = "waiting to be told where to fly on"


def flown(*nodes: str, params: Config = PARAMS, scans: bool = False) -> Flight:
    """A flight over these nodes that has come to the end of its way."""
    flight = flight_of(params, scans)
    flight.order(PLAN, nodes=nodes, waits=True)
    start(flight)
    flight.to(Phase.HOLD, 120.0)
    assert flight.mission.goal.node == nodes[-1]
    return flight


def phases(flight: Flight) -> list[str]:
    events = flight.mission.drain_events()
    return [event.text.split(": ")[0].split(" -> ")[1] for event in events if event.name == "phase"]


def test_a_plan_that_waits_holds_over_its_last_node_which_was_visited() -> None:
    flight = flown("A2", "A3")
    flight.run(30.0)
    assert (flight.phase, flight.mission.reason, list(flight.mission.visited)) == (
        Phase.HOLD,
        WAITS,
        ["A2", "A3"],
    )
    outlook = flight.mission.outlook(flight.now_ns)
    assert (outlook.waits_at, outlook.way[0]) == ("A3", "A3")
    text = next(event for event in flight.mission.drain_events() if event.text.endswith(WAITS))
    assert text.level is EventLevel.INFO, "that is nothing to be alarmed by"


def test_what_comes_late_is_flown_at_once_and_what_comes_early_is_not_waited_for() -> None:
    flight = flown("A2")
    flight.mission.drain_events()
    flight.order(GOTO, "A3", waits=True)
    flight.to(Phase.HOVER)
    assert (phases(flight), flight.mission.goal.node) == (["acquire", "turn", "follow", "hover"], "A3")
    flight.order(GOTO, "A2", waits=True)
    flight.to(Phase.HOLD)
    assert (flight.mission.goal.node, list(flight.mission.visited)) == ("A2", ["A2", "A3", "A2"])
    assert phases(flight).count("hold") == 1


@pytest.mark.parametrize("orders", [[RESUME], [CommandKind.PAUSE], [CommandKind.PAUSE, RESUME]])
def test_going_on_is_not_going_home(orders: list[CommandKind]) -> None:
    flight = flown("A2")
    for kind in orders:
        flight.order(kind)
        flight.run(3.0)
    assert (flight.phase, flight.mission.goal.node) == (Phase.HOLD, "A2")


def test_an_order_to_fly_home_from_where_it_holds_ends_the_flight_as_done() -> None:
    flight = flown("A2", "A1")
    flight.order(GOTO, "A1")
    assert flight.mission.outlook(flight.now_ns).waits_at == ""
    assert flight.land() is Phase.DONE
    assert list(flight.mission.visited) == ["A2", "A1"], "nothing twice"


def test_an_order_without_waiting_leads_home_as_ever() -> None:
    flight = flown("A2")
    flight.order(GOTO, "A3")
    assert flight.land() is Phase.DONE
    assert list(flight.mission.visited) == ["A2", "A3"]
    again = flight_of(PARAMS)
    again.order(PLAN, nodes=("A2",))
    start(again)
    again.to(Phase.FOLLOW)
    again.order(GOTO, "A2")
    assert again.land() is Phase.DONE
    assert list(again.mission.visited) == ["A2", "A2"], "the same once more, as ordered"


@pytest.mark.parametrize("why", ["a person", "the battery", "the ground link"])
def test_what_brings_a_drone_home_brings_home_one_that_waits(why: str) -> None:
    flight = flown("A2", params=losing(ground=LossAction.HOME))
    if why == "a person":
        flight.order(HOME)
    elif why == "the battery":
        flight.set(battery_frac=0.15)
    else:
        flight.set(ground_silent_s=9.0)
    flight.to(Phase.LAND, 120.0)
    assert (flight.mission.goal.node, flight.mission.state.on_pad) == ("A1", True)


def test_it_waits_no_longer_than_a_full_battery_hovers() -> None:
    flight = flown("A2")
    flight.run(PARAMS.battery.hover_s + 1.0)
    assert (flight.phase, flight.mission.reason) == (Phase.LAND, "the phase took too long")


def test_a_fresh_battery_flies_the_rest_and_waits_at_its_end() -> None:
    flight = flight_of(PARAMS)
    flight.order(PLAN, nodes=("A2", "A3"), waits=True)
    start(flight)
    flight.to(Phase.HOVER)
    flight.to(Phase.FOLLOW)
    flight.set(battery_frac=0.15)
    assert flight.land() is Phase.SWAP
    start(flight)
    flight.to(Phase.HOLD, 120.0)
    assert (flight.mission.goal.node, list(flight.mission.visited)) == ("A3", ["A2", "A3"])


def test_who_has_counted_waits_over_the_node_not_before_the_shelf() -> None:
    flight = flown("A2", scans=True)
    at = shelves.SITE.nodes["A2"]
    assert flight.inputs.pose is not None
    assert abs(flight.inputs.pose.y_m - at.y_m) < 0.05
