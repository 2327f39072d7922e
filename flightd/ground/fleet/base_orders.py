"""The orders of VDA 5050 by which a drone flies what traffic released it to: one order from pad to pad, made
longer with each release.  Every node of it is of the base."""

from __future__ import annotations

import itertools
import uuid
from collections.abc import Sequence
from typing import Final

from flightd.fleet.vda5050.codec import Version
from flightd.fleet.vda5050.order import Edge, InstantActions, Node, Order
from flightd.fleet.vda5050.parts import Action, ActionParameter, BlockingType
from flightd.fleet.vehicle.abilities import SCAN_SHELF

VERSION: Final = Version.V3_0


class BaseOrders:
    """Begins at the node where the drone is; `node` adds one more, `take` gives what is new as an order."""

    def __init__(self, here: str) -> None:
        self._id = f"fleet-{uuid.uuid4().hex}"
        self._number = -1
        self._decision = here, 0
        self._new: list[Node] = []

    @property
    def end(self) -> tuple[str, int]:
        """The last node and its sequence id."""
        if self._new:
            return self._new[-1].node_id, self._new[-1].sequence_id
        return self._decision

    def node(self, node: str, actions: Sequence[Action] = ()) -> int:
        """One more; its sequence id."""
        sequence = self.end[1] + 2
        self._new.append(Node(node_id=node, sequence_id=sequence, released=True, actions=[*actions]))
        return sequence

    def do_at_end(self, actions: Sequence[Action]) -> int:
        """Do these at the last node; its sequence id."""
        if not self._new or self._new[-1].actions:
            return self.node(self.end[0], actions)
        last = self._new.pop()
        return self.node(last.node_id, actions)

    def take(self) -> Order | None:
        """The order, or what is new of it; None where nothing is."""
        if not self._new and self._number >= 0:
            return None
        name, first = self._decision
        nodes = [Node(node_id=name, sequence_id=first, released=True, actions=[]), *self._new]
        edges = [
            Edge(edge_id=f"{a.node_id}-{b.node_id}", sequence_id=a.sequence_id + 1, released=True, actions=[])
            for a, b in itertools.pairwise(nodes)
        ]
        self._number += 1
        self._decision, self._new = self.end, []
        return Order(
            header_id=self._number,
            timestamp="",
            version=VERSION.value,
            manufacturer="",
            serial_number="",
            order_id=self._id,
            order_update_id=self._number,
            nodes=nodes,
            edges=edges,
        )


def scan(levels: Sequence[int] = ()) -> Action:
    """To count what is seen from a node, on these levels (none: all)."""
    return Action(
        action_type=SCAN_SHELF,
        action_id=uuid.uuid4().hex,
        blocking_type=BlockingType.HARD,
        action_parameters=[ActionParameter(key="levels", value=[*levels])] if levels else None,
    )


def instant(kind: str) -> InstantActions:
    """startPause, stopPause, cancelOrder."""
    action = Action(action_type=kind, action_id=uuid.uuid4().hex, blocking_type=BlockingType.NONE)
    return InstantActions(
        header_id=0, timestamp="", version=VERSION.value, manufacturer="", serial_number="", actions=[action]
    )
