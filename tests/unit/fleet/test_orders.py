"""The standard's rules on orders and their updates, one test each (2.1: 6.6; 3.0: 6.1)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flightd.fleet.vda5050.codec import Version
from flightd.fleet.vda5050.order import AllowedDeviation, Node
from flightd.fleet.vda5050.state import ActionStatus, ConnectionState
from flightd.fleet.vehicle.signals import (
    Begin,
    Fly,
    Hold,
    Output,
    Progress,
    Reached,
)
from tests.unit.fleet.vehicle_rig import (
    BOTH,
    V3,
    Drone,
    at,
    check,
    flown,
    instant,
    only,
    order,
    scan,
)

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
