"""The standard's rules on rejected orders, one test each (2.1: 6.6.4; 3.0: 6.1.4)."""

from __future__ import annotations

from typing import Any

import msgspec
import pytest

from flightd.fleet.vda5050.codec import MalformedError, Version, encoded
from flightd.fleet.vda5050.parts import Action, BlockingType, Trajectory
from flightd.fleet.vda5050.state import ActionStatus, OperatingMode
from flightd.fleet.vehicle.signals import (
    Malformed,
    Progress,
    Reached,
)
from tests.unit.fleet.vehicle_rig import (
    BOTH,
    V2,
    V3,
    Drone,
    at,
    instant,
    order,
    scan,
)


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
