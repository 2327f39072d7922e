"""Optional fields of orders that a drone on painted lines cannot do as it is told: none is ignored."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

import msgspec

from flightd.fleet.vda5050.order import Edge, NodePosition, Order

_OF_EDGES: Final = (
    "trajectory",
    "corridor",
    "minimum_load_handling_device_height",
    "maximum_mobile_robot_height",
    "direction",
    "orientation",
    "max_rotation_speed",
)
_NAMES: Final = {field.name: field.encode_name for field in msgspec.structs.fields(Edge)}
_HEADS_SO_RAD: Final = 0.2
"""By so much a drone that stands is turned otherwise than it tells."""
_ROUNDED_RAD: Final = 0.01
"""3.14 is half a turn."""


def unsupported_field(order: Order, speed_mps: float, theta: float | None) -> tuple[str, str] | None:
    """The path to the first one, by the model's names, and why not; None where there is none.  The drone may
    fly with `speed_mps` on every edge, and is turned to `theta` where the order begins; None: it does not
    tell, or was there before."""
    return next(_unsupported(order, speed_mps, theta), None)


def _unsupported(order: Order, speed_mps: float, theta: float | None) -> Iterator[tuple[str, str]]:
    for i, edge in enumerate(order.edges):
        for name in _OF_EDGES:
            if getattr(edge, name) is not None:
                yield f"edges[{i}].{_NAMES[name]}", "cannot be used"
        if edge.reach_orientation_before_entering:
            yield f"edges[{i}].{_NAMES['reach_orientation_before_entering']}", "cannot be kept"
        if edge.maximum_speed is not None and edge.maximum_speed < speed_mps:
            yield f"edges[{i}].{_NAMES['maximum_speed']}", f"cannot be less than {speed_mps:g} m/s"
    for i, node in enumerate(order.nodes):
        is_known = i > 0 or theta is not None
        if node.node_position is not None and is_known and _turns(node.node_position, None if i else theta):
            yield f"nodes[{i}].nodePosition.theta", "cannot be kept: the drone turns as it needs to"


def _turns(told: NodePosition, theta: float | None) -> bool:
    """Whether a drone that is turned to `theta` (None: to anywhere) is not so as it is told to."""
    if told.theta is None:
        return False
    off_rad = math.pi if theta is None else abs(math.remainder(theta - told.theta, math.tau))
    return off_rad > max(told.allowed_deviation_theta or 0.0, _HEADS_SO_RAD) + _ROUNDED_RAD
