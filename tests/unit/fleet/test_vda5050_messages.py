"""Every message of VDA 5050 is valid by the official schema of its version, and comes back as it was."""

from __future__ import annotations

import contextlib
import json
from typing import Any

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flightd.fleet.vda5050.codec import TOPICS, MalformedError, Version, decoded, encoded
from flightd.fleet.vda5050.factsheet import Factsheet
from flightd.fleet.vda5050.order import InstantActions, Order
from flightd.fleet.vda5050.parts import Header
from flightd.fleet.vda5050.state import Connection, State, Visualization
from tests.unit.fleet.drawn import messages
from tests.unit.fleet.vehicle_rig import check


@pytest.mark.parametrize("kind", TOPICS)
@settings(max_examples=12)
@given(data=st.data())
def test_a_message_is_valid_and_comes_back_in_both_versions(kind: type[Header], data: st.DataObject) -> None:
    message = data.draw(messages(kind))
    sent = check(message, Version.V3_0)
    again = decoded(kind, sent, Version.V3_0)
    if kind is not InstantActions:  # in 3.0 these never block, whatever is asked
        assert again == msgspec.structs.replace(message, version="3.0.0")
    assert encoded(again, Version.V3_0) == sent

    sent = check(message, Version.V2_1)
    common = decoded(kind, sent, Version.V2_1)
    assert json.loads(encoded(common, Version.V2_1)) == json.loads(sent)
    # what both versions can say goes through the other one unchanged
    if kind is not InstantActions:
        through = decoded(kind, check(common, Version.V3_0), Version.V3_0)
        assert msgspec.structs.replace(through, version="2.1.0") == common


HEAD = {
    "headerId": 3, "timestamp": "2026-03-01T08:00:00.00Z", "version": "2.1.0", "manufacturer": "acme",
    "serialNumber": "d1",
}  # fmt: skip


def test_an_order_of_2_1_is_understood_by_its_own_names() -> None:
    scan = {
        "actionType": "scanShelf", "actionId": "a", "blockingType": "HARD", "actionDescription": "first",
        "actionParameters": [{"key": "levels", "value": [1, 2]}, {"key": "side", "value": "left"}],
    }  # fmt: skip
    told = {
        **HEAD, "orderId": "o", "orderUpdateId": 0, "zoneSetId": "z",
        "nodes": [
            {"nodeId": "A1", "sequenceId": 0, "released": True, "actions": [],
             "nodePosition": {"x": 1, "y": 2, "mapId": "hall", "allowedDeviationXY": 0.5}},
            {"nodeId": "A2", "sequenceId": 2, "released": False, "actions": [scan], "nodeDescription": "end"},
        ],
        "edges": [
            {"edgeId": "e", "sequenceId": 1, "released": False, "startNodeId": "A1", "endNodeId": "A2",
             "maxSpeed": 0.5, "maxHeight": 2.0, "rotationAllowed": False, "actions": [],
             "corridor": {"leftWidth": 1, "rightWidth": 1, "corridorRefPoint": "KINEMATICCENTER"}},
        ],
    }  # fmt: skip
    order = decoded(Order, json.dumps(told).encode(), Version.V2_1)
    assert order.nodes[0].node_position is not None
    assert order.nodes[0].node_position.allowed_deviation_xy is not None
    assert order.nodes[0].node_position.allowed_deviation_xy.b == 0.5
    assert order.nodes[1].node_descriptor == "end"
    assert order.nodes[1].actions[0].parameter("levels") == [1, 2]
    assert order.nodes[1].actions[0].parameter("expected") is None
    edge = order.edges[0]
    assert (edge.maximum_speed, edge.maximum_mobile_robot_height) == (0.5, 2.0)
    assert edge.reach_orientation_before_entering is True
    assert edge.corridor is not None
    assert edge.corridor.corridor_reference_point == "KINEMATIC_CENTER"
    del told["zoneSetId"]
    assert json.loads(encoded(order, Version.V2_1)) == told


@pytest.mark.parametrize(
    ("change", "key", "words"),
    [
        ({"orderId": 3}, "orderId", "Expected `str`, got `int`"),
        ({"orderUpdateId": -1}, "orderUpdateId", "Expected `int` >= 0"),
        ({"nodes": None}, "nodes", "Expected `array`, got `null`"),
        ({"edges": [{"edgeId": "e", "sequenceId": 1, "released": True, "actions": [], "maxSpeed": "fast"}]},
         "edges[0].maxSpeed", "Expected `float | null`, got `str`"),
        ({"nodes": [{"nodeId": "A1", "sequenceId": 0, "released": True, "actions": [
            {"actionType": "t", "actionId": "i", "blockingType": "SLOW"}]}]},
         "nodes[0].actions[0].blockingType", "Invalid enum value 'SLOW'"),
        ({"nodes": [{"nodeId": n, "sequenceId": i, "released": True, "actions": []}
                    for i, n in ((0, "A1"), (2, "A2"))],
          "edges": [{"edgeId": "e", "sequenceId": 1, "released": True, "actions": [],
                     "startNodeId": "A1", "endNodeId": "B2"}]}, "", "edges[0].endNodeId is 'B2', not 'A2'"),
    ],
)  # fmt: skip
def test_a_malformed_order_names_its_key_and_what_it_is_about(
    change: dict[str, Any], key: str, words: str
) -> None:
    told = {**HEAD, "orderId": "o", "orderUpdateId": 4, "nodes": [], "edges": [], **change}
    with pytest.raises(MalformedError) as refused:
        decoded(Order, json.dumps(told).encode(), Version.V2_1)
    assert refused.value.key == key
    assert words in refused.value.what
    assert refused.value.told["headerId"] == "3"


def test_what_is_no_message_at_all_is_refused_in_a_line() -> None:
    for data in (b"", b"[[" * 100_000, b"\xff", b"[]", b"3", b"{}", b'"x"', b"x" * 4_000_001):
        for kind in TOPICS:
            for version in Version:
                with pytest.raises(MalformedError) as refused:
                    decoded(kind, data, version)
                assert "\n" not in str(refused.value)


_junk = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=3),
    lambda inner: st.lists(inner, max_size=2) | st.dictionaries(st.text(max_size=3), inner, max_size=2),
    max_leaves=4,
)


@settings(max_examples=30)
@given(kind=st.sampled_from(list(TOPICS)), version=st.sampled_from(Version), data=st.data())
def test_any_value_in_a_message_is_taken_or_refused(
    kind: type[Header], version: Version, data: st.DataObject
) -> None:
    told = json.loads(encoded(data.draw(messages(kind)), version))
    part: Any = told
    while True:
        keys = sorted(part) if isinstance(part, dict) else list(range(len(part)))
        if not keys:
            break
        key = data.draw(st.sampled_from(keys))
        if not isinstance(part[key], dict | list) or data.draw(st.booleans()):
            part[key] = data.draw(_junk)
            break
        part = part[key]
    with contextlib.suppress(MalformedError):
        decoded(kind, json.dumps(told).encode(), version)


def test_each_kind_has_its_topic() -> None:
    assert set(TOPICS) == {Order, InstantActions, Connection, State, Visualization, Factsheet}
    assert [version.topic for version in Version] == ["v2", "v3"]
