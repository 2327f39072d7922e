"""The station flies several drones by traffic control: on paper, by virtual time."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Callable, Coroutine, Mapping
from typing import Any, TypeVar, cast

import pytest

from flightd.adapters.ground_link.floor_status import floor_status
from flightd.core.errors import InputError, RunError, UnavailableError
from flightd.core.types import CommandKind, Phase
from flightd.fleet.traffic.cells import CellSize
from flightd.fleet.traffic.dispatcher import Dispatcher
from flightd.fleet.traffic.traffic_control import TrafficControl
from flightd.fleet.vda5050.parts import Action
from flightd.fleet.vda5050.state import ActionStatus
from flightd.fleet.vehicle.drone_factsheet import Measures
from flightd.fleet.vehicle.signals import Progress
from flightd.ground.fleet.fleet_floor import FleetFloor
from flightd.ground.fleet.own_fleet import OwnFleet
from flightd.ground.hub import Hub
from flightd.ground.messages import Act
from flightd.ground.mqtt.managed_drone import ManagedDrone, OrderRules
from flightd.ground.mqtt.shelf_counts import ShelfCounts
from flightd.sim.fleet.judge import FleetJudge
from flightd.site.site import Site
from tests.rigs.event_loops import virtual
from tests.rigs.paper_drones import STEP_S, PaperDrone, hall

T = TypeVar("T")
BODY = Measures(3.0, 1.0, 1.0, 0.6, 0.6, 0.3)


async def until(condition: Callable[[], Any], within_s: float = 30.0) -> None:
    """Let them fly until it holds.  Fails when it does not in time."""
    for _ in range(round(within_s / STEP_S)):
        if condition():
            return
        await asyncio.sleep(STEP_S)
    pytest.fail(f"not within {within_s:g} s")


class PaperFleet:
    """Drones, who flies them, and a judge; as much of a hub as they need."""

    def __init__(self, sites: Mapping[str, Site], hold_s: float = 20.0) -> None:
        self.written: list[tuple[str, str, str, str]] = []
        self.own = OwnFleet(
            sites, BODY, OrderRules(hold_s, lambda *line: self.written.append(line)), self.aside
        )
        self.deciding: asyncio.Event | None = None
        """What is decided comes no sooner."""
        self.pages: dict[tuple[str, str], Any] = {}
        self.drones = {name: PaperDrone(name, site, self.own.tell) for name, site in sites.items()}
        self.judge = FleetJudge(CellSize(upright_m=100.0), 0.0)

    async def aside(self, work: Callable[[], T]) -> T:
        """At once, and what comes of it when a test wants it."""
        found = work()
        if self.deciding is not None:
            await self.deciding.wait()
        return found

    def tell(self, drone: str, topic: str, value: Any) -> None:
        """As the hub tells its pages."""
        self.pages[drone, topic] = value

    @property
    def state(self) -> dict[str, Any]:
        return self.own.document()

    def flown(self, name: str) -> bool:
        """By traffic."""
        return bool(self.state["drones"][name]["flown"])

    async def watch(self) -> None:
        """Nobody meets anybody, at any time."""
        loop = asyncio.get_running_loop()
        while True:
            self.judge.see(loop.time(), [drone.truth for drone in self.drones.values()], work_left=False)
            await asyncio.sleep(STEP_S)

    @contextlib.asynccontextmanager
    async def flying(self) -> AsyncIterator[None]:
        """The station runs meanwhile."""
        hub = cast(Hub, self)
        tasks = [asyncio.ensure_future(drone.run()) for drone in self.drones.values()]
        tasks += [asyncio.ensure_future(self.watch()), asyncio.ensure_future(self.own.run(hub))]
        try:
            await until(lambda: self.state["flies"])
            yield
            assert self.judge.faults == []
        finally:
            tasks[-1].cancel()
            await asyncio.wait(tasks[-1:])
            await self.own.leave()
            for task in tasks[:-1]:
                task.cancel()
            await asyncio.wait(tasks)


async def on_way_to(node: str, fleet: PaperFleet) -> None:
    """Drone b was asked for that, and is on the last leg there."""
    b = fleet.drones["b"]
    fleet.own.ask([node], "b")
    await until(lambda: b.phase is Phase.FOLLOW and b.way[0] == node, 100)


def fly(
    go: Callable[[PaperFleet], Coroutine[Any, Any, None]], names: str = "abc", *, counts: bool = False
) -> PaperFleet:
    """Do `go` while the fleet flies."""
    fleet = PaperFleet({name: hall(name) for name in names})
    for drone in fleet.drones.values():
        drone.counts = counts

    async def whole() -> None:
        async with fleet.flying():
            await go(fleet)

    virtual(whole())
    return fleet


def test_a_tour_is_split_among_the_drones_and_all_come_home() -> None:
    async def go(fleet: PaperFleet) -> None:
        fleet.own.ask(["A3", "A4", "B3", "B4"])
        await until(lambda: len(fleet.state["done"]) == 4, 300)
        await until(
            lambda: all(drone.phase in {Phase.DONE, Phase.PREFLIGHT} for drone in fleet.drones.values()), 300
        )

    fleet = fly(go)
    starts = [drone for what, drone, *_ in fleet.written if what == "start"]
    assert len(starts) == len(set(starts)) > 1
    assert {drone.truth.z_m for drone in fleet.drones.values()} == {0.0}


def test_a_named_drone_visits_what_it_is_asked_for_round_the_one_that_a_person_took() -> None:
    async def go(fleet: PaperFleet) -> None:
        a, b = fleet.drones["a"], fleet.drones["b"]
        await on_way_to("B3", fleet)
        await b.act(Act("by-ann-1", CommandKind.PAUSE))
        fleet.own.ask(["A2"], "c")
        await until(lambda: not fleet.flown("b"))
        assert fleet.pages["b", "manager"] == {"flies": False}
        assert fleet.state["drones"]["b"]["why"] == "a person has it"
        await until(lambda: fleet.state["done"] == ["A2"], 200)
        await until(lambda: fleet.drones["c"].phase is Phase.DONE, 200)
        assert (b.phase, a.phase) == (Phase.HOLD, Phase.PREFLIGHT)
        assert "goto" not in b.commands[b.commands.index("pause") + 1 :], "it is the person's"

        assert fleet.own.hand_over("b", to_manager=True)
        await until(lambda: b.phase is Phase.DONE, 200)  # between two nodes: it comes home by itself
        assert b.commands[-1] == "home"

    fly(go)


def test_who_lost_his_place_for_a_moment_while_he_holds_keeps_others_no_longer() -> None:
    async def go(fleet: PaperFleet) -> None:
        a, b = fleet.drones["a"], fleet.drones["b"]
        await on_way_to("B3", fleet)
        await b.act(Act("by-ann-1", CommandKind.PAUSE))
        fleet.own.ask(["A3"], "a")
        await until(lambda: a.phase is Phase.FOLLOW and a.way[0] == "A3", 100)
        b.sees = False
        await until(lambda: a.phase is Phase.HOLD, 20)
        b.sees = True
        await until(lambda: a.phase is Phase.DONE, 200)
        assert (b.phase, fleet.state["done"]) == (Phase.HOLD, ["A3"])

    fly(go, "ab")


def test_a_drone_that_holds_over_a_node_is_flown_on_when_it_is_given_back() -> None:
    async def go(fleet: PaperFleet) -> None:
        b = fleet.drones["b"]
        fleet.own.ask(["B3"])
        await until(lambda: b.phase is Phase.HOVER and b.way[0] == "B2", 100)
        await b.act(Act("by-ann-1", CommandKind.PAUSE))
        await until(lambda: not fleet.flown("b") and b.phase is Phase.HOLD)
        fleet.own.hand_over("b", to_manager=True)
        await until(lambda: fleet.flown("b"))
        await until(lambda: b.phase is Phase.DONE, 200)
        assert "home" not in b.commands

    fly(go, "b")


def test_who_is_silent_has_his_way_home_to_himself_until_he_is_heard() -> None:
    async def go(fleet: PaperFleet) -> None:
        b = fleet.drones["b"]
        await on_way_to("B3", fleet)
        b.heard = False
        fleet.own.ask(["B2"], "c")
        await until(lambda: not fleet.flown("b"))
        await until(lambda: b.phase is Phase.HOLD, 60)
        await asyncio.sleep(20.0)
        assert (b.phase, b.way[0]) == (Phase.HOLD, "B3"), "nobody paused it at the end of its base"
        b.turn_home()
        await until(lambda: b.phase is Phase.DONE, 200)
        assert fleet.state["done"] == [], "nobody was sent into its way"
        b.heard = True
        await until(lambda: fleet.pages["b", "manager"] == {"flies": False})
        assert fleet.state["done"] == [], "nothing shows where it landed"
        assert fleet.own.hand_over("b", to_manager=True)
        await until(lambda: fleet.state["done"] == ["B2"], 300)
        b.begin_anew()
        await until(lambda: "B3" in fleet.state["done"], 300)

    fly(go)


@pytest.mark.parametrize("restarts_at_once", [False, True])
def test_a_drone_that_landed_in_an_aisle_is_flown_round_until_a_person_says_that_it_is_away(
    restarts_at_once: bool,
) -> None:
    async def go(fleet: PaperFleet) -> None:
        b = fleet.drones["b"]
        fleet.own.ask(["B3"], "b")
        await until(lambda: b.phase is Phase.HOVER and b.way[0] == "B3", 100)
        b.come_down()  # a hazard
        await until(lambda: b.phase is Phase.ABORTED)
        if restarts_at_once:
            b.begin_anew(on_pad=False)
        fleet.own.ask(["A4", "B3"])
        await until(lambda: fleet.state["done"] == ["A4"], 300)
        b.begin_anew(on_pad=False)
        await asyncio.sleep(60.0)
        assert (fleet.state["done"], fleet.flown("b")) == (["A4"], False), "it may lie there still"
        b.begin_anew()
        await asyncio.sleep(10.0)
        assert not fleet.flown("b"), "nobody said that it was put back"
        fleet.own.hand_over("b", to_manager=True)
        await until(lambda: fleet.state["done"] == ["A4", "B3"], 300)

    fly(go)


def test_a_drone_whose_daemon_begins_anew_in_flight_keeps_its_air() -> None:
    async def go(fleet: PaperFleet) -> None:
        b = fleet.drones["b"]
        fleet.own.ask(["B3"], "b")
        await until(lambda: b.phase is Phase.HOVER and b.way[0] == "B3", 100)
        b.begin_anew(on_pad=False)
        assert b.phase is Phase.RECOVER
        fleet.own.ask(["B3"], "c")
        await until(lambda: b.phase is Phase.ABORTED)
        await asyncio.sleep(60.0)
        assert (fleet.state["done"], fleet.flown("b")) == ([], False)

    fly(go, "bc")


@pytest.mark.parametrize("asked", ["B2", "A3"], ids=["on its way", "as far as it may be off"])
def test_who_comes_down_without_a_place_is_not_put_back_on_its_pad(asked: str) -> None:
    async def go(fleet: PaperFleet) -> None:
        b = fleet.drones["b"]
        await on_way_to("B3", fleet)
        b.sees = False
        b.come_down()
        await until(lambda: not fleet.flown("b"))
        fleet.own.ask([asked], "c")
        await asyncio.sleep(60.0)
        assert fleet.state["done"] == []

    fly(go, "bc")


def test_a_pause_between_two_nodes_leaves_a_drone_to_traffic(monkeypatch: pytest.MonkeyPatch) -> None:
    async def go(fleet: PaperFleet) -> None:
        b = fleet.drones["b"]
        await on_way_to("B3", fleet)
        with monkeypatch.context() as patched:
            patched.setattr(TrafficControl, "paused", lambda _: frozenset({"b"}))
            await until(lambda: b.phase is Phase.HOLD)
            await asyncio.sleep(30.0)
            assert (fleet.flown("b"), b.phase) == (True, Phase.HOLD)
        await until(lambda: b.phase is Phase.DONE, 200)
        assert (fleet.state["done"], "home" in b.commands) == (["B3"], False)

    fly(go, "b")


def test_a_pause_that_never_arrived_hides_no_later_one_of_a_person(monkeypatch: pytest.MonkeyPatch) -> None:
    async def go(fleet: PaperFleet) -> None:
        b = fleet.drones["b"]
        await on_way_to("B3", fleet)
        b.refuses[CommandKind.PAUSE] = UnavailableError("no answer")
        with monkeypatch.context() as patched:
            patched.setattr(TrafficControl, "paused", lambda _: frozenset({"b"}))
            await asyncio.sleep(1.0)
        b.refuses.clear()
        assert "pause" not in b.commands
        await asyncio.sleep(12.0)
        assert fleet.flown("b")
        b.ordered_elsewhere("pause")
        await until(lambda: not fleet.flown("b"), 5)

    fly(go, "b", counts=True)


def test_who_was_paused_as_traffic_failed_is_flown_on_by_the_new_one(monkeypatch: pytest.MonkeyPatch) -> None:
    async def go(fleet: PaperFleet) -> None:
        b = fleet.drones["b"]
        fleet.own.ask(["B3"], "b")
        await until(lambda: b.phase is Phase.HOVER and b.way[0] == "B2", 100)
        with monkeypatch.context() as patched:
            patched.setattr(TrafficControl, "paused", lambda _: frozenset({"b"}))
            await until(lambda: b.phase is Phase.HOLD)
            patched.setattr(Dispatcher, "step", lambda *_: 1 / 0)
            await until(lambda: not fleet.state["flies"])
        await until(lambda: b.phase is Phase.DONE, 200)
        assert "home" not in b.commands

    fly(go, "b")


def test_no_drone_is_sent_home_through_the_air_of_another_one() -> None:
    async def go(fleet: PaperFleet) -> None:
        a, b = fleet.drones["a"], fleet.drones["b"]
        await on_way_to("B4", fleet)
        await b.act(Act("by-ann-1", CommandKind.PAUSE))
        await until(lambda: b.phase is Phase.HOLD)
        a.begin_anew()
        a.phase, a.way, a.paused = Phase.HOLD, ["A2", "A1", "A1"], True
        at = a.site.nodes["B2"]
        a.truth.x_m, a.truth.y_m, a.truth.z_m = at.x_m, at.y_m, 1.5
        await until(lambda: not fleet.flown("a"))
        fleet.own.hand_over("b", to_manager=True)
        await asyncio.sleep(60.0)
        assert (b.phase, b.commands[-1]) == (Phase.HOLD, "pause")
        a.begin_anew()
        await until(lambda: fleet.pages["a", "manager"] == {"flies": False})
        fleet.own.hand_over("a", to_manager=True)
        await until(lambda: b.phase is Phase.DONE, 200)
        assert b.commands[-1] == "home"

    fly(go, "ab")


def test_who_makes_for_home_by_himself_is_flown_by_somebody_else() -> None:
    async def go(fleet: PaperFleet) -> None:
        b = fleet.drones["b"]
        fleet.own.ask(["B4"], "b")
        await until(lambda: b.phase is Phase.FOLLOW and b.way[0] == "B3", 100)
        b.way, b.waits = ["B1", "B1"], False  # whatever its reason, and though it could be sent on
        await until(lambda: not fleet.flown("b"), 5)

    fly(go, "b")


def test_the_end_halts_who_flies_while_traffic_has_failed(monkeypatch: pytest.MonkeyPatch) -> None:
    async def go(fleet: PaperFleet) -> None:
        a = fleet.drones["a"]
        fleet.own.ask(["A3"])
        await until(lambda: a.phase is Phase.FOLLOW and a.way[0] == "A2", 100)
        monkeypatch.setattr(Dispatcher, "step", lambda *_: 1 / 0)
        await until(lambda: not fleet.state["flies"])
        assert not a.paused

    assert fly(go, "a").drones["a"].paused


def test_where_traffic_fails_what_it_knows_of_a_drone_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    async def go(fleet: PaperFleet) -> None:
        a, b = fleet.drones["a"], fleet.drones["b"]
        fleet.own.ask(["B3"], "b")
        await until(lambda: b.phase is Phase.HOVER and b.way[0] == "B3", 100)
        b.come_down()
        await until(lambda: b.phase is Phase.ABORTED)
        b.begin_anew(on_pad=False)
        with monkeypatch.context() as patched:
            patched.setattr(Dispatcher, "step", lambda *_: 1 / 0)
            await until(lambda: not fleet.state["flies"])
        a.heard = False
        await until(lambda: fleet.state["flies"])
        fleet.own.ask(["B3"], "c")
        await asyncio.sleep(60.0)
        assert fleet.state["done"] == []

    fly(go)


def test_an_error_about_one_drone_ends_no_other_one(monkeypatch: pytest.MonkeyPatch) -> None:
    async def go(fleet: PaperFleet) -> None:
        with monkeypatch.context() as patched:
            patched.setattr(ManagedDrone, "_step", lambda *_: 1 / 0)
            await asyncio.sleep(1.0)
        await until(lambda: fleet.flown("a") and fleet.flown("b"))
        fleet.own.ask(["A2"], "a")
        await until(lambda: fleet.state["done"] == ["A2"], 200)

    fly(go, "ab")


def test_what_was_decided_while_a_person_took_a_drone_is_not_flown_by_it() -> None:
    async def go(fleet: PaperFleet) -> None:
        b = fleet.drones["b"]
        fleet.deciding = asyncio.Event()
        await asyncio.sleep(1.0)
        fleet.own.ask(["B3"], "b")
        assert fleet.state["open"] == ["B3"], "it was asked for while something is decided"
        fleet.deciding.set()
        fleet.deciding = asyncio.Event()
        await until(lambda: fleet.state["given"] == {"B3": "b"})
        fleet.own.hand_over("b", to_manager=False)
        await asyncio.sleep(5.0)
        assert (b.commands, fleet.flown("b")) == ([], True), "it is as it was before"
        fleet.deciding.set()
        fleet.deciding = None
        fleet.own.ask(["A2"], "a")
        await until(lambda: fleet.state["done"] == ["A2"], 200)
        assert (b.commands, fleet.flown("b"), fleet.state["open"]) == ([], False, ["B3"])

    fly(go, "ab")


def test_what_another_station_commands_takes_a_drone_and_the_end_halts_the_others() -> None:
    async def go(fleet: PaperFleet) -> None:
        a, b = fleet.drones["a"], fleet.drones["b"]
        fleet.own.ask(["A3", "B3"])
        await until(lambda: a.phase is Phase.FOLLOW and b.phase is Phase.FOLLOW, 100)
        b.ordered_elsewhere("home")
        await until(lambda: not fleet.flown("b"))

    fleet = fly(go, "ab")
    assert fleet.drones["a"].paused
    assert not fleet.drones["b"].paused, "it is somebody else's"


def test_where_traffic_fails_everybody_ends_his_base_and_is_brought_home_anew(
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
        assert set(fleet.state["open"]) == {"A3", "B3"}, "the work is kept"
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
    def fails(_: ShelfCounts, action: Action, *__: Any) -> Progress:
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
