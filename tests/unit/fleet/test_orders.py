"""The standard's rules on orders, updates, cancellation and rejection, one test each (2.1: 6.6; 3.0: 6.1)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flightd.fleet.vda5050.codec import MalformedError, Version, encoded
from flightd.fleet.vda5050.order import AllowedDeviation, Node, NodePosition, Order
from flightd.fleet.vda5050.parts import Action, BlockingType, Trajectory
from flightd.fleet.vda5050.state import ActionStatus, ConnectionState, OperatingMode
from flightd.fleet.vehicle.signals import (
    Abort,
    Begin,
    Fly,
    Hold,
    Malformed,
    Output,
    PauseAction,
    Progress,
    Reached,
    ResumeAction,
)
from tests.unit.fleet.vehicle_rig import Drone, check, facts, instant, only, order, scan

BOTH = pytest.mark.parametrize("version", list(Version))
V2, V3 = Version.V2_1, Version.V3_0


def flown(out: Sequence[Output]) -> str:
    """The stops of the last way that was commanded."""
    return " ".join(stop.node for stop in only(out, Fly)[-1].stops)


def at(told: Order, **where: Any) -> Order:
    """The order with a position of its first node."""
    first = msgspec.structs.replace(told.nodes[0], node_position=NodePosition(**where))
    return msgspec.structs.replace(told, nodes=[first, *told.nodes[1:]])


# concept and logic (6.6.1 / 6.1.1)


@BOTH
def test_the_base_is_flown_and_the_horizon_is_not(version: Version) -> None:
    drone = Drone(version)
    assert flown(drone.say(order("A1 A2 A3 A4 A5", released=3))) == "A2 A3"
    assert drone.ahead == "A2 A3 (A4) (A5)"
    assert [one.edge_id for one in drone.state.edge_states] == ["A1-A2", "A2-A3", "A3-A4", "A4-A5"]
    assert (drone.state.order_id, drone.state.last_node_id) == ("o", "A1")


@BOTH
def test_the_vehicle_stops_at_the_decision_point(version: Version) -> None:
    drone = Drone(version)
    drone.say(order("A1 A2 A3", released=2))
    assert drone.say(Reached("A2")) == []
    assert drone.ahead == "(A3)"
    assert drone.state.new_base_request


@BOTH
@pytest.mark.parametrize(
    ("way", "released", "change", "words"),
    [
        ("A1 A2", 0, {}, "nodes[0].released"),
        ("A1 A2 A3", 9, {"edges": []}, "edges: 0 for 3 nodes"),
        ("A1", 9, {"nodes": []}, "nodes: there is none"),
    ],
)
def test_a_valid_order_has_a_node_and_one_edge_less_and_begins_released(
    version: Version, way: str, released: int, change: dict[str, Any], words: str
) -> None:
    drone = Drone(version)
    drone.say(msgspec.structs.replace(order(way, released), **change))
    assert drone.errors == ["VALIDATION_FAILURE"]
    assert words in str(drone.state.errors[0].error_description)
    assert drone.state.order_id == ""


@BOTH
def test_nothing_is_released_after_what_is_not_and_no_edge_without_its_nodes(version: Version) -> None:
    drone, good = Drone(version), order("A1 A2 A3")
    gap = [good.nodes[0], msgspec.structs.replace(good.nodes[1], released=False), good.nodes[2]]
    for nodes, edges in (
        (gap, good.edges),
        (good.nodes, [msgspec.structs.replace(good.edges[0], released=False), good.edges[1]]),
        (good.nodes, [good.edges[0], msgspec.structs.replace(good.edges[1], sequence_id=5)]),
        ([good.nodes[0], msgspec.structs.replace(good.nodes[1], sequence_id=3), good.nodes[2]], good.edges),
    ):
        drone.say(msgspec.structs.replace(good, nodes=nodes, edges=edges))
        assert drone.errors == ["VALIDATION_FAILURE"]
    doubled = order("A1 A2 A3", actions={"A2": [scan("s")], "A3": [scan("s")]})
    drone.say(doubled)
    assert "comes twice" in str(drone.state.errors[0].error_description)


@BOTH
def test_the_first_node_is_trivially_reachable(version: Version) -> None:
    drone = Drone(version, at="A2")
    drone.say(order("A1 A2"))
    assert drone.errors == ["START_NODE_OUT_OF_RANGE"]
    drone.say(order("A2 A1"))
    assert drone.errors == []
    assert drone.ahead == "A1"


@BOTH
def test_a_vehicle_in_the_deviation_range_of_a_node_is_on_it(version: Version) -> None:
    for deviation, x, ok in ((None, 0.2, True), (None, 0.9, False), (1.0, 0.9, True), (1.0, 1.1, False)):
        drone = Drone(version, at=None)
        drone.is_at(None, at_m=(x, 0.0))
        allowed = AllowedDeviation(a=deviation, b=0.2, theta=0.0) if deviation else None
        drone.say(at(order("A1 A2"), x=0.0, y=0.0, map_id="demo", allowed_deviation_xy=allowed))
        assert (drone.errors == []) == ok, (deviation, x)


# orders and order updates (6.6.2 / 6.1.2)


@BOTH
def test_an_update_is_stitched_to_the_decision_point_and_replaces_the_horizon(version: Version) -> None:
    drone = Drone(version)
    old = {"A2": [scan("s2")], "A4": [scan("s4")]}
    drone.say(order("A1 A2 A3 A4", released=3, actions=old))
    drone.say(order("A3 A2 A1 B1", released=3, number=1, first=4, actions={"B1": [scan("b1")]}))
    assert drone.errors == []
    assert drone.ahead == "A2 A3 A2 A1 (B1)"
    assert [one.sequence_id for one in drone.state.node_states] == [2, 4, 6, 8, 10]
    assert drone.state.order_update_id == 1
    assert drone.statuses == {"s2": "WAITING", "b1": "WAITING"}


@BOTH
def test_a_horizon_can_be_deleted(version: Version) -> None:
    drone = Drone(version)
    drone.say(order("A1 A2 A3", released=2))
    drone.say(order("A2", number=1, first=2))
    assert drone.ahead == "A2"


@BOTH
def test_what_is_sent_again_of_the_decision_point_is_not_done_again(version: Version) -> None:
    drone = Drone(version)
    drone.say(order("A1 A2", actions={"A2": [scan("s")]}))
    drone.say(order("A2 A3", number=1, first=2, actions={"A2": [scan("s")]}))
    assert drone.errors == []
    assert [one.action.action_id for one in only(drone.say(Reached("A2")), Begin)] == ["s"]
    assert only(drone.say(Progress("s", ActionStatus.FINISHED)), Begin) == []
    assert drone.statuses["s"] == "FINISHED"


@BOTH
def test_an_update_continues_an_order_that_is_completed(version: Version) -> None:
    drone = Drone(version)
    drone.say(order("A1 A2"))
    drone.say(Reached("A2"))
    drone.is_at("A2")
    assert drone.ahead == ""
    assert flown(drone.say(order("A2 A3", number=1, first=2))) == "A3"


@BOTH
def test_an_update_that_does_not_begin_at_the_decision_point_is_refused(version: Version) -> None:
    drone = Drone(version)
    drone.say(order("A1 A2 A3", released=2))
    for wrong in (order("A3 A4", number=1, first=4), order("A2 A3", number=1, first=0)):
        drone.say(wrong)
        assert drone.errors == ["START_NODE_OUT_OF_RANGE"]
        assert drone.ahead == "A2 (A3)"
        assert drone.state.order_update_id == 0


@BOTH
def test_an_update_of_a_completed_order_is_refused_once_the_vehicle_has_left(
    version: Version,
) -> None:
    drone = Drone(version)
    drone.say(order("A1 A2"))
    drone.say(Reached("A2"))
    drone.is_at("A3")
    assert drone.state.last_node_id == "A3"
    drone.say(order("A2 A3", number=1, first=2))
    assert drone.errors == ["START_NODE_OUT_OF_RANGE"]


@BOTH
def test_an_update_that_was_lost_does_not_keep_a_later_one_from_being_accepted(version: Version) -> None:
    drone = Drone(version)
    drone.say(order("A1 A2", number=0))
    drone.say(order("A2 A3", number=7, first=2))
    assert (drone.errors, drone.state.order_update_id) == ([], 7)


@BOTH
def test_a_way_may_come_back_to_a_node(version: Version) -> None:
    drone = Drone(version)
    drone.say(order("A1 A2 A1 A2"))
    drone.say(Reached("A1"))  # where it stands already
    assert drone.ahead == "A2 A1 A2"
    for node, left in (("A2", "A1 A2"), ("A1", "A2"), ("A2", "")):
        drone.say(Reached(node))
        assert drone.ahead == left
    assert drone.state.last_node_sequence_id == 6


def test_more_actions_at_the_decision_point_come_with_a_further_node_there() -> None:
    drone = Drone(V3)
    drone.say(order("A1 A2", actions={"A2": [scan("s")]}))
    drone.say(Reached("A2"))
    drone.say(Progress("s", ActionStatus.FINISHED))
    out = drone.say(order("A2 A2", number=1, first=2, actions={"A2": [scan("t")]}))
    assert drone.errors == []
    assert [one.action.action_id for one in only(out, Begin)] == ["t"]
    assert (drone.ahead, drone.state.last_node_sequence_id) == ("", 4)


@BOTH
def test_a_header_id_that_goes_back_is_no_reason_to_refuse_an_order(version: Version) -> None:
    drone = Drone(version)
    drone.say(msgspec.structs.replace(order("A1 A2"), header_id=900))
    drone.say(msgspec.structs.replace(order("A2 A3", number=1, first=2), header_id=0))
    assert drone.errors == []


@BOTH
def test_header_ids_count_for_each_topic_by_themselves(version: Version) -> None:
    drone = Drone(version)
    drone.say(order("A1 A2"))
    drone.say(Reached("A2"))
    numbers = [one.header_id for one in drone.states]
    assert numbers == list(range(len(numbers)))
    for number in range(2):
        told = drone.vehicle.connection(ConnectionState.ONLINE, drone.now)
        seen = drone.vehicle.visualization(drone.now)
        check(told, version)
        check(seen, version)
        assert (told.header_id, seen.header_id) == (number, number)
        assert seen.reference_state_header_id == numbers[-1]


# rejection (6.6.4 / 6.1.4)


@BOTH
def test_a_malformed_order_is_told_until_an_order_is_accepted(version: Version) -> None:
    drone = Drone(version)
    error = MalformedError("Expected `str`", key="orderId", told={"headerId": "8"})
    drone.say(Malformed("order", error))
    assert drone.errors == ["VALIDATION_FAILURE"]
    assert (drone.about("headerId"), drone.about("parameter")) == (["8"], ["orderId"])
    drone.say(order("A3 A4"))
    assert "VALIDATION_FAILURE" in drone.errors
    drone.say(order("A1 A2"))
    assert drone.errors == []


@BOTH
@pytest.mark.parametrize(
    "field", ["trajectory", "minimum_load_handling_device_height", "direction", "maximum_speed"]
)
def test_an_order_with_a_field_that_cannot_be_used_is_refused_by_its_name(
    version: Version, field: str
) -> None:
    value = {"trajectory": Trajectory(control_points=[]), "direction": "left"}.get(field, 1.0)
    drone = Drone(version)
    more: dict[str, Any] = {field: value}
    drone.say(order("A1 A2", **more))
    assert drone.errors == ["UNSUPPORTED_PARAMETER"]
    assert drone.state.errors[0].error_level == "CRITICAL"
    assert drone.about("parameter") == [f"edges[0].{field}"]
    assert drone.state.order_id == ""


@BOTH
@pytest.mark.parametrize(
    ("action", "field"),
    [
        (Action(action_type="pick", action_id="x", blocking_type=BlockingType.HARD), "actionType"),
        (scan("x", BlockingType.NONE), "blockingType"),
        (scan("x", levels=[]), "levels"),
        (scan("x", levels=[0]), "levels"),
        (scan("x", levels=[True]), "levels"),
        (scan("x", side="up"), "side"),
        (scan("x", expected="4006381333931"), "expected"),
    ],
)
def test_an_order_with_an_action_that_cannot_be_done_is_refused(
    version: Version, action: Action, field: str
) -> None:
    drone = Drone(version)
    drone.say(order("A1 A2", actions={"A2": [action]}))
    assert drone.errors == ["INVALID_ORDER_ACTION"]
    assert (drone.about("actionId"), drone.about("parameter")) == (["x"], [field])


@BOTH
def test_no_action_is_done_on_an_edge(version: Version) -> None:
    told, drone = order("A1 A2"), Drone(version)
    drone.say(
        msgspec.structs.replace(told, edges=[msgspec.structs.replace(told.edges[0], actions=[scan("x")])])
    )
    assert drone.errors == ["INVALID_ORDER_ACTION"]


@BOTH
def test_a_lower_order_update_id_is_refused_and_the_order_goes_on(version: Version) -> None:
    drone = Drone(version)
    drone.say(order("A1 A2", number=0))
    drone.say(order("A2 A3", number=3, first=2))
    drone.say(order("A3 A4", number=2, first=4))
    assert drone.errors == ["OUTDATED_ORDER_UPDATE"]
    assert (drone.about("orderId"), drone.about("orderUpdateId")) == (["o"], ["2"])
    assert (drone.ahead, drone.state.order_update_id) == ("A2 A3", 3)
    drone.say(order("A3 A4", number=4, first=4))
    assert drone.errors == []


@BOTH
def test_the_same_order_a_second_time_is_ignored(version: Version) -> None:
    drone = Drone(version)
    drone.say(order("A1 A2 A3"))
    told = len(drone.states)
    drone.say(msgspec.structs.replace(order("A1 A2 A3"), header_id=2, timestamp="2026-03-01T08:00:09.000Z"))
    assert (len(drone.states), drone.errors, drone.ahead) == (told, [], "A2 A3")


@BOTH
def test_other_content_under_the_same_order_update_id(version: Version) -> None:
    drone = Drone(version)
    drone.say(order("A1 A2 A3"))
    drone.say(order("A1 A2"))
    assert drone.errors == ([] if version is V2 else ["SAME_ORDER_UPDATE_ID"])
    assert drone.ahead == "A2 A3"


@BOTH
def test_another_order_while_one_is_active_is_refused(version: Version) -> None:
    drone = Drone(version)
    drone.say(order("A1 A2 A3", released=2))
    drone.say(Reached("A2"))
    drone.say(order("A2 A3", name="other"))  # it still waits for an update
    assert drone.errors == ["OTHER_ORDER_ACTIVE"]
    assert drone.about("orderId") == ["other"]
    assert drone.state.order_id == "o"


@BOTH
def test_a_new_order_after_the_end_deletes_the_states_of_the_one_before(version: Version) -> None:
    drone = Drone(version)
    drone.say(order("A1 A2", actions={"A2": [scan("s")]}))
    drone.say(Reached("A2"))
    drone.say(Progress("s", ActionStatus.FINISHED, "12 codes"))
    assert drone.state.action_states[0].action_result == "12 codes"
    drone.is_at("A2")
    drone.say(order("A2 A3", name="next"))
    assert (drone.errors, drone.statuses, drone.state.order_id) == ([], {}, "next")


@BOTH
def test_a_new_order_begins_with_update_0_in_3_0(version: Version) -> None:
    drone = Drone(version)
    drone.say(order("A1 A2", number=5))
    assert drone.errors == ([] if version is V2 else ["VALIDATION_FAILURE"])


@BOTH
def test_an_order_with_a_node_that_cannot_be_reached_is_refused(version: Version) -> None:
    for way, node in (("A1 A2 Z9", "Z9"), ("A1 A3", "A3"), ("A1 A2 B2", "B2")):
        drone = Drone(version)
        drone.say(order(way))
        assert drone.errors == ["NO_ROUTE_TO_TARGET"]
        assert drone.about("nodeId") == [node]


@BOTH
def test_no_order_is_taken_in_a_mode_that_does_not_allow_it(version: Version) -> None:
    for mode in OperatingMode:
        drone = Drone(version)
        drone.is_at("A1", mode=mode)
        drone.say(order("A1 A2"))
        allowed = {OperatingMode.AUTOMATIC, OperatingMode.SEMIAUTOMATIC}
        allowed |= {OperatingMode.INTERVENED} if version is V3 else set()
        assert (drone.errors == []) == (mode in allowed), mode
        if mode not in allowed:
            assert drone.errors == ["MOBILE_ROBOT_NOT_AVAILABLE"]
            drone.is_at("A1")
            assert drone.errors == []  # until the mode allows new orders


@BOTH
def test_an_order_on_an_unknown_map_is_refused(version: Version) -> None:
    drone = Drone(version)
    drone.say(at(order("A1 A2"), x=0.0, y=0.0, map_id="elsewhere"))
    assert drone.errors == ["UNKNOWN_MAP_ID"]
    assert drone.about("mapId") == ["elsewhere"]


def test_in_2_1_the_errors_have_its_four_names_and_are_warnings() -> None:
    drone = Drone(V2)
    for told, name in (
        (order("A1 A2", released=0), b'"validationError"'),
        (order("A1 A2", direction="left"), b'"orderError"'),
        (order("A1 A2", actions={"A2": [scan("x", side="up")]}), b'"orderError"'),
        (instant("cancelOrder"), b'"noOrderToCancel"'),
    ):
        drone.say(told)
        assert name in encoded(drone.state, V2)
        assert b'"FATAL"' not in encoded(drone.state, V2)
    drone.say(order("A1 A2", number=3))
    drone.say(order("A1 A2", number=2))
    assert b'"orderUpdateError"' in encoded(drone.state, V2)


# cancellation (6.6.3 / 6.1.3)


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


def test_finished_instant_actions_are_told_until_they_are_cleared_and_never_without_end() -> None:
    drone = Drone(V3)
    for i in range(100):
        drone.say(instant("stateRequest", f"r{i}"))
    assert len(drone.state.instant_action_states) == 64
    drone.say(instant("clearInstantActions", "c"))
    assert drone.statuses == {"c": "FINISHED"}


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


# never beyond the safe return


@BOTH
def test_the_base_is_flown_no_further_than_the_drone_comes_home_from(version: Version) -> None:
    reach: list[int | None] = [None]
    drone = Drone(version, reach=lambda ahead: reach[0])
    assert drone.say(order("A1 A2 A3 A4", maximum_speed=2.0)) == []
    assert (drone.errors, drone.ahead) == ([], "A2 A3 A4"), "nothing is said before it is known"
    reach[0] = 1
    assert flown(drone.say()) == "A2"
    assert (drone.errors, drone.about("nodeId")) == (["BASE_BEYOND_SAFE_RETURN"], ["A3"])
    assert drone.ahead == "A2 A3 A4"
    reach[0] = 2
    out = drone.say()
    assert flown(out) == "A2 A3"
    reach[0] = 0  # the battery is worse than it was thought
    assert drone.say() == [Hold()]
    reach[0] = 9
    assert flown(drone.say()) == "A2 A3 A4"
    assert drone.errors == []


_KINDS = st.sampled_from(["order", "update", "reached", "instant", "drives", "stands", "reach"])
_INSTANT = st.sampled_from(["cancelOrder", "startPause", "stopPause"])
_WAYS = st.lists(st.sampled_from(["A1", "A2", "A3", "A4", "A5", "A6", "B6", "B1"]), min_size=1, max_size=5)


@settings(max_examples=60)
@given(data=st.data(), version=st.sampled_from(Version))
def test_whatever_comes_no_node_is_flown_that_is_not_released_and_in_reach(
    data: st.DataObject, version: Version
) -> None:
    reach = [2]
    given: list[Sequence[Node]] = []

    def ahead(nodes: Sequence[Node]) -> int:
        given.append(nodes)
        return reach[0]

    drone = Drone(version, reach=ahead)
    for i in range(8):
        kind = data.draw(
            st.sampled_from(["order", "update", "reached", "instant", "drives", "stands", "reach"])
        )
        out: list[Output] = []
        last, number = drone.state.last_node_id or "A1", drone.state.order_update_id
        match kind:
            case "order":
                out = drone.say(
                    order(" ".join([last, *data.draw(_WAYS)]), data.draw(st.integers(1, 4)), name=str(i))
                )
            case "update":
                base = [one for one in drone.state.node_states if one.released]
                node = base[-1].node_id if base else last
                seq = base[-1].sequence_id if base else drone.state.last_node_sequence_id
                way = " ".join([node, *data.draw(_WAYS)])
                out = drone.say(
                    order(
                        way,
                        data.draw(st.integers(1, 4)),
                        name=drone.state.order_id,
                        number=number + 1,
                        first=seq,
                    )
                )
            case "reached":
                out = drone.say(Reached(data.draw(st.sampled_from(["A1", "A2", "A3", "B1"]))))
            case "instant":
                out = drone.say(
                    instant(data.draw(st.sampled_from(["cancelOrder", "startPause", "stopPause"])), str(i))
                )
            case "drives":
                out = drone.is_at(None, driving=True)
            case "stands":
                out = drone.is_at(last)
            case "reach":
                reach[0] = data.draw(st.integers(0, 3))
                out = drone.say()
        for fly in only(out, Fly):
            released = [one.sequence_id for one in drone.state.node_states if one.released]
            assert [stop.sequence_id for stop in fly.stops] == released[: len(fly.stops)]
            assert len(fly.stops) <= reach[0]
        assert all(node.released for nodes in given for node in nodes)
        released_first = [one.released for one in drone.state.node_states]
        assert released_first == sorted(released_first, reverse=True)
