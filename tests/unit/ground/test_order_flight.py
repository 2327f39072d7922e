"""What a drone is asked next for an order, and how far one may lead it."""

from __future__ import annotations

import asyncio
import itertools
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec
import pytest

from flightd.adapters.ground_link.floor_status import floor_status
from flightd.adapters.ground_link.messages.counts import NodeCount
from flightd.adapters.ground_link.messages.floor import FloorWay
from flightd.adapters.ground_link.messages.published import EventReport, Position
from flightd.core.errors import InputError
from flightd.core.told_codes import told_codes
from flightd.core.types import CommandKind, EventLevel, Phase
from flightd.fleet.vda5050.codec import Version
from flightd.fleet.vda5050.state import OperatingMode
from flightd.fleet.vehicle.abilities import ScanShelf
from flightd.fleet.vehicle.drone_factsheet import Measures
from flightd.ground.messages import LinkState
from flightd.ground.mqtt.linked_floor import WaysHome, floor_of_link
from flightd.ground.mqtt.managed_drone import ManagedDrone, OrderRules
from flightd.ground.mqtt.order_flight import CommandNext, Next, PlanNext, Stuck, Wish, next_act, reached
from flightd.ground.mqtt.reported_drone import situation_of, takes_orders
from flightd.ground.mqtt.safe_return import SafeReturn, Standing
from flightd.ground.mqtt.sent_commands import SentCommands
from flightd.ground.mqtt.shelf_counts import ShelfCounts, counted_in_words, levels_of
from flightd.site.site import Side
from flightd.site.site_file import load_site
from tests.rigs.event_loops import virtual
from tests.unit.fleet.vehicle_rig import floor_of, order, scan
from tests.unit.ground.managed_rig import IN_AIR, Link, status

CONFIGS = Path(__file__).parents[3] / "configs"
SITE = load_site(CONFIGS / "site-demo.toml")
RACKS = load_site(CONFIGS / "site-racks-small.toml")
GOTO, PAUSE, RESUME = CommandKind.GOTO, CommandKind.PAUSE, CommandKind.RESUME


def nodes(text: str) -> tuple[str, ...]:
    return tuple(text.split())


FLIGHTS: list[tuple[Phase, str, str, str, Next]] = [
    # phase, way, ahead, last, what is asked
    (Phase.FOLLOW, "A2 A3 A4 A1", "A2 A3 A4", "A1", None),
    (Phase.FOLLOW, "A4 A1", "A4", "A3", CommandNext(GOTO, "A4")),  # before it is done with the last node
    (Phase.FOLLOW, "A4 A4 A1", "A4", "A3", None),
    (Phase.FOLLOW, "A4 A4 A1", "A4 A5", "A3", CommandNext(GOTO, "A5")),
    (Phase.HOVER, "A4 A4 A1", "", "A4", CommandNext(PAUSE)),
    (Phase.HOLD, "A4 A4 A1", "", "A4", None),
    (Phase.HOLD, "A4 A4 A1", "A5", "A4", CommandNext(GOTO, "A5")),  # a base that is extended
    (Phase.HOLD, "A4 A5 A1", "A5", "A4", CommandNext(RESUME)),
    (Phase.FOLLOW, "A3 A4 A5 A1", "A3", "A2", CommandNext(GOTO, "A3")),  # cancelled
    (Phase.FOLLOW, "A3 A4 A1", "", "A2", CommandNext(PAUSE)),  # paused on its way
    (Phase.HOLD, "A3 A4 A1", "", "A2", None),
    (Phase.HOLD, "A3 A4 A1", "A1", "A2", Stuck("A3")),
    (Phase.HOVER, "A1 A1", "", "A1", CommandNext(GOTO, "A1")),  # the last one of a way is the pad
    (Phase.RELOCATE, "A3 A1", "A2", "A1", None),
    (Phase.LAND, "A1", "A2", "A1", None),
]  # fmt: skip


@pytest.mark.parametrize(("phase", "way", "ahead", "last", "asked"), FLIGHTS)
def test_a_drone_in_the_air_is_sent_on_before_it_turns_home(
    phase: Phase, way: str, ahead: str, last: str, asked: Next
) -> None:
    possible = () if phase is Phase.LAND else IN_AIR
    told = status(phase, way, possible=possible)
    assert next_act(told, Wish(nodes(ahead), last), ("p", PlanNext(()))) == asked


WAITS = [
    # phase, way, where it waits, ahead, last, what is asked
    (Phase.FOLLOW, "A4 A4 A1", "A4", "A4", "A3", None),
    (Phase.HOVER, "A4 A4 A1", "A4", "", "A4", None),
    (Phase.HOVER, "A4 A3 A1", "A4", "", "A4", None),  # the way home is not what comes next
    (Phase.HOLD, "A4 A3 A1", "A4", "", "A4", None),
    (Phase.HOLD, "A4 A3 A1", "A4", "A3", "A4", CommandNext(GOTO, "A3", waits=True)),
    (Phase.FOLLOW, "A4 A4 A1", "A4", "A4 A5", "A3", CommandNext(GOTO, "A5", waits=True)),
    (Phase.HOLD, "A5 A5 A1", "A5", "A5", "A4", CommandNext(RESUME)),  # it was paused besides
    (Phase.FOLLOW, "A3 A4 A5 A5 A1", "A5", "A3", "A2", CommandNext(GOTO, "A3", waits=True)),  # cancelled
    (Phase.HOVER, "A4 A3 A1", "", "", "A4", CommandNext(GOTO, "A4", waits=True)),  # it would fly home
    (Phase.FOLLOW, "A3 A4 A4 A1", "A4", "", "A2", CommandNext(PAUSE)),  # paused on its way
]


@pytest.mark.parametrize(("phase", "way", "waits_at", "ahead", "last", "asked"), WAITS)
def test_a_drone_that_waits_at_the_end_of_its_way_is_sent_on_from_there_however_late(
    phase: Phase, way: str, waits_at: str, ahead: str, last: str, asked: Next
) -> None:
    told = status(phase, way, waits_at=waits_at)
    assert next_act(told, Wish(nodes(ahead), last), ("p", PlanNext(()))) == asked


def test_a_drone_that_waits_counts_once_more_where_it_is_and_lands_where_it_may() -> None:
    counting = Wish((), "A4", works=True)
    again = CommandNext(GOTO, "A4", waits=True)
    assert next_act(status(Phase.HOLD, "A4 A3 A1", waits_at="A4"), counting, None) == again
    assert next_act(status(Phase.HOLD, "A4 A4 A1", waits_at="A4"), counting, None) == CommandNext(RESUME)
    assert next_act(status(Phase.SCAN, "A4 A4 A1", waits_at="A4"), counting, None) is None
    lands = Wish((), "A1", lands=True)
    assert next_act(status(Phase.HOLD, "A1 A1", waits_at="A1"), lands, None) == CommandNext(GOTO, "A1")
    assert next_act(status(Phase.FOLLOW, "A1", waits_at=""), lands, None) is None


def test_a_node_that_was_visited_between_two_reports_was_reached() -> None:
    wish = Wish(("A2", "A3"), "A1")
    assert reached(status(Phase.FOLLOW, "A2 A2 A1", waits_at="A2"), wish) is None
    assert reached(status(Phase.HOLD, "A2 A1", waits_at="A2"), wish) == "A2"


def test_a_count_is_not_paused_and_a_drone_on_its_way_home_is_not_sent_on() -> None:
    counting = Wish((), "A4", works=True)
    assert next_act(status(Phase.SCAN, "A4 A4 A1"), counting, None) is None
    assert next_act(status(Phase.HOLD, "A4 A4 A1"), counting, None) == CommandNext(RESUME)
    home = status(Phase.FOLLOW, "A1", possible=(PAUSE,))
    assert next_act(home, Wish(("A2",), "A1"), None) is None
    assert not takes_orders(home, ["p"])


def test_on_the_ground_the_base_is_planned_and_then_started() -> None:
    wish = Wish(("A2", "A3", "A2"), "A1")
    stands = status(Phase.PREFLIGHT)
    assert next_act(stands, wish, None) == PlanNext(("A2", "A3")), "a plan visits each node once"
    assert next_act(stands, wish, ("p", PlanNext(("A2",)))) == PlanNext(("A2", "A3"))
    assert next_act(stands, wish, ("p", PlanNext(("A2", "A3")))) == CommandNext(CommandKind.START)
    held = status(Phase.PREFLIGHT, possible=(CommandKind.PLAN,))
    assert next_act(held, wish, ("p", PlanNext(("A2", "A3")))) is None, "it is not ready"
    starts = status(Phase.ARMING, possible=(PAUSE,))
    assert next_act(starts, Wish((), "A1"), ("p", PlanNext(("A2", "A3")))) == CommandNext(PAUSE)
    assert next_act(starts, Wish((), "A1"), ("other", PlanNext(()))) is None


def test_a_drone_is_told_what_it_counts_at_each_node_and_told_again_where_that_changes() -> None:
    left, right, low = NodeCount("A2", "left"), NodeCount("A2", "right", (1,)), NodeCount("A3", "", (2,))
    wish = Wish(("A2", "A3"), "A1", counts=(left, low))
    plan = PlanNext(("A2", "A3"), (left, low))
    stands, flies = status(Phase.PREFLIGHT), status(Phase.FOLLOW, "A2 A3 A3 A1", waits_at="A3")
    assert next_act(stands, wish, ("p", PlanNext(("A2", "A3"), (right, low)))) == plan
    assert next_act(stands, wish, ("p", plan)) == CommandNext(CommandKind.START)
    there = replace(wish, given=(low, left))
    assert next_act(flies, there, None) is None
    more = CommandNext(GOTO, "A4", waits=True, counts=())
    ends = status(Phase.FOLLOW, "A3 A3 A1", waits_at="A3")
    assert next_act(ends, replace(there, ahead=("A3", "A4"), last="A2"), None) == more, "nothing is counted"
    holds = status(Phase.HOLD, "A1 A2 A2 A1", waits_at="A2")
    other = Wish(("A2",), "A1", counts=(right,), given=(left,))
    assert next_act(holds, other, None) == CommandNext(GOTO, "A2", waits=True, counts=(right,))
    assert next_act(holds, replace(other, given=(right,)), None) == CommandNext(RESUME)
    assert next_act(holds, replace(other, counts=None), None) == CommandNext(RESUME), "a daemon of before"


def test_a_node_is_reached_once() -> None:
    hovers = status(Phase.HOVER, "A2 A3 A1")
    assert reached(hovers, Wish(("A2", "A3"), "A1")) == "A2"
    assert reached(hovers, Wish(("A1", "A2"), "A2")) is None


@pytest.mark.parametrize(
    ("phase", "way", "beyond_m", "drives"),
    [
        (Phase.HOLD, "A4 A4 A1", 0.1, False),  # however the air moves it there
        (Phase.HOVER, "A5 A4 A1", 0.1, False),
        (Phase.HOLD, "A5 A4 A1", 0.1, True),  # paused, it comes to a stop on its way to the next one
        (Phase.FOLLOW, "A5 A4 A1", 0.1, True),
        (Phase.FOLLOW, "A4 A4 A1", 0.1, False),
        (Phase.HOLD, "A4 A4 A1", 0.5, True),
    ],
)
def test_a_drone_that_is_held_at_its_node_does_not_drive(
    phase: Phase, way: str, beyond_m: float, drives: bool
) -> None:
    at = SITE.nodes["A4"]
    seen = status(phase, way, position=Position(at.x_m + beyond_m, at.y_m, 0.0, speed_mps=0.2, integrity=1.0))
    told = situation_of(seen, floor_status(SITE), OperatingMode.AUTOMATIC, last_node="A4")
    assert told.driving is drives


@pytest.mark.parametrize("name", ["demo", "racks", "racks-small"])
def test_the_floor_of_the_link_is_that_of_the_site(name: str) -> None:
    site = load_site(CONFIGS / f"site-{name}.toml")
    assert floor_of_link(floor_status(site)) == floor_of(site)


def test_a_closed_line_is_no_way_and_lengthens_the_way_home() -> None:
    floor = floor_status(SITE)
    shut = msgspec.structs.replace(floor, ways=(FloorWay("A1", "A2", closed=True),))
    assert {("A1", "A2"), ("A2", "A1")}.isdisjoint(floor_of_link(shut).ways)
    (there,) = WaysHome(floor).there_and_home_m("A1", ["A2"])
    assert there == pytest.approx(3.0)
    assert next(WaysHome(shut).there_and_home_m("A3", ["A2"])) > 15.0


def test_a_base_leads_no_further_than_the_battery_brings_the_drone_home() -> None:
    ways, back = WaysHome(floor_status(SITE)), SafeReturn()
    standing = Standing("A1", counts=False, pace_s=2.0)
    ahead = ["A2", "A3", "A4"]  # 3.0, 5.4 and 9.0 m there and back
    for left_s, reach in ((30.0, 3), (11.0, 2), (5.9, 0), (None, 3)):
        told = status(Phase.FOLLOW, "A2 A1", battery_left_s=left_s)
        assert back.reach(ahead, "A1", told, ways, standing) == reach, left_s
    stands = status(Phase.PREFLIGHT)
    assert back.reach(ahead, "A1", stands, ways, standing) is None
    assert back.is_due(0.0)

    class Link:
        """Two nodes are flown on one battery, the fourth cannot be flown to."""

        async def plan_flight(self, asked: tuple[str, ...], *_: Any, **__: Any) -> Any:
            if len(asked) > 3:
                raise InputError("a full battery does not reach it")
            return type("Planned", (), {"batteries": 1 if len(asked) < 3 else 2})

    virtual(back.ask(Link(), 0.0))  # type: ignore[arg-type]
    assert back.reach(ahead, "A1", stands, ways, standing) == 2
    assert not back.is_due(1.0)
    assert back.is_due(60.0), "the battery drains"


def test_a_command_that_is_not_the_managers_takes_the_drone_from_him() -> None:
    drone = ManagedDrone("demo", Version.V2_1, Measures(3, 1, 1, 1, 1, 1), OrderRules(60, lambda *_: None))
    taken: list[bool] = []
    drone.on_taken = taken.append

    def event(seq: int, text: str, level: EventLevel = EventLevel.INFO, name: str = "command") -> EventReport:
        return EventReport(1, "s", seq, seq, level, name, text)

    drone.tell("events", (event(7, "start"),))
    assert taken == [], "what was before is past"
    told = (
        event(7, "start"),
        event(8, "goto refused: no way", EventLevel.WARNING),
        event(9, "A2", name="visited"),
    )
    drone.tell("events", told)
    assert taken == []
    drone.tell("events", (*told, event(10, "pause")))
    assert taken == [True]
    drone.taken_by_person(False)
    assert taken == [True, False]


def test_a_command_is_the_managers_once_and_as_long_as_it_can_take_effect() -> None:
    def pause(at_s: float) -> EventReport:
        return EventReport(1, "s", 1, round(at_s * 1e9), EventLevel.INFO, "command", "pause")

    sent = SentCommands()
    sent.note("pause", 0)
    assert [sent.take(pause(at_s)) for at_s in (9.0, 9.5)] == [True, False]
    sent.note("pause", 0)
    assert not sent.take(pause(11.0)), "it never arrived"
    sent.note("pause", 20_000_000_000)
    sent.refused("pause")
    assert not sent.take(pause(21.0))


@pytest.mark.parametrize("knows", [True, False])
def test_what_an_order_asks_to_be_counted_goes_to_the_drone_node_by_node(knows: bool) -> None:
    drone = ManagedDrone("demo", Version.V3_0, Measures(3, 1, 1, 1, 1, 1), OrderRules(60, lambda *_: None))
    link, floor = Link(), floor_status(RACKS)
    if not knows:
        before = tuple(msgspec.structs.replace(node, left=None, right=None) for node in floor.nodes)
        floor = msgspec.structs.replace(floor, nodes=before)

    def tell(phase: Phase, way: str, seq: int, **more: Any) -> None:
        drone.tell("status", status(phase, way, seq=seq, stamp_ns=seq * 10**9, **more))

    def visited(seq: int, node: str) -> None:
        drone.tell("events", (EventReport(1, "s", seq, seq * 10**9, EventLevel.INFO, "visited", node),))

    async def go() -> None:
        running = asyncio.create_task(drone.run(link))  # type: ignore[arg-type]
        drone.tell("link", LinkState(True, 0.0, 1.0, 0, False, False, ""))
        drone.tell("welcome", {"session": "one", "role": "operator", "floor": floor})
        drone.tell("events", ())
        tell(Phase.PREFLIGHT, "", 1, waits_at="")
        await asyncio.sleep(3.0)
        low, right = scan("low", levels=[1] if knows else [1, 2]), scan("right", levels=[2, 1], side="right")
        drone.hear(order("A1 A2 A3", actions={"A2": [low], "A3": [right]}))
        await asyncio.sleep(5.0)
        plan = drone.kept().plans[-1]
        at_a2, at_a3 = (NodeCount("A2", "left", (1,)),), (NodeCount("A3", "right", (1, 2)),)
        assert link.counts[-1] == (at_a2 if knows else None)
        assert link.levels == (() if knows else (1, 2))
        tell(Phase.SCAN, "A2 A2 A1", 100, plan=plan, waits_at="A2")
        await asyncio.sleep(1.0)
        visited(101, "A2")
        tell(Phase.HOLD, "A2 A1", 102, plan=plan, waits_at="A2")
        await asyncio.sleep(3.0)
        assert link.asked[-1] == "goto"
        assert link.counts[-1] == (at_a3 if knows else None)
        assert not drone.vehicle.is_over("right")
        del link.asked[:]
        refused = EventReport(1, "s", 103, 103, EventLevel.WARNING, "command", "goto A3 refused: no way")
        drone.tell("events", (refused,))
        tell(Phase.FOLLOW, "A3 A3 A1", 110, plan=plan, waits_at="A3")
        await asyncio.sleep(1.5)
        assert link.asked == ["goto"] * knows, "what it is to count there is told again"
        running.cancel()
        await asyncio.wait([running])

    virtual(go())


@pytest.mark.parametrize(("waits_at", "asked"), [("", "plan A2, to wait there"), (None, "plan A2")])
def test_a_daemon_that_does_not_tell_how_its_way_ends_is_not_asked_to_wait(
    waits_at: str | None, asked: str
) -> None:
    drone = ManagedDrone("demo", Version.V3_0, Measures(3, 1, 1, 1, 1, 1), OrderRules(60, lambda *_: None))
    link = Link()

    async def go() -> None:
        running = asyncio.create_task(drone.run(link))  # type: ignore[arg-type]
        told = status(Phase.PREFLIGHT, plan="", waits_at=waits_at)
        welcome = {"session": "one", "role": "operator", "floor": floor_status(SITE)}
        heard = LinkState(True, 0.0, 1.0, 0, False, False, "")
        for topic, value in (("link", heard), ("welcome", welcome), ("status", told)):
            drone.tell(topic, value)
        await asyncio.sleep(3.0)
        drone.hear(order("A1 A2"))
        await asyncio.sleep(5.0)
        assert link.asked[0] == asked
        running.cancel()
        await asyncio.wait([running])

    virtual(go())


@pytest.mark.parametrize("anew", [True, False])
def test_no_order_outlives_the_drones_daemon_or_a_persons_command(anew: bool) -> None:
    drone = ManagedDrone("demo", Version.V3_0, Measures(3, 1, 1, 1, 1, 1), OrderRules(60, lambda *_: None))
    link = Link()
    heard = LinkState(True, 0.0, 1.0, 0, False, False, "")

    def told(session: str, phase: Phase, plan: str) -> None:
        welcome = {"session": session, "role": "operator", "floor": floor_status(SITE)}
        for topic, value in (("link", heard), ("welcome", welcome), ("status", status(phase, plan=plan))):
            drone.tell(topic, value)

    async def go() -> None:
        running = asyncio.create_task(drone.run(link))  # type: ignore[arg-type]
        told("one", Phase.PREFLIGHT, "")
        await asyncio.sleep(3.0)
        drone.hear(order("A1 A2 A3"))
        await asyncio.sleep(5.0)
        assert link.asked[0] == "plan A2 A3"
        if anew:
            told("two", Phase.PREFLIGHT, "")
        else:
            drone.taken_by_person()
            await asyncio.sleep(1.0)
            drone.taken_by_person(False)
        del link.asked[:]
        await asyncio.sleep(10.0)
        assert link.asked == []
        assert drone.vehicle.is_idle
        running.cancel()
        await asyncio.wait([running])

    virtual(go())


@pytest.mark.parametrize(("other", "levels"), [([1, 2], (1, 2)), ([1], ())])
def test_a_daemon_of_before_counts_the_levels_that_all_counts_of_the_order_ask_for(
    other: list[int], levels: tuple[int, ...]
) -> None:
    actions = {"A2": [scan("a", levels=[2, 1])], "A3": [scan("b", levels=other, side="right")]}
    assert levels_of(order("A1 A2 A3", 2, actions=actions), ("A2",)) == levels
    assert levels_of(order("A1 A2 A3", actions=actions), ("A1",)) == ()
    counts, flies = ShelfCounts(), status(Phase.FOLLOW, "A3 A1")
    counts.levels = levels
    failed = counts.begin(scan("c", levels=[3]), "A3", flies, None, tells=False)
    assert (failed is not None) is bool(levels)


def test_a_count_is_told_in_words() -> None:
    rows = [
        {"node": "A2", "texts": "PALLET-1 4006381333931"},
        {"node": "A2", "texts": ""},
        {"node": "A3", "texts": "X"},
    ]
    expects = ScanShelf(expected=("PALLET-1", "X"))
    assert counted_in_words(rows, "A2", ScanShelf()) == "1 of 2 places with codes"
    assert counted_in_words(rows, "A2", expects) == "1 of 2 places with codes; not read: X"
    assert counted_in_words(rows, "B1", expects) is None
    assert counted_in_words(rows, "A2", ScanShelf((1,), Side.LEFT)) == "1 of 2 places with codes", "not told"


def test_a_code_that_holds_a_space_is_one_code() -> None:
    rows = [{"node": "A2", **told_codes(["LOT 12", "LOT 13"])}]
    expects = ScanShelf(expected=("LOT 12", "LOT 13", "LOT", "LOT 12 LOT 13"))
    told = "1 of 1 places with codes; not read: LOT, LOT 12 LOT 13"
    assert counted_in_words(rows, "A2", expects) == told


def test_a_count_tells_only_of_the_side_and_levels_that_were_asked_for() -> None:
    places = itertools.product(("left", "right"), "12")
    rows = [{"node": "A2", "side": side, "level": level, "texts": side + level} for side, level in places]
    assert counted_in_words(rows, "A2", ScanShelf()) == "4 of 4 places with codes"
    assert counted_in_words(rows, "A2", ScanShelf((), Side.LEFT)) == "2 of 2 places with codes"
    assert counted_in_words(rows, "A2", ScanShelf((2,))) == "2 of 2 places with codes"
    one = ScanShelf((1,), Side.RIGHT, ("right1", "left1"))
    assert counted_in_words(rows, "A2", one) == "1 of 1 places with codes; not read: left1"
