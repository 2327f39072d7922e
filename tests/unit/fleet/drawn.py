"""Any message of VDA 5050 for Hypothesis, from its types."""

from __future__ import annotations

import functools
from typing import Any, TypeVar

import msgspec
from hypothesis import strategies as st
from msgspec import inspect

from flightd.fleet.vda5050.order import Edge, Node, Order
from flightd.fleet.vda5050.parts import Header

_M = TypeVar("_M", bound=Header)
_TEXT = st.text("aZ09-_é€", max_size=6)
_NAMES: dict[str, st.SearchStrategy[Any]] = {
    "timestamp": st.just("2026-03-01T08:00:00.123Z"),
    "error_type": st.sampled_from(
        [
            "VALIDATION_FAILURE",
            "NO_ORDER_TO_CANCEL",
            "OTHER_ORDER_ACTIVE",
            "OUTDATED_ORDER_UPDATE",
            "motorHot",
        ]
    ),
    "mobile_robot_kinematics": st.sampled_from(["OMNIDIRECTIONAL", "DIFFERENTIAL", "THREE_WHEEL", "FLYING"]),
    "mobile_robot_class": st.sampled_from(["CARRIER", "TUGGER", "DRONE"]),
    "localization_types": st.lists(st.sampled_from(["GRID", "NATURAL", "PAINT"]), max_size=3),
    "navigation_types": st.lists(
        st.sampled_from(["PHYSICAL_LINE_GUIDED", "FREELY_NAVIGATING", "OWN"]), max_size=3
    ),
    "maximum_array_lengths": st.dictionaries(
        st.sampled_from(["order.nodes", "state.errors"]), st.integers(0, 9)
    ),
    "network": st.just({"dnsServers": ["10.0.0.1"], "netmask": "255.0.0.0"}),
    "battery_health": st.none() | st.integers(0, 100).map(float),
    "range": st.none() | st.integers(0, 10_000).map(float),
    "supported_zones": st.none() | st.just(["BLOCKED"]),
}


def _of(told: inspect.Type, name: str = "") -> st.SearchStrategy[Any]:  # noqa: PLR0911 (a case a type)
    if name in _NAMES:
        return _NAMES[name]
    match told:
        case inspect.StructType():
            return st.builds(told.cls, **{one.name: _of(one.type, one.name) for one in told.fields})
        case inspect.EnumType():
            return st.sampled_from(list(told.cls))
        case inspect.ListType():
            return st.lists(_of(told.item_type), max_size=2)
        case inspect.UnionType():
            return st.one_of([_of(one) for one in told.types])
        case inspect.IntType():
            low, high = told.ge or 0, told.le or 2**32 - 1
            return st.integers(low, high)
        case inspect.FloatType():
            low_m, high_m = -1e6 if told.ge is None else told.ge, 1e6 if told.le is None else told.le
            return st.floats(low_m, high_m, allow_nan=False, allow_subnormal=False).map(lambda one: one + 0.0)
        case inspect.BoolType():
            return st.booleans()
        case inspect.NoneType():
            return st.none()
        case inspect.DictType():
            return st.dictionaries(_TEXT, st.integers(0, 9) | _TEXT, max_size=2)
        case inspect.AnyType():
            return st.integers(-9, 9) | _TEXT
        case _:
            return _TEXT


@functools.cache
def messages(kind: type[_M]) -> st.SearchStrategy[_M]:
    """Messages of a kind; orders are such that an edge stands between two nodes."""
    drawn: st.SearchStrategy[_M] = _of(inspect.type_info(kind))
    if kind is Order:
        return drawn.map(_numbered)
    return drawn


def _numbered(order: Any) -> Any:
    nodes: list[Node] = order.nodes or [Node(node_id="A1", sequence_id=0, released=True, actions=[])]
    edges: list[Edge] = order.edges[: len(nodes) - 1]
    nodes = nodes[: len(edges) + 1]
    return msgspec.structs.replace(
        order,
        nodes=[msgspec.structs.replace(node, sequence_id=2 * i) for i, node in enumerate(nodes)],
        edges=[msgspec.structs.replace(edge, sequence_id=2 * i + 1) for i, edge in enumerate(edges)],
    )
