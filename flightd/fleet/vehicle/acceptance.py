"""Whether an order is accepted: the standard's flow chart, new order to the left, update to the right."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import Final

import msgspec

from flightd.fleet.vda5050.codec import Version, wire_path
from flightd.fleet.vda5050.errors import ErrorType
from flightd.fleet.vda5050.order import Node, Order
from flightd.fleet.vda5050.state import OperatingMode
from flightd.fleet.vehicle.floor import Floor
from flightd.fleet.vehicle.refusals import Refusal, impossibility, is_within, malformation
from flightd.fleet.vehicle.route import Route
from flightd.fleet.vehicle.signals import Situation
from flightd.fleet.vehicle.unsupported_fields import unsupported_field

FLIES: Final = frozenset({OperatingMode.AUTOMATIC, OperatingMode.SEMIAUTOMATIC})
"""The modes in which a fleet control is in control."""
IGNORED: Final = Refusal(ErrorType.SAME_ORDER_UPDATE_ID, "it is here already")
"""Neither accepted nor told: the vehicle has this message."""


@dataclass(frozen=True, slots=True)
class Holding:
    """What the vehicle has when an order comes: its last order, whether that is over or was cancelled, and
    where it got to.  `base_actions`: the ids of actions that stay, whatever an update says."""

    order: Order | None
    idle: bool
    cancelled: bool
    route: Route
    last_node: tuple[str, int]
    mode: OperatingMode
    situation: Situation | None
    base_actions: Collection[str]


@dataclass(frozen=True, slots=True)
class Acceptance:
    """The rules of one version on one floor.  `in_reach_m`: this near a node the vehicle stands on it;
    `speed_mps`: it may fly so fast on every edge."""

    version: Version
    floor: Floor
    in_reach_m: float
    speed_mps: float

    def refusal(self, order: Order, holding: Holding) -> Refusal | None:
        """Why the order is not accepted; IGNORED where nothing is said of it, None where it is."""
        current = holding.order
        if current is None or order.order_id != current.order_id:
            return self._of_new(order, holding)
        known = self._of_number(order, current, holding)
        return known or self._of_update(order, holding)

    def _of_new(self, order: Order, holding: Holding) -> Refusal | None:
        form = malformation(order, (), is_new=True) or self._of_mode(holding)
        if form is not None:
            return form
        if not holding.idle and holding.order is not None:
            return Refusal(
                ErrorType.OTHER_ORDER_ACTIVE, f"order {holding.order.order_id!r} is not at its end"
            )
        if self.version is not Version.V2_1 and order.order_update_id != 0:
            return Refusal(ErrorType.VALIDATION_FAILURE, "orderUpdateId: a new order begins with 0")
        first = order.nodes[0]
        if not self._in_reach(first, holding.situation):
            return Refusal(ErrorType.START_NODE_OUT_OF_RANGE, f"the drone is not at node {first.node_id}")
        return self._impossibility(order, holding.situation, is_new=True)

    def _of_number(self, order: Order, current: Order, holding: Holding) -> Refusal | None:
        """What the ids of an update alone say."""
        new, old = order.order_update_id, current.order_update_id
        if new < old:
            return Refusal(ErrorType.OUTDATED_ORDER_UPDATE, f"orderUpdateId {new} is before {old}")
        if new == old and self.version is Version.V2_1:
            return IGNORED
        if holding.cancelled:
            return Refusal(ErrorType.ORDER_UPDATE_FOLLOWING_CANCEL, f"order {order.order_id!r} was cancelled")
        if new == old:
            same = _content(order) == _content(current)
            what = f"orderUpdateId {new} is here with other content"
            return IGNORED if same else Refusal(ErrorType.SAME_ORDER_UPDATE_ID, what)
        return None

    def _of_update(self, order: Order, holding: Holding) -> Refusal | None:
        form = malformation(order, holding.base_actions, is_new=False) or self._of_mode(holding)
        if form is not None:
            return form
        first, route = order.nodes[0], holding.route
        # with its base behind it, the drone still has to be where that ended
        waits = bool(route.nodes) or route.decision == holding.last_node
        if (first.node_id, first.sequence_id) != route.decision or not waits:
            what = f"{first.node_id} with sequenceId {first.sequence_id} is not the decision point"
            return Refusal(ErrorType.START_NODE_OUT_OF_RANGE, what)
        return self._impossibility(order, holding.situation, is_new=False)

    def _impossibility(self, order: Order, seen: Situation | None, *, is_new: bool) -> Refusal | None:
        at = None if seen is None else seen.position
        theta = at.theta if at is not None and is_new else None
        if (field := unsupported_field(order, self.speed_mps, theta)) is not None:
            path, why = wire_path(Order, field[0], self.version), field[1]
            return Refusal(ErrorType.UNSUPPORTED_PARAMETER, f"{path} {why}", (("parameter", path),))
        node, at_m = None if seen is None else seen.node, None if at is None else (at.x, at.y)
        return impossibility(order, self.floor, self.floor.next_to(node, at_m), self.in_reach_m)

    def allows_orders(self, mode: OperatingMode) -> bool:
        """Whether orders are taken in a mode."""
        return mode in FLIES or (mode is OperatingMode.INTERVENED and self.version is not Version.V2_1)

    def _of_mode(self, holding: Holding) -> Refusal | None:
        if self.allows_orders(holding.mode):
            return None
        return Refusal(ErrorType.MOBILE_ROBOT_NOT_AVAILABLE, f"the operating mode is {holding.mode}")

    def _in_reach(self, node: Node, seen: Situation | None) -> bool:
        """Whether the drone stands on a node, or within the deviation that is allowed from it."""
        if seen is None:
            return False
        if seen.node is not None and seen.node == node.node_id:
            return True
        told = node.node_position
        if seen.position is None or told is None or told.map_id != seen.position.map_id:
            return False
        return is_within(told, seen.position.x, seen.position.y, self.in_reach_m)


def _content(order: Order) -> Order:
    return msgspec.structs.replace(order, header_id=0, timestamp="")
