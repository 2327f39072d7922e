"""The station flies several drones by traffic control: on paper, by virtual time."""

from __future__ import annotations

import asyncio

import pytest

from flightd.core.errors import UnavailableError
from flightd.core.types import CommandKind, Phase
from flightd.fleet.traffic.dispatcher import Dispatcher
from flightd.fleet.traffic.traffic_control import TrafficControl
from flightd.ground.messages import Act
from flightd.ground.mqtt.managed_drone import ManagedDrone
from tests.rigs.paper_fleet import PaperFleet, fly, on_way_to, until


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
