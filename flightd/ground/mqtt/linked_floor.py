"""A drone's floor as its ground link tells it: what orders may ask of it, and how far each way leads."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator, Sequence

from flightd.adapters.ground_link.messages.counts import NodeCount
from flightd.adapters.ground_link.messages.floor import FloorLine, FloorNode, FloorPad, FloorStatus
from flightd.fleet.vehicle.floor import Floor
from flightd.site.site import Side
from flightd.site.ways import Ways

_ON_LINE_M = 0.05
_PADS = ""
"""Of all charge pads together, where the way home is measured from."""


def floor_of_link(floor: FloorStatus) -> Floor:
    """The floor that the vehicle's orders are checked by."""
    sides: dict[str, set[Side]] = {}
    for rack in floor.racks:
        sides.setdefault(rack.aisle, set()).add(Side(rack.side))
    # a floor without a single place is one whose places nobody has named
    told = any(node.levels for node in floor.nodes)
    shelves = {
        node.id: {side: _levels(node, side) if told else None for side in sides.get(node.aisle, ())}
        for node in floor.nodes
    }
    at_m = {node.id: (node.x_m, 0.0 - node.y_m) for node in floor.nodes}
    return Floor(floor.name, frozenset(shelves), frozenset(open_ways(floor)), shelves, at_m)


def _levels(node: FloorNode, side: Side) -> frozenset[int] | None:
    levels = node.left if side is Side.LEFT else node.right
    return None if levels is None else frozenset(levels)


def node_of_pad(floor: FloorStatus, pad: FloorPad) -> str:
    """The node beside which a pad lies."""
    return min(floor.nodes, key=lambda node: math.dist((node.x_m, node.y_m), (pad.x_m, pad.y_m))).id


class WaysHome:
    """The metres of ways on a floor, and of those from their ends to the nearest charge pad; and the shelves
    that are counted on them."""

    def __init__(self, floor: FloorStatus) -> None:
        self._levels = {
            (node.id, side): _levels(node, side) or frozenset() for node in floor.nodes for side in Side
        }
        self._at = {node.id: (node.x_m, node.y_m) for node in floor.nodes}
        landed = [node_of_pad(floor, pad) for pad in floor.pads if pad.charge and not pad.shared]
        landed = landed or [floor.home]
        back = [(b, a, self._apart_m(a, b)) for a, b in open_ways(floor)]
        ways = Ways([_PADS, *self._at], [*((_PADS, node, 0.0) for node in landed), *back])
        self._home_m = {_PADS: 0.0}
        for node, before in ways.reach(_PADS).items():
            if node != _PADS:
                first = 0.0 if before == _PADS else self._apart_m(before, node)
                self._home_m[node] = self._home_m[before] + first

    def there_and_home_m(
        self, here: str, nodes: Sequence[str], at_m: tuple[float, float] | None = None
    ) -> Iterator[float]:
        """For each of the nodes: from `here` along all before it to it, and home; infinite where no way leads
        home.  Where `here` is no node, the drone is at `at_m` (None: that is not known)."""
        gone_m, last_m = 0.0, self._at.get(here, at_m)
        for node in nodes:
            next_m = self._at.get(node)
            gone_m += math.inf if last_m is None or next_m is None else math.dist(last_m, next_m)
            last_m = next_m
            yield gone_m + self._home_m.get(node, math.inf)

    def shelves(self, counts: Iterable[NodeCount]) -> int:
        """At how many levels of sides of nodes places are counted, each once."""
        found: set[tuple[str, Side, int]] = set()
        for one in counts:
            for side in Side:
                here = self._levels.get((one.node, side), frozenset())
                levels = here.intersection(one.levels) if one.levels else here
                found |= {(one.node, side, level) for level in levels if one.side in {"", side}}
        return len(found)

    def _apart_m(self, a: str, b: str) -> float:
        return math.dist(self._at[a], self._at[b])


def open_ways(floor: FloorStatus) -> set[tuple[str, str]]:
    """From each node to the next on its painted lines, but for what is closed or one way."""
    found: set[tuple[str, str]] = set()
    for line in floor.lines:
        along = sorted(_along(line, floor.nodes))
        found |= {pair for (_, a), (_, b) in itertools.pairwise(along) for pair in ((a, b), (b, a))}
    for way in floor.ways:
        found.discard((way.b, way.a))
        if way.closed:
            found.discard((way.a, way.b))
    return found


def _along(line: FloorLine, nodes: Sequence[FloorNode]) -> Iterator[tuple[float, str]]:
    """The nodes on a line, each with its metres from the line's beginning."""
    dx, dy = line.x1_m - line.x0_m, line.y1_m - line.y0_m
    length_m = math.hypot(dx, dy)
    if not length_m:
        return
    for node in nodes:
        x, y = node.x_m - line.x0_m, node.y_m - line.y0_m
        along_m, beside_m = (x * dx + y * dy) / length_m, (x * dy - y * dx) / length_m
        if abs(beside_m) < _ON_LINE_M and -_ON_LINE_M <= along_m <= length_m + _ON_LINE_M:
            yield along_m, node.id
