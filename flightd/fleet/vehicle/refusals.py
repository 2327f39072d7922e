"""What an order is refused for before it is compared with the one that is flown."""

from __future__ import annotations

import itertools
import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass

from flightd.core.errors import InputError
from flightd.fleet.vda5050.errors import ErrorType
from flightd.fleet.vda5050.order import Node, NodePosition, Order
from flightd.fleet.vda5050.parts import Action
from flightd.fleet.vehicle.abilities import ABILITIES
from flightd.fleet.vehicle.floor import Floor


@dataclass(frozen=True, slots=True)
class Refusal:
    """`error` says what kind, `what` is for people; `about` are further references, key and value."""

    error: ErrorType
    what: str
    about: tuple[tuple[str, str], ...] = ()


def malformation(order: Order, known_actions: Collection[str], *, is_new: bool) -> Refusal | None:
    """Why an order is none by its form; `known_actions` are the ids of those that it may not have again.  An
    update has those of its first node again, and any number to begin with."""
    if is_new and order.nodes and order.nodes[0].sequence_id:
        return Refusal(ErrorType.VALIDATION_FAILURE, "nodes[0].sequenceId: a new order begins with 0")
    for what in _malformations(order, order.nodes if is_new else order.nodes[1:], known_actions):
        return Refusal(ErrorType.VALIDATION_FAILURE, what)
    return None


def _malformations(order: Order, added: Sequence[Node], known_actions: Collection[str]) -> Iterator[str]:
    nodes, edges = order.nodes, order.edges
    if not nodes:
        yield "nodes: there is none"
        return
    if len(edges) != len(nodes) - 1:
        yield f"edges: {len(edges)} for {len(nodes)} nodes; one less than nodes"
        return
    first = nodes[0].sequence_id
    for i, node in enumerate(nodes):
        if node.sequence_id != first + 2 * i:
            yield f"nodes[{i}].sequenceId: {node.sequence_id}, not {first + 2 * i}"
    for i, edge in enumerate(edges):
        if edge.sequence_id != first + 2 * i + 1:
            yield f"edges[{i}].sequenceId: {edge.sequence_id}, not {first + 2 * i + 1}"
    yield from _releases(order)
    met = set(known_actions)
    for actions in (*(node.actions for node in added), *(edge.actions for edge in edges)):
        for action in actions:
            if action.action_id in met:
                yield f"actionId {action.action_id!r} comes twice"
            met.add(action.action_id)


def _releases(order: Order) -> Iterator[str]:
    if not order.nodes[0].released:
        yield "nodes[0].released: the first node has to be"
    for i, (edge, (start, end)) in enumerate(zip(order.edges, itertools.pairwise(order.nodes), strict=True)):
        if edge.released and not (start.released and end.released):
            yield f"edges[{i}].released: its nodes are not"
        if end.released and not edge.released:
            yield f"nodes[{i + 1}].released: the edge before it is not"


def impossibility(order: Order, floor: Floor, next_to: Collection[str], in_reach_m: float) -> Refusal | None:
    """Why an order of good form cannot be flown here: actions, the map, ways.  `next_to` are the nodes to
    which the drone can fly at once, `in_reach_m` is how far from its place on the floor a node may be told
    to lie."""
    return (
        _impossible_action(order, floor)
        or _other_map(order, floor)
        or _elsewhere(order, floor, in_reach_m)
        or _no_way(order, floor, next_to)
    )


def _impossible_action(order: Order, floor: Floor) -> Refusal | None:
    for edge in order.edges:
        for action in edge.actions:
            return _action_refusal(action, "actionType", f"no action is done on edges: {action.action_type}")
    for node in order.nodes:
        for action in node.actions:
            ability = ABILITIES.get(action.action_type)
            if ability is None:
                return _action_refusal(action, "actionType", f"no action is called {action.action_type!r}")
            if action.blocking_type not in ability.blocking:
                return _action_refusal(action, "blockingType", f"{action.blocking_type} is not supported")
            try:
                ability.check(action, node.node_id, floor)
            except InputError as err:
                return _action_refusal(action, err.key, f"{action.action_type}: {err.key}: {err.what}")
    return None


def _action_refusal(action: Action, field: str, what: str) -> Refusal:
    about = (("actionId", action.action_id), ("parameter", field))
    return Refusal(ErrorType.INVALID_ORDER_ACTION, what, about)


def _other_map(order: Order, floor: Floor) -> Refusal | None:
    for node in order.nodes:
        if node.node_position is not None and node.node_position.map_id != floor.map_id:
            told = node.node_position.map_id
            return Refusal(ErrorType.UNKNOWN_MAP_ID, f"no map is called {told!r}", (("mapId", told),))
    return None


def _elsewhere(order: Order, floor: Floor, in_reach_m: float) -> Refusal | None:
    for node in order.nodes:
        here, told = floor.at_m.get(node.node_id), node.node_position
        if here is not None and told is not None and not is_within(told, *here, in_reach_m):
            what = f"node {node.node_id} lies at {here[0]:g}, {here[1]:g} m, not at {told.x:g}, {told.y:g} m"
            return Refusal(ErrorType.NO_ROUTE_TO_TARGET, what, (("nodeId", node.node_id),))
    return None


def is_within(told: NodePosition, x: float, y: float, in_reach_m: float) -> bool:
    """Whether a place is so near a node's, or within the deviation that is allowed from that."""
    dx, dy = x - told.x, y - told.y
    if math.hypot(dx, dy) <= in_reach_m:
        return True
    allowed = told.allowed_deviation_xy
    if allowed is None or not allowed.a or not allowed.b:
        return False
    c, s = math.cos(allowed.theta), math.sin(allowed.theta)
    return ((c * dx + s * dy) / allowed.a) ** 2 + ((c * dy - s * dx) / allowed.b) ** 2 <= 1.0


def _no_way(order: Order, floor: Floor, next_to: Collection[str]) -> Refusal | None:
    names: Sequence[str] = [node.node_id for node in order.nodes]
    for name in names[1:]:
        if name not in floor.nodes:
            return Refusal(ErrorType.NO_ROUTE_TO_TARGET, f"there is no node {name!r}", (("nodeId", name),))
    for start, end in itertools.pairwise(names):
        # where the first node is no place of the floor, the drone is there
        is_open = start == end or (start, end) in floor.ways if start in floor.nodes else end in next_to
        if not is_open:
            what = f"no open way leads from {start} to {end}"
            return Refusal(ErrorType.NO_ROUTE_TO_TARGET, what, (("nodeId", end),))
    return None
