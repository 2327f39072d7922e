"""The standard's rules on rejected orders, one test each (2.1: 6.6.4; 3.0: 6.1.4)."""

from __future__ import annotations

from typing import Any

import msgspec
import pytest

from flightd.fleet.vda5050.codec import MalformedError, Version, encoded
from flightd.fleet.vda5050.errors import ErrorType
from flightd.fleet.vda5050.order import AllowedDeviation, OrientationType
from flightd.fleet.vda5050.parts import Action, BlockingType, Trajectory
from flightd.fleet.vda5050.state import ActionStatus, OperatingMode
from flightd.fleet.vehicle.refusals import Refusal
from flightd.fleet.vehicle.signals import (
    Malformed,
    Missed,
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


@pytest.mark.parametrize(
    ("field", "value", "in_2_1", "in_3_0"),
    [
        ("trajectory", Trajectory(control_points=[]), "trajectory", "trajectory"),
        ("direction", "left", "direction", "direction"),
        (
            "minimum_load_handling_device_height",
            1.0,
            "minHeight",
            "minimumLoadHandlingDeviceHeight",
        ),
        ("maximum_speed", 1.0, "maxSpeed", "maximumSpeed"),
        ("orientation", 0.0, "orientation", "orientation"),
        ("max_rotation_speed", 1.0, "maxRotationSpeed", "maxRotationSpeed"),
        ("reach_orientation_before_entering", True, "rotationAllowed", "reachOrientationBeforeEntering"),
    ],
)
def test_an_order_with_a_field_that_cannot_be_used_is_refused_by_its_name(
    field: str, value: Any, in_2_1: str, in_3_0: str
) -> None:
    for version, name in ((V2, in_2_1), (V3, in_3_0)):
        drone = Drone(version)
        more: dict[str, Any] = {field: value}
        drone.say(order("A1 A2", **more))
        assert drone.errors == ["UNSUPPORTED_PARAMETER"]
        assert drone.state.errors[0].error_level == "CRITICAL"
        assert drone.about("parameter") == [f"edges[0].{name}"]
        assert (drone.state.errors[0].error_description or "").startswith(f"edges[0].{name} cannot be ")
        assert drone.state.order_id == ""


@BOTH
def test_fields_that_ask_for_nothing_are_taken(version: Version) -> None:
    drone = Drone(version)
    more: dict[str, Any] = {
        "maximum_speed": 2.0,
        "length": 1.5,
        "reach_orientation_before_entering": False,
        "orientation_type": OrientationType.TANGENTIAL,
    }
    told = order("A1 A2", **more)
    drone.say(at(told, 1, x=1.5, y=0.0, map_id="demo", theta=1.0, allowed_deviation_theta=3.1415))
    assert drone.errors == []


@BOTH
def test_an_orientation_that_the_drone_has_is_kept_and_no_other_one(version: Version) -> None:
    where: dict[str, Any] = {"x": 0.0, "y": 0.0, "map_id": "demo"}
    for theta, allowed, is_so in (
        (1.1, None, True),
        (1.5, None, False),
        (1.5, 0.6, True),
        (-3.0, None, False),
    ):
        drone = Drone(version)
        drone.is_at("A1", at_m=(0.0, 0.0), theta=1.0)
        drone.say(at(order("A1 A2"), theta=theta, allowed_deviation_theta=allowed, **where))
        assert drone.errors == ([] if is_so else ["UNSUPPORTED_PARAMETER"]), theta
    drone.say(at(order("A1 A2", name="other"), 1, x=1.5, y=0.0, map_id="demo", theta=1.0))
    assert drone.about("parameter") == ["nodes[1].nodePosition.theta"]


@BOTH
def test_a_node_that_lies_elsewhere_on_the_floor_is_refused(version: Version) -> None:
    wide = AllowedDeviation(a=3.0, b=3.0, theta=0.0)
    for index, x, more, goes in (
        (1, 1.6, {}, True),
        (1, 2.7, {}, False),
        (1, 2.7, {"allowed_deviation_xy": wide}, True),
        (0, 5.0, {}, False),
    ):
        drone = Drone(version)
        drone.say(at(order("A1 A2"), index, x=x, y=0.0, map_id="demo", **more))
        assert drone.errors == ([] if goes else ["NO_ROUTE_TO_TARGET"]), x
        assert drone.about("nodeId") == ([] if goes else [f"A{index + 1}"])


@BOTH
def test_a_first_node_of_nowhere_leads_on_along_the_way_that_the_drone_is_on(version: Version) -> None:
    for way, goes in (("A3 A4", True), ("A2 A1", True), ("A1", False), ("A4", False), ("B2", False)):
        drone = Drone(version)
        drone.is_at(None, at_m=(2.1, 0.1))
        drone.say(at(order(f"here {way}"), x=2.1, y=0.0, map_id="demo"))
        assert drone.errors == ([] if goes else ["NO_ROUTE_TO_TARGET"]), way
    drone = Drone(version)
    drone.is_at("A1", at_m=(0.0, 0.0))
    drone.say(at(order("here B1 B2"), x=0.0, y=0.0, map_id="demo"))
    assert drone.errors == []


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
            other = OperatingMode.MANUAL if mode is OperatingMode.SERVICE else OperatingMode.SERVICE
            drone.is_at("A1", mode=other)
            assert drone.errors == ["MOBILE_ROBOT_NOT_AVAILABLE"]
            drone.is_at("A1")
            assert drone.errors == []  # until the mode allows new orders


@BOTH
def test_an_order_that_was_missed_is_refused_unless_it_is_here_already(version: Version) -> None:
    drone = Drone(version)
    late = Refusal(ErrorType.DRONE_NOT_HEARD, "nobody heard")
    drone.say(Missed(order("A1 A2"), late))
    assert (drone.errors, drone.about("orderId"), drone.state.order_id) == (["DRONE_NOT_HEARD"], ["o"], "")
    assert (b'"orderError"' in encoded(drone.state, version)) is (version is V2)
    drone.say(order("A1 A2"))
    drone.say(Missed(order("A1 A2"), late))
    assert drone.errors == []
    drone.say(Missed(order("A2 A3", number=1, first=2), late))
    assert (drone.errors, drone.ahead) == (["DRONE_NOT_HEARD"], "A2")


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
