"""Which ways people mean who close an aisle, or what lies between some nodes."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import msgspec

from flightd.adapters.ground_link.messages.floor import FloorStatus
from flightd.core.errors import InputError
from flightd.fleet.traffic.closures import Closure
from flightd.ground.fleet.fleet_memory import FILE
from flightd.ground.mqtt.linked_floor import node_of_pad, open_ways
from flightd.site.site import SAME_NODE_M


def aisle_closure(floor: FloorStatus, aisle: str) -> Closure:
    """All ways within an aisle but those that lead from a pad at its end to the first crossing: who comes
    home lands.  InputError where that leaves none."""
    of = {node.id: node.aisle for node in floor.nodes}
    if aisle not in of.values():
        raise InputError(f"no aisle is called {aisle}")
    others = _neighbours(floor)
    ways = {_way(a, b) for a in of for b in others[a] if of[a] == of[b] == aisle}
    for pad in floor.pads:
        ways -= _spur(node_of_pad(floor, pad), others)
    if not ways:
        raise InputError(f"aisle {aisle} has no ways but to pads", remedy="close what is between its nodes")
    return Closure(aisle, tuple(sorted(ways)), f"aisle {aisle} is closed")


def closure_between(floor: FloorStatus, nodes: Sequence[str]) -> Closure:
    """The ways of which both ends are among these nodes.  InputError where none is."""
    known = {node.id for node in floor.nodes}
    if unknown := [node for node in nodes if node not in known]:
        raise InputError(f"no node is called {unknown[0]}")
    chosen, others = sorted({*nodes}), _neighbours(floor)
    ways = {_way(a, b) for a in chosen for b in others[a] if b in chosen}
    if not ways:
        raise InputError("no way leads between these nodes")
    name = ", ".join(chosen)
    return Closure(name, tuple(sorted(ways)), f"what is between {name} is closed")


def places_of(floor: FloorStatus, closure: Closure) -> dict[str, tuple[float, float]]:
    """Where its nodes are, x and y in metres: by that it is known on a map with other names."""
    return {node.id: (node.x_m, node.y_m) for node in floor.nodes if node.id in closure.nodes}


def on_map(floor: FloorStatus, closure: Closure, places: Mapping[str, tuple[float, float]]) -> Closure:
    """The closure as this map calls its nodes, which it has at the same `places` (none: they are known by
    their names alone).  InputError where a way of it is on no line of this map, blocked ones among them: what
    it closed may be flown over other nodes there."""
    names = {node: _at(floor, place) for node, place in places.items()}
    ways = tuple(_way(names.get(a, a), names.get(b, b)) for a, b in closure.ways)
    if not open_ways(msgspec.structs.replace(floor, ways=())).issuperset(ways):
        raise InputError(f"{closure.why}, but on another map ({FILE})", remedy="open it, and close it again")
    return replace(closure, ways=ways)


def everywhere(floor: FloorStatus, closure: Closure, why: str) -> Closure:
    """The closure over all ways of this map, for it may be over any of them; `why` is told of what waits."""
    return replace(closure, ways=tuple(sorted({_way(a, b) for a, b in open_ways(floor)})), why=why)


def _at(floor: FloorStatus, place: tuple[float, float]) -> str:
    """The node that is there; empty where none is."""
    nearest = min(floor.nodes, key=lambda node: math.dist((node.x_m, node.y_m), place))
    return nearest.id if math.dist((nearest.x_m, nearest.y_m), place) <= SAME_NODE_M else ""


def _neighbours(floor: FloorStatus) -> Mapping[str, set[str]]:
    found: dict[str, set[str]] = {node.id: set() for node in floor.nodes}
    for a, b in open_ways(floor):
        found[a].add(b)
        found[b].add(a)
    return found


def _spur(pad: str, others: Mapping[str, set[str]]) -> set[tuple[str, str]]:
    """The ways from the node of a pad, where a line ends, to the first crossing."""
    ways: set[tuple[str, str]] = set()
    before, here = "", pad
    while len(onward := others[here] - {before}) == 1:
        before, (here,) = here, onward
        ways.add(_way(before, here))
    return ways


def _way(a: str, b: str) -> tuple[str, str]:
    return (a, b) if a < b else (b, a)
