"""The standard's rules on cancellation, instant actions, pause, traversal and blocking types, one test each
(2.1: 6.6.3, 6.9, 6.10.2, 6.12; 3.0: 6.1.3, 6.2, 6.6.2)."""

from __future__ import annotations

from collections.abc import Sequence

import msgspec
import pytest

from flightd.fleet.vda5050.codec import Version
from flightd.fleet.vda5050.order import AllowedDeviation
from flightd.fleet.vda5050.parts import BlockingType
from flightd.fleet.vda5050.state import ActionStatus, OperatingMode
from flightd.fleet.vehicle.signals import (
    Abort,
    Begin,
    Fly,
    Hold,
    Output,
    PauseAction,
    Progress,
    Reached,
    ResumeAction,
)
from tests.unit.fleet.vehicle_rig import (
    BOTH,
    V3,
    Drone,
    at,
    facts,
    flown,
    instant,
    only,
    order,
    scan,
)


@BOTH
def test_a_cancelled_order_ends_at_the_next_node(version: Version) -> None:
    drone = Drone(version)
    drone.say(order("A1 A2 A3 A4", released=3, actions={"A3": [scan("s")]}))
    drone.is_at(None, driving=True)
    assert flown(drone.say(instant("cancelOrder", "c"))) == "A2"
    assert drone.ahead == "A2"
    assert drone.statuses == {"s": "FAILED", "c": "RUNNING"}
    assert drone.say(Reached("A2")) == []
    assert (drone.ahead, drone.state.last_node_id, drone.statuses["c"]) == ("", "A2", "RUNNING")
    drone.is_at("A2")
    assert drone.statuses == {"s": "FAILED", "c": "FINISHED"}
    assert (drone.state.order_id, drone.state.order_update_id) == ("o", 0)


@BOTH
def test_a_vehicle_that_stands_cancels_at_once(version: Version) -> None:
    drone = Drone(version)
    drone.say(order("A1 A2 A3"))
    assert drone.say(instant("cancelOrder", "c")) == [Hold()]
    assert drone.statuses["c"] == "FINISHED"


@BOTH
def test_scheduled_and_running_actions_fail_when_an_order_is_cancelled(version: Version) -> None:
    drone = Drone(version)
    drone.say(order("A1 A2", actions={"A1": [scan("now"), scan("later")], "A2": [scan("there")]}))
    out = drone.say(instant("cancelOrder", "c"))
    assert only(out, Abort) == [Abort("now")]
    assert drone.statuses == {"now": "FAILED", "later": "FAILED", "there": "FAILED", "c": "FINISHED"}


@BOTH
def test_a_cancel_runs_until_actions_that_cannot_be_cancelled_are_over(
    version: Version, monkeypatch: pytest.MonkeyPatch
) -> None:
    from flightd.fleet.vehicle import abilities, action_queue, refusals

    fixed = {
        "scanShelf": abilities.Ability(lambda *_: None, frozenset({BlockingType.HARD}), cancellable=False)
    }
    monkeypatch.setattr(action_queue, "ABILITIES", fixed)
    monkeypatch.setattr(refusals, "ABILITIES", fixed)
    drone = Drone(version)
    drone.say(order("A1 A2", actions={"A1": [scan("now"), scan("later")]}))
    assert only(drone.say(instant("cancelOrder", "c")), Abort) == []
    assert drone.statuses == {"now": "RUNNING", "later": "FAILED", "c": "RUNNING"}
    assert drone.say(Progress("now", ActionStatus.FINISHED)) == []
    assert drone.statuses == {"now": "FINISHED", "later": "FAILED", "c": "FINISHED"}


@BOTH
def test_after_a_cancel_a_new_order_begins_where_the_vehicle_is(version: Version) -> None:
    drone = Drone(version)
    drone.say(order("A1 A2 A3"))
    drone.is_at(None, driving=True, at_m=(0.7, 0.0))
    drone.say(instant("startPause"))
    drone.is_at(None, at_m=(0.7, 0.0))
    drone.say(instant("cancelOrder"))
    drone.say(instant("stopPause"))
    here = msgspec.structs.replace(order("A1 A2", name="n1").nodes[0], node_id="here")
    first = msgspec.structs.replace(order("A1 A2", name="n1"), nodes=[here, order("A1 A2").nodes[1]])
    drone.say(at(first, x=0.7, y=0.0, map_id="demo"))
    assert (drone.errors, drone.ahead) == ([], "A2")
    drone.say(instant("cancelOrder", "again"))
    wide = AllowedDeviation(a=1.0, b=1.0, theta=0.0)
    drone.say(at(order("A1 A2", name="n2"), x=0.0, y=0.0, map_id="demo", allowed_deviation_xy=wide))
    assert (drone.errors, drone.state.order_id) == ([], "n2")


@BOTH
def test_no_update_of_a_cancelled_order_is_accepted(version: Version) -> None:
    drone = Drone(version)
    drone.say(order("A1 A2", released=1))
    drone.say(instant("cancelOrder"))
    drone.say(order("A1 A2", number=1))
    assert drone.errors == ["ORDER_UPDATE_FOLLOWING_CANCEL"]
    assert drone.ahead == ""


@BOTH
def test_a_cancel_without_an_order_fails(version: Version) -> None:
    drone = Drone(version)
    drone.say(instant("cancelOrder", "c1"))
    assert (drone.statuses, drone.errors, drone.about("actionId")) == (
        {"c1": "FAILED"}, ["NO_ORDER_TO_CANCEL"], ["c1"]
    )  # fmt: skip
    assert drone.state.errors[0].error_level == "WARNING"
    drone.say(order("A1 A2"))
    drone.say(instant("cancelOrder", "c2"))
    drone.say(instant("cancelOrder", "c3"))
    assert (drone.statuses["c2"], drone.statuses["c3"]) == ("FINISHED", "FAILED")


@BOTH
def test_a_cancel_of_another_order_fails(version: Version) -> None:
    drone = Drone(version)
    drone.say(order("A1 A2"))
    drone.say(instant("cancelOrder", "c", orderId="x"))
    assert (drone.statuses["c"], drone.errors, drone.ahead) == ("FAILED", ["NO_ORDER_TO_CANCEL"], "A2")
    drone.say(instant("cancelOrder", "d", orderId="o"))
    assert drone.statuses["d"] == "FINISHED"


# instant actions (6.9 / 6.2.1), pause, traversal (6.10.2 / 6.6.2), blocking types (6.12 / 6.2.2)


@BOTH
def test_a_pause_is_there_when_the_vehicle_stands_and_ends_with_stop_pause(version: Version) -> None:
    drone = Drone(version)
    drone.say(order("A1 A2 A3"))
    drone.is_at(None, driving=True)
    assert drone.say(instant("startPause", "p")) == [Hold()]
    assert (drone.state.paused, drone.statuses["p"]) == (False, "RUNNING")
    drone.is_at(None)
    assert (drone.state.paused, drone.statuses["p"]) == (True, "FINISHED")
    drone.say(order("A3 A4", number=1, first=4))
    assert drone.ahead == "A2 A3 A4"  # an update is taken, and waits
    assert flown(drone.say(instant("stopPause", "q"))) == "A2 A3 A4"
    assert (drone.state.paused, drone.statuses["q"]) == (False, "FINISHED")


@BOTH
def test_a_pause_holds_actions_and_begins_none(version: Version) -> None:
    drone = Drone(version)
    drone.say(order("A1 A2", actions={"A1": [scan("a"), scan("b")]}))
    assert drone.say(instant("startPause")) == [PauseAction("a")]
    assert drone.statuses["a"] == "PAUSED"
    drone.say(Progress("a", ActionStatus.FINISHED))
    assert drone.statuses["b"] == "WAITING"
    assert only(drone.say(instant("stopPause")), Begin)[0].action.action_id == "b"
    drone.say(instant("startPause", "again"))
    assert drone.say(instant("stopPause", "again too")) == [ResumeAction("b")]


@BOTH
def test_a_paused_vehicle_can_be_cancelled(version: Version) -> None:
    drone = Drone(version)
    drone.say(order("A1 A2"))
    drone.is_at(None, driving=True)
    drone.say(instant("startPause"))
    drone.is_at(None)
    drone.say(instant("cancelOrder"))
    assert (drone.ahead, drone.statuses["cancelOrder"]) == ("", "FINISHED")


@BOTH
def test_an_instant_action_that_comes_twice_is_done_once(version: Version) -> None:
    drone = Drone(version)
    assert len(facts(drone.say(instant("factsheetRequest", "f")))) == 1
    assert drone.say(instant("factsheetRequest", "f")) == []
    drone.say(order("A1 A2"))
    assert drone.say(instant("factsheetRequest", "f")) == []
    assert len(facts(drone.say(instant("factsheetRequest", "g")))) == 1


@BOTH
def test_a_state_is_sent_when_it_is_asked_for_when_something_changes_and_every_30_s(version: Version) -> None:
    drone = Drone(version)
    told = len(drone.states)
    drone.say()
    drone.is_at("A1", at_m=(0.01, 0.0))  # to move a little is no event
    assert len(drone.states) == told
    drone.say(instant("stateRequest"))
    assert (len(drone.states), drone.statuses["stateRequest"]) == (told + 1, "FINISHED")
    drone.say(after_s=29.0)
    assert len(drone.states) == told + 1
    drone.say(after_s=1.1)
    assert len(drone.states) == told + 2


@BOTH
def test_an_unknown_instant_action_fails_until_one_is_accepted(version: Version) -> None:
    drone = Drone(version)
    drone.say(instant("scanShelf", "x"))
    assert (drone.statuses["x"], drone.errors) == ("FAILED", ["INVALID_INSTANT_ACTION"])
    assert drone.about("actionId") == ["x"]
    drone.say(order("A1 A2"))
    assert drone.errors == ["INVALID_INSTANT_ACTION"]
    drone.say(instant("stateRequest"))
    assert drone.errors == []


@BOTH
def test_finished_instant_actions_are_told_until_they_are_cleared_and_not_dropped_without_a_word(
    version: Version,
) -> None:
    drone = Drone(version)
    for i in range(47):
        drone.say(instant("stateRequest", f"r{i}"))
    assert drone.errors == []
    for i in range(47, 64):
        drone.say(instant("stateRequest", f"r{i}"))
        assert drone.errors == ["INSTANT_ACTION_STATES_FULL"]
    assert drone.state.errors[0].error_level == "URGENT"
    assert "told no more" not in (drone.state.errors[0].error_description or "")
    for i in range(64, 100):
        drone.say(instant("stateRequest", f"r{i}"))
    assert len(drone.state.instant_action_states) == 64
    assert (drone.state.errors[0].error_description or "").endswith("the oldest 36 are told no more")
    drone.say(instant("clearInstantActions", "c") if version is V3 else order("A1 A2"))
    assert (drone.errors, drone.statuses) == ([], {"c": "FINISHED"} if version is V3 else {})


@BOTH
def test_reaching_a_node_removes_it_and_its_edge_and_begins_its_actions(version: Version) -> None:
    drone = Drone(version)
    assert flown(drone.say(order("A1 A2 A3", actions={"A2": [scan("s")]}))) == "A2"
    out = drone.say(Reached("A2"))
    assert [one.action.action_id for one in only(out, Begin)] == ["s"]
    assert (drone.ahead, [one.edge_id for one in drone.state.edge_states]) == ("A3", ["A2-A3"])
    assert (drone.state.last_node_id, drone.state.last_node_sequence_id) == ("A2", 2)
    assert flown(drone.say(Progress("s", ActionStatus.FAILED))) == "A3"


@BOTH
def test_a_node_that_is_not_of_the_order_does_not_become_the_last_one(version: Version) -> None:
    drone = Drone(version)
    drone.say(order("A1 A2 A3"))
    drone.say(Reached("B4"))
    assert (drone.state.last_node_id, drone.ahead) == ("A1", "A2 A3")


@BOTH
def test_a_node_whose_passing_was_not_told_is_passed_with_the_next(version: Version) -> None:
    drone = Drone(version)
    drone.say(order("A1 A2 A3 A4"))
    drone.say(Reached("A3"))
    assert (drone.state.last_node_id, drone.ahead) == ("A3", "A4")


@BOTH
def test_hard_actions_run_alone_and_soft_ones_beside_each_other(version: Version) -> None:
    drone = Drone(version)
    soft = BlockingType.SOFT
    actions = {"A1": [scan("s1", soft), scan("s2", soft), scan("h"), scan("s3", soft)]}

    def begun(out: Sequence[Output]) -> list[str]:
        assert only(out, Fly) == []
        return [one.action.action_id for one in only(out, Begin)]

    assert begun(drone.say(order("A1 A2", actions=actions))) == ["s1", "s2"]
    assert begun(drone.say(Progress("s1", ActionStatus.FINISHED))) == []
    assert begun(drone.say(Progress("s2", ActionStatus.FINISHED))) == ["h"]
    assert begun(drone.say(Progress("h", ActionStatus.FINISHED))) == ["s3"]
    assert flown(drone.say(Progress("s3", ActionStatus.FINISHED))) == "A2"


@BOTH
def test_a_mode_that_takes_control_away_clears_the_order(version: Version) -> None:
    for mode in (OperatingMode.MANUAL, OperatingMode.SERVICE, OperatingMode.TEACH_IN):
        drone = Drone(version)
        drone.say(order("A1 A2 A3", actions={"A2": [scan("s")]}))
        assert drone.is_at("A1", driving=True, mode=mode) == []  # a person flies: nothing is commanded
        assert (drone.ahead, drone.statuses["s"], drone.state.order_id) == ("", "FAILED", "o")
        assert drone.state.operating_mode == mode
        assert drone.state.last_node_id == ("A1" if mode is OperatingMode.MANUAL else "")
        drone.is_at("A1")
        drone.say(order("A1 A2", number=1))
        assert drone.errors == ["ORDER_UPDATE_FOLLOWING_CANCEL"]
