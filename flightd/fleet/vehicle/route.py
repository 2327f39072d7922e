"""The way of an order that is still ahead: the base, released to be flown, and the horizon after it."""

from __future__ import annotations

from collections.abc import Sequence

from flightd.fleet.vda5050.order import Edge, Node, Order
from flightd.fleet.vda5050.state import EdgeState, NodeState, StatePosition


class Route:
    """`decision`: node id and sequence id of the last node of the base, where an update goes on; None before
    the first order."""

    def __init__(self) -> None:
        self.nodes: list[Node] = []
        self.edges: list[Edge] = []
        self.decision: tuple[str, int] | None = None

    @property
    def base(self) -> list[Node]:
        """The nodes ahead that are released."""
        return [node for node in self.nodes if node.released]

    @property
    def horizon(self) -> list[Node | Edge]:
        """What is ahead and not released."""
        nodes, edges = self.nodes, self.edges
        return [*(one for one in nodes if not one.released), *(one for one in edges if not one.released)]

    def begin(self, order: Order) -> None:
        """Take a new order; its first node counts as traversed."""
        self.nodes, self.edges = order.nodes[1:], list(order.edges)
        self._decide(order.nodes)

    def stitch(self, update: Order) -> None:
        """Put an update in the place of the horizon; its first node is the decision point, which stays."""
        self.nodes = [*self.base, *update.nodes[1:]]
        self.edges = [*(edge for edge in self.edges if edge.released), *update.edges]
        self._decide(update.nodes)

    def _decide(self, nodes: Sequence[Node]) -> None:
        last = [node for node in nodes if node.released][-1]
        self.decision = last.node_id, last.sequence_id

    def traverse(self) -> Node:
        """The next node is reached, and the edge before it is left."""
        node = self.nodes.pop(0)
        self.edges = [edge for edge in self.edges if edge.sequence_id > node.sequence_id]
        return node

    def cut(self, kept: int) -> None:
        """Leave all but the first `kept` nodes."""
        self.nodes = self.nodes[:kept]
        last = self.nodes[-1].sequence_id if self.nodes else -1
        self.edges = [edge for edge in self.edges if edge.sequence_id < last]

    def node_states(self) -> list[NodeState]:
        """As the state tells them."""
        return [
            NodeState(
                node_id=node.node_id,
                sequence_id=node.sequence_id,
                released=node.released,
                node_descriptor=node.node_descriptor,
                node_position=_position(node),
            )
            for node in self.nodes
        ]

    def edge_states(self) -> list[EdgeState]:
        """As the state tells them."""
        return [
            EdgeState(
                edge_id=edge.edge_id,
                sequence_id=edge.sequence_id,
                released=edge.released,
                edge_descriptor=edge.edge_descriptor,
            )
            for edge in self.edges
        ]


def _position(node: Node) -> StatePosition | None:
    told = node.node_position
    return StatePosition(x=told.x, y=told.y, map_id=told.map_id, theta=told.theta) if told else None
