"""A drone as a vehicle of somebody else's fleet: how far it is led, what keeps it, and what it tells."""

from __future__ import annotations

import asyncio
from typing import Any

import msgspec
import pytest

from flightd.adapters.ground_link.floor_status import floor_status
from flightd.adapters.ground_link.messages.counts import NodeCount
from flightd.adapters.ground_link.messages.published import Position, VehicleReport
from flightd.core.errors import InputError, RunError, UnavailableError
from flightd.core.types import CommandKind, Phase
from flightd.fleet.vda5050.order import Order
from flightd.fleet.vda5050.state import OperatingMode
from flightd.ground.mqtt.linked_floor import WaysHome
from flightd.ground.mqtt.reported_drone import ChargeTrend, situation_of
from flightd.ground.mqtt.safe_return import SafeReturn, Standing, ask_standing
from tests.rigs.event_loops import virtual
from tests.unit.fleet.vehicle_rig import at, instant, order, scan
from tests.unit.ground.managed_rig import SITE, Managed, status
from tests.unit.ground.test_order_flight import RACKS


def from_here(way: str, **where: Any) -> Order:
    """An order that begins at a node of its own, where the drone is."""
    told = order(f"here {way}", name="from here")
    return at(told, map_id=SITE.name, **where)


def between(a: str, b: str) -> Position:
    """Half way from node to node."""
    x_m = (SITE.nodes[a].x_m + SITE.nodes[b].x_m) / 2
    return Position(x_m, SITE.nodes[a].y_m, 0.0, 0.0, 1.0)


async def halted_after_a2(demo: Managed) -> None:
    """Paused between A2 and A3, its order cancelled."""
    demo.drone.hear(order("A1 A2 A3"))
    await asyncio.sleep(5.0)
    demo.tell(Phase.HOVER, "A2 A3 A3 A1", waits_at="A3", battery_left_s=200.0)
    await asyncio.sleep(1.0)
    half = between("A2", "A3")
    held = {"waits_at": "A3", "position": half, "battery_left_s": 200.0}
    demo.tell(Phase.HOLD, "A3 A3 A1", **held)
    demo.drone.hear(instant("startPause", "p1"))
    demo.drone.hear(instant("cancelOrder", "c1"))
    demo.drone.hear(instant("stopPause", "s1"))
    await asyncio.sleep(2.0)
    assert demo.drone.vehicle.is_idle
    demo.link.asked.clear()


def test_after_a_cancel_an_order_that_begins_where_the_drone_is_is_flown() -> None:
    demo = Managed()

    async def go() -> None:
        async with demo.flown():
            await halted_after_a2(demo)
            half = between("A2", "A3")
            demo.drone.hear(from_here("A3 A4", x=half.x_m, y=0.0))
            await asyncio.sleep(2.0)
            assert demo.errors == []
            assert demo.link.asked[0] == "goto", "on to A4, over A3"
            assert demo.drone.vehicle.ahead == ("A3", "A4")

    virtual(go())


def test_where_the_drone_is_measures_how_far_an_order_from_there_may_lead() -> None:
    ways, back, half = WaysHome(floor_status(SITE)), SafeReturn(), between("A2", "A3")
    standing = Standing("A1", counts=False, pace_s=2.0)
    there_and_home_m = (SITE.nodes["A3"].x_m - half.x_m) + SITE.nodes["A3"].x_m
    for left_s, reach in ((2.0 * there_and_home_m + 0.1, 1), (2.0 * there_and_home_m - 0.1, 0)):
        told = status(Phase.HOLD, "A3 A1", battery_left_s=left_s, position=half)
        assert back.reach(["A3"], "here", told, ways, standing) == reach
    lost = status(Phase.HOLD, "A3 A1", battery_left_s=900.0)
    assert back.reach(["A3"], "here", lost, ways, standing) == 0


@pytest.mark.parametrize(
    ("way", "goes"), [("A3", True), ("A2", True), ("A2 A1", True), ("A4", False), ("B4", False)]
)
def test_from_between_two_nodes_an_order_leads_to_one_of_them(way: str, goes: bool) -> None:
    demo = Managed()

    async def go() -> None:
        async with demo.flown():
            await halted_after_a2(demo)
            demo.drone.hear(from_here(way, x=between("A2", "A3").x_m, y=0.0))
            await asyncio.sleep(0.5)
            assert ("NO_ROUTE_TO_TARGET" in demo.errors) is not goes

    virtual(go())


@pytest.mark.parametrize(("way", "goes"), [("A1 A2", True), ("A2 A3", True), ("B4", False), ("A3", False)])
def test_from_its_pad_an_order_leads_over_no_node_that_nobody_released(way: str, goes: bool) -> None:
    demo = Managed()

    async def go() -> None:
        async with demo.flown():
            demo.tell(Phase.PREFLIGHT, position=Position(0.0, 0.0, 0.0, 0.0, 1.0))
            demo.drone.hear(from_here(way, x=0.0, y=0.0))
            await asyncio.sleep(5.0)
            assert demo.errors == ([] if goes else ["NO_ROUTE_TO_TARGET"])
            assert any(one.startswith("plan") for one in demo.link.asked) is goes

    virtual(go())


def test_in_the_air_the_shelves_that_are_counted_take_their_time_from_the_battery() -> None:
    ways, back = WaysHome(floor_status(RACKS)), SafeReturn()
    standing = Standing("A1", counts=True, pace_s=9.0, bare_pace_s=0.0, shelf_s=30.0)
    counts = (NodeCount("A2", "left", (1,)), NodeCount("A3", "left", (1, 2)), NodeCount("A3", "", (1,)))
    ahead = ["A2", "A3", "A2"]  # 30 s, 120 s; counted once
    for left_s, reach in ((29.0, 0), (31.0, 1), (119.0, 1), (121.0, 3)):
        told = status(Phase.FOLLOW, "A2 A1", battery_left_s=left_s)
        assert back.reach(ahead, "A1", told, ways, standing, counts) == reach, left_s
        assert back.reach(ahead, "A1", told, ways, standing, ()) == 3


class Planner:
    """A drone's link: its own plan visits A2 and A3, or nothing once it came down elsewhere."""

    def __init__(self) -> None:
        self.own: tuple[str, ...] = ("A2", "A3")

    async def plan_flight(self, nodes: tuple[str, ...], *_: Any, counts: Any = None, **__: Any) -> Any:
        visits = nodes or self.own
        places = 9 * len(visits) if counts is None else 0
        seconds = 20.0 + 10.0 * places
        told = {"nodes": visits, "levels": (1,), "way": ("A1", *visits), "places": places, "way_m": 10.0}
        return type("Planned", (), {**told, "seconds": seconds})


def test_a_drone_tells_before_its_start_how_long_its_counts_take() -> None:
    link, ways = Planner(), WaysHome(floor_status(RACKS))

    async def go() -> None:
        told = await ask_standing(link, ways, None)  # type: ignore[arg-type]
        shelves = ways.shelves([NodeCount("A2", levels=(1,)), NodeCount("A3", levels=(1,))])
        assert told == Standing("A1", True, 20.0, 2.0, 180.0 / shelves)
        link.own = ()
        assert await ask_standing(link, ways, told) == told, "its own plan leads home alone"  # type: ignore[arg-type]

    virtual(go())


def test_from_a_pad_of_others_whose_way_home_counts_nothing_a_drone_still_counts() -> None:
    demo = Managed()

    async def go() -> None:
        async with demo.flown():
            demo.link.places = 0
            demo.tell(Phase.LAND)
            await asyncio.sleep(1.0)
            demo.tell(Phase.PREFLIGHT)
            await asyncio.sleep(1.0)
            assert demo.drone.standing is not None
            assert demo.drone.standing.counts

    virtual(go())


@pytest.mark.parametrize(("untold", "came"), [(3, "FINISHED"), (99, "FAILED")])
def test_a_count_is_done_when_the_drone_told_what_it_counted(untold: int, came: str) -> None:
    demo = Managed()

    async def go() -> None:
        async with demo.flown():
            demo.link.untold = untold
            demo.drone.hear(order("A1 A2", actions={"A2": [scan("count", side="left")]}))
            await asyncio.sleep(5.0)
            demo.tell(Phase.SCAN, "A2 A2 A1", waits_at="A2")
            await asyncio.sleep(1.0)
            demo.tell(Phase.HOLD, "A2 A1", waits_at="A2")
            demo.happens("visited", "A2")
            await asyncio.sleep(3.0)
            assert demo.actions["count"] == "RUNNING"
            await asyncio.sleep(60.0)
            assert demo.actions["count"] == came
            if came == "FAILED":
                (told,) = demo.state.action_states
                assert told.action_result == "the drone does not tell what it counted: no answer"

    virtual(go())


@pytest.mark.parametrize(
    ("command", "err", "errors"),
    [
        (CommandKind.START, RunError("refused: cannot start: a door is open"), ["COMMAND_REFUSED"]),
        (CommandKind.START, UnavailableError("no answer"), []),
        (CommandKind.GOTO, InputError("refused: no node"), ["NODE_UNREACHABLE"]),
        (CommandKind.GOTO, UnavailableError("no answer"), []),
        (CommandKind.GOTO, RunError("refused: more than 20 commands a second"), ["COMMAND_REFUSED"]),
    ],
)
def test_a_node_is_unreachable_where_the_drone_says_so_of_it(
    command: CommandKind, err: Exception, errors: list[str]
) -> None:
    demo = Managed()

    async def go() -> None:
        async with demo.flown():
            demo.link.fails[command] = err  # type: ignore[assignment]
            demo.drone.hear(order("A1 A2 A3"))
            await asyncio.sleep(5.0)
            if command is CommandKind.GOTO:
                demo.tell(Phase.HOLD, "A2 A1", waits_at="A2")
            else:
                demo.tell(Phase.PREFLIGHT)
            await asyncio.sleep(5.0)
            assert demo.link.asked[-1] == command
            assert demo.errors == errors
            assert bool(demo.drone.trouble) is bool(errors)
            if errors == ["NODE_UNREACHABLE"]:
                about = demo.state.errors[0].error_references or []
                assert [(one.reference_key, one.reference_value) for one in about] == [("nodeId", "A3")]

    virtual(go())


def vehicle(charge: float | None) -> VehicleReport:
    return VehicleReport("GUIDED", False, True, "on_ground", 0.0, 0.0, charge, 12.0, 0.0, 0.0, "")


def test_a_battery_is_charged_on_a_pad_that_charges_while_it_fills() -> None:
    floor, trend = floor_status(SITE), ChargeTrend()
    assert [pad.charge for pad in floor.pads] == [True]
    none = msgspec.structs.replace(floor, pads=())

    def sees(charge: float, at_s: float, **more: Any) -> bool:
        told = status(Phase.PREFLIGHT, vehicle=vehicle(charge), stamp_ns=round(at_s * 1e9), **more)
        return trend.see(told, floor, "A1")

    assert not sees(0.40, 0)
    assert sees(0.41, 100)
    assert sees(0.41, 500), "it is told in percent"
    assert not sees(0.41, 1000), "it fills no more"
    assert sees(0.42, 1001)
    assert not sees(0.95, 1002), "another battery"
    assert sees(0.96, 1003)
    assert not sees(1.00, 1004), "it is full"
    told = status(Phase.PREFLIGHT, vehicle=vehicle(0.5))
    assert not trend.see(told, none, "A1")
    assert not trend.see(msgspec.structs.replace(told, vehicle=vehicle(0.6)), none, "A1")


def test_of_what_the_link_does_not_tell_nothing_is_said() -> None:
    floor, mode = floor_status(SITE), OperatingMode.AUTOMATIC
    seen = status(Phase.FOLLOW, "A3 A1", position=Position(2.0, 0.0, 1.57, 0.8, 1.0), vehicle=vehicle(None))
    told = situation_of(seen, floor, mode, charging=True)
    assert told.velocity is None, "it may fly sideways"
    assert told.power.charging
    assert ("battery", "its charge is not known") in [
        (one.info_type, one.info_descriptor) for one in told.information
    ]


def test_a_drone_that_is_lost_takes_no_new_order() -> None:
    demo = Managed()

    async def go() -> None:
        async with demo.flown():
            await halted_after_a2(demo)
            armed = msgspec.structs.replace(vehicle(0.9), armed=True)
            demo.tell(Phase.RELOCATE, "A3 A3 A1", waits_at="A3", vehicle=armed)
            await asyncio.sleep(0.5)
            demo.drone.hear(from_here("A3", x=between("A2", "A3").x_m, y=0.0))
            await asyncio.sleep(0.5)
            assert sorted(demo.errors) == ["LOCALIZATION_ERROR", "START_NODE_OUT_OF_RANGE"]

    virtual(go())


def test_a_daemon_that_was_started_anew_is_asked_whatever_the_one_before_had_told() -> None:
    demo = Managed()

    async def go() -> None:
        async with demo.flown():
            demo.drone.hear(order("A1 A2"))
            await asyncio.sleep(5.0)
            demo.tell(Phase.PREFLIGHT)
            await asyncio.sleep(5.0)
            assert demo.link.asked[-1] == "start"
            await demo.begins("anew")
            demo.drone.hear(order("A1 A2 A3", name="next"))
            await asyncio.sleep(5.0)
            assert demo.link.asked[-1] == "plan A2 A3, to wait there"

    virtual(go())


def test_what_was_visited_before_the_daemon_was_started_anew_ends_no_count() -> None:
    demo = Managed()

    async def go() -> None:
        async with demo.flown():
            for _ in range(9):
                demo.tell(Phase.PREFLIGHT)
            demo.happens("visited", "A2")
            await asyncio.sleep(1.0)
            await demo.begins("by a clock of its own")
            demo.drone.hear(order("A1 A2", actions={"A2": [scan("count", side="left")]}))
            await asyncio.sleep(5.0)
            demo.tell(Phase.SCAN, "A2 A2 A1", waits_at="A2")
            await asyncio.sleep(5.0)
            assert demo.actions["count"] == "RUNNING"

    virtual(go())
