"""The warehouse as the drone knows it: nodes on painted lines, pads, shelves, and the ways between.

Map frame: x along the aisles, y to the right of x seen from above, both in metres on the floor; angles
clockwise from x.  A `Site` is made by `flightd.site.layout.lay_out` from its aisles, never by hand.
"""

from __future__ import annotations

import enum
import itertools
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

from flightd.core.errors import InputError
from flightd.core.markers import MarkerDictionary, MarkerSet
from flightd.site.ways import KEEP_OUT_HEIGHT_M, KeepOut, NoWayError, OneWay, Ways

ASSUMED_CEILING_M = 2.5
"""The ceiling of a site whose file gives none: half a metre below it, at 2 m, nobody needs to measure one."""
PAD_REACH_M = 0.5
"""A pad further than this from its place on the map is not taken for it."""
SAME_NODE_M = 0.3
"""A node that is so near where one was on another map is the same: a map may be measured anew."""


class LineColour(enum.StrEnum):
    """Colours of guide paint that have a name (`core.paint`); a site may have any other tone, #rrggbb."""

    YELLOW = "yellow"
    WHITE = "white"
    RED = "red"
    BLUE = "blue"
    GREEN = "green"
    BLACK = "black"
    ORANGE = "orange"


class Side(enum.StrEnum):
    """Side of an aisle for someone who looks along +x: left is -y, right is +y."""

    LEFT = "left"
    RIGHT = "right"


@dataclass(frozen=True, slots=True)
class Aisle:
    """One straight aisle line and its nodes: the first at (`x_m`, `y_m`), each next one `spacing_m`
    further along x.  The aisle line runs `overrun_m` past its end nodes; the node's own cross line
    reaches `cross_half_m` to both sides.  A shelf's face stands `shelf_distance_m` from the line.  With
    `one_way` it is flown in that direction only."""

    id: str
    x_m: float
    y_m: float
    spacing_m: tuple[float, ...]
    cross_half_m: float = 0.5
    overrun_m: float = 0.4
    shelves: tuple[Side, ...] = (Side.LEFT, Side.RIGHT)
    shelf_distance_m: float = 1.2
    shelf_height_m: float = 3.0
    one_way: OneWay | None = None

    @property
    def size(self) -> int:
        """Number of nodes."""
        return len(self.spacing_m) + 1

    @property
    def end_x_m(self) -> float:
        """x of the last node."""
        return self.x_m + math.fsum(self.spacing_m)


@dataclass(frozen=True, slots=True)
class Node:
    """A crossing of painted lines; `index` counts from 1 along the aisle, `id` is aisle and index."""

    id: str
    x_m: float
    y_m: float
    aisle: str
    index: int


@dataclass(frozen=True, slots=True)
class Edge:
    """A painted line between two neighbouring nodes, flown both ways unless it is `one_way`, from a to b."""

    a: str
    b: str
    one_way: bool = False


@dataclass(frozen=True, slots=True)
class PaintedLine:
    """Centre line and width of one straight stroke of paint with square ends."""

    x0_m: float
    y0_m: float
    x1_m: float
    y1_m: float
    width_m: float


class PadSign(enum.StrEnum):
    """By what a pad is found: its own mat, or the end of a painted line, from which it lies as on the map."""

    MAT = "mat"
    LINE_END = "line_end"


@dataclass(frozen=True, slots=True)
class Pad:
    """A square of floor on a node, its centre `offset_m` (x, y) off; missions may `start` on it, batteries
    change where `charge`.  On a `shared` one a drone comes down only where it is told to: another one may
    stand there."""

    id: str
    node: str
    size_m: float
    start: bool = True
    charge: bool = True
    offset_m: tuple[float, float] = (0.0, 0.0)
    sign: PadSign = PadSign.MAT
    shared: bool = False


@dataclass(frozen=True, slots=True)
class Marker:
    """A square marker on the floor, its centre at (`x_m`, `y_m`), black border included `size_m` wide;
    at `yaw_rad` 0 its upper edge runs along x."""

    id: int
    dictionary: MarkerDictionary
    x_m: float
    y_m: float
    size_m: float = 0.2
    yaw_rad: float = 0.0


@dataclass(frozen=True, slots=True)
class Shelf:
    """One unbroken shelf front: a vertical rectangle over y = `y_m` from `x0_m` to `x1_m`, floor to
    `height_m`, facing its aisle."""

    aisle: str
    side: Side
    x0_m: float
    x1_m: float
    y_m: float
    height_m: float

    @property
    def inward(self) -> float:
        """The y direction from the aisle into the rack, +1 or -1."""
        return -1.0 if self.side is Side.LEFT else 1.0


@dataclass(frozen=True, slots=True)
class Rack:
    """How the shelf fronts on `sides` of `aisles` are divided.  Bays of `bay_width_m` stand in the middle
    of each front; `levels_m` are the heights at which the labels hang; each level of a bay has `positions`
    places.  `pattern` makes the location code of {aisle} {side} (L, R) {bay} {level} {position}.  Goods stand
    `deck_below_label_m` below their labels; None: two fifths of the level spacing.  In each place so many
    pallets stand behind one another as `pallets_deep` says."""

    aisles: tuple[str, ...]
    bay_width_m: float
    levels_m: tuple[float, ...]
    positions: int = 1
    sides: tuple[Side, ...] = (Side.LEFT, Side.RIGHT)
    pattern: str = "{aisle}{side}-{bay:02}-{level}-{position}"
    deck_below_label_m: float | None = None
    pallets_deep: int = 1


@dataclass(frozen=True, slots=True)
class Location:
    """One place for goods: where its label hangs on the shelf front, the node that faces it, and how many
    pallets stand behind one another in it."""

    code: str
    aisle: str
    side: Side
    bay: int
    level: int
    position: int
    x_m: float
    y_m: float
    height_m: float
    node: str
    pallets_deep: int = 1


@dataclass(frozen=True)
class Site:
    """A whole warehouse floor; immutable, connected, every edge on paint."""

    name: str
    aisles: tuple[Aisle, ...]
    crosses: tuple[Edge, ...]
    nodes: Mapping[str, Node]
    edges: tuple[Edge, ...]
    lines: tuple[PaintedLine, ...]
    pads: tuple[Pad, ...]
    shelves: tuple[Shelf, ...]
    line_width_m: float
    line_colour: str
    ceiling_m: float
    racks: tuple[Rack, ...] = ()
    locations: Mapping[str, Location] = field(default_factory=dict)
    blocked: tuple[tuple[str, str], ...] = ()
    keep_outs: tuple[KeepOut, ...] = ()
    low_keep_outs: tuple[KeepOut, ...] = ()
    """Those that lie wholly below what the site is flown between: over them is no place to sink to."""
    markers: tuple[Marker, ...] = ()
    interlock: bool = False
    """Whether nothing may arm here unless an interlock says that the aisles are closed to people."""
    unattended_start: bool = False
    """Whether a ground station's schedules may start a flight here without a person."""
    ceiling_given: bool = True
    """Whether the site file gives the ceiling; otherwise it is ASSUMED_CEILING_M."""

    @cached_property
    def _ways(self) -> Ways:
        return Ways(self.nodes, self._arcs(against_one_way=False))

    @cached_property
    def _ways_in_need(self) -> Ways:
        return Ways(self.nodes, self._arcs(against_one_way=True))

    def _arcs(self, *, against_one_way: bool) -> list[tuple[str, str, float]]:
        """Every direction of every line that is open, in a fixed order."""
        found = []
        for edge in self.edges:
            if not self.is_closed(edge):
                length_m = self.distance_m(edge.a, edge.b)
                found.append((edge.a, edge.b, length_m))
                if against_one_way or not edge.one_way:
                    found.append((edge.b, edge.a, length_m))
        return sorted(found, key=lambda arc: (arc[0], self._order(arc[1])))

    def is_closed(self, edge: Edge) -> bool:
        """Whether an edge is blocked or too near a keep-out, in both directions."""
        if any({edge.a, edge.b} == {*pair} for pair in self.blocked):
            return True
        a, b = self.nodes[edge.a], self.nodes[edge.b]
        return any(area.touches(a.x_m, a.y_m, b.x_m, b.y_m) for area in self.keep_outs)

    @cached_property
    def cut_off(self) -> frozenset[str]:
        """The nodes to which no open way leads from the home pad, or from which none leads back."""
        out = self._ways.reach(self.home.node)
        backward = Ways(self.nodes, [(b, a, m) for a, b, m in self._arcs(against_one_way=False)])
        return frozenset(self.nodes) - (out.keys() & backward.reach(self.home.node).keys())

    def is_clear(self, a_m: tuple[float, float, float], b_m: tuple[float, float, float]) -> bool:
        """Whether the box between two points (x, y, height) comes near no keep-out."""
        (ax, ay, ah), (bx, by, bh) = a_m, b_m
        low_m, high_m = min(ah, bh) - KEEP_OUT_HEIGHT_M, max(ah, bh) + KEEP_OUT_HEIGHT_M
        return not any(area.touches(ax, ay, bx, by) for area in self.between(low_m, high_m).keep_outs)

    @property
    def overhead_m(self) -> tuple[float, ...]:
        """The heights that keep clear below each keep-out; those of one that begins on the floor are no
        heights to fly at."""
        return tuple(area.from_m - KEEP_OUT_HEIGHT_M for area in self.keep_outs)

    def between(self, low_m: float, high_m: float) -> Site:
        """The site as it is for a drone that stays between two heights: of the keep-outs that lie wholly
        below or above, the lower ones are kept apart."""
        kept = tuple(area for area in self.keep_outs if area.from_m < high_m and area.to_m > low_m)
        if kept == self.keep_outs:
            return self
        below = tuple(area for area in self.keep_outs if area.to_m <= low_m)
        return replace(self, keep_outs=kept, low_keep_outs=self.low_keep_outs + below)

    @cached_property
    def _neighbours(self) -> dict[str, tuple[str, ...]]:
        found: dict[str, list[str]] = {node: [] for node in self.nodes}
        for edge in self.edges:
            found[edge.a].append(edge.b)
            found[edge.b].append(edge.a)
        return {node: tuple(sorted(others, key=self._order)) for node, others in found.items()}

    def _order(self, node: str) -> tuple[float, float, str]:
        there = self.nodes[node]
        return there.y_m, there.x_m, node

    @property
    def marker_set(self) -> MarkerSet | None:
        """What to look for on the floor; None without markers."""
        if not self.markers:
            return None
        return MarkerSet(self.markers[0].dictionary, tuple(marker.id for marker in self.markers))

    @property
    def home(self) -> Pad:
        """The pad missions start from and come back to: the one called `home`, else the first to start
        from."""
        starts = [pad for pad in self.pads if pad.start]
        return next((pad for pad in starts if pad.id == "home"), starts[0])

    def require(self, node: str) -> None:
        """InputError unless there is such a node."""
        if node not in self.nodes:
            raise InputError(
                f"site {self.name}: no node {node!r}; nodes are named like {next(iter(self.nodes))}"
            )

    @property
    def own_charge_pads(self) -> tuple[Pad, ...]:
        """Those to which a drone turns by itself: where batteries change and no other drone stands, else the
        home pad."""
        return tuple(pad for pad in self.pads if pad.charge and not pad.shared) or (self.home,)

    def pad_centre(self, pad: Pad) -> tuple[float, float]:
        """Where the middle of a pad is on the map, metres."""
        node = self.nodes[pad.node]
        return node.x_m + pad.offset_m[0], node.y_m + pad.offset_m[1]

    def neighbours(self, node: str) -> tuple[str, ...]:
        """Nodes one edge away, in a fixed order.  KeyError for an unknown node."""
        return self._neighbours[node]

    def distance_m(self, a: str, b: str) -> float:
        """Straight distance of two nodes."""
        return math.hypot(self.nodes[a].x_m - self.nodes[b].x_m, self.nodes[a].y_m - self.nodes[b].y_m)

    def nearest(self, x_m: float, y_m: float) -> Node:
        """The node closest to a point of the floor; ties go to the first in the map."""
        return min(self.nodes.values(), key=lambda node: math.hypot(node.x_m - x_m, node.y_m - y_m))

    def aisle_nodes(self, aisle: str) -> tuple[Node, ...]:
        """The nodes of one aisle by rising x.  Empty for an unknown aisle."""
        return tuple(node for node in self.nodes.values() if node.aisle == aisle)

    def aisle_order(self) -> tuple[Aisle, ...]:
        """The aisles from left to right (rising y)."""
        return tuple(sorted(self.aisles, key=lambda aisle: (aisle.y_m, aisle.x_m)))

    def bounds(self) -> tuple[float, float, float, float]:
        """(x_min, y_min, x_max, y_max) of everything painted and every shelf front."""
        xs = [x for line in self.lines for x in (line.x0_m, line.x1_m)]
        ys = [y for line in self.lines for y in (line.y0_m, line.y1_m)]
        xs += [x for shelf in self.shelves for x in (shelf.x0_m, shelf.x1_m)]
        ys += [shelf.y_m for shelf in self.shelves]
        return min(xs), min(ys), max(xs), max(ys)

    def path(self, start: str, goal: str, *, against_one_way: bool = False) -> tuple[str, ...]:
        """Shortest way along the open lines in metres, both ends included; one-way lines are flown
        `against_one_way` only in need, blocked ones and keep-outs never.

        Raises NoWayError when there is none, KeyError for an unknown node."""
        way = (self._ways_in_need if against_one_way else self._ways).path(start, goal)
        if way is None:
            raise NoWayError(
                f"site {self.name}: no open way from {start} to {goal}; one-way, blocked or keep-out close it"
            )
        return way

    def reach(self, start: str) -> dict[str, str]:
        """Each node that open ways lead to, nearest first, with the node before it on the shortest way."""
        return self._ways.reach(start)

    def length_m(self, way: Iterable[str]) -> float:
        """Metres flown along a list of nodes, each reached by the shortest way from the one before."""
        stops = self.expand(way)
        return math.fsum(self.distance_m(a, b) for a, b in itertools.pairwise(stops))

    def expand(self, goals: Iterable[str]) -> tuple[str, ...]:
        """The goals joined by shortest ways: a list in which consecutive nodes are neighbours."""
        full: list[str] = []
        for goal in goals:
            full.extend(self.path(full[-1], goal)[1:] if full else (goal,))
        return tuple(full)

    def serpentine_route(self) -> tuple[str, ...]:
        """Every node that is not cut off once, aisle by aisle from the home pad, and home again at the end.

        Consecutive goals of one aisle are neighbours unless lines are closed; between aisles and on the
        way home other nodes may have to be passed (`expand` gives them).  Each aisle is flown in the
        direction that is shorter from where the one before ended; the aisles on the home aisle's shorter
        side come first."""
        order = [aisle.id for aisle in self.aisle_order()]
        home = self.home.node
        at = order.index(self.nodes[home].aisle)
        before, after = order[:at][::-1], order[at + 1 :]
        sides = (before, after) if len(before) <= len(after) else (after, before)
        goals = [home]
        for aisle in [order[at], *sides[0], *sides[1]]:
            sweep = [node.id for node in self.aisle_nodes(aisle) if node.id not in self.cut_off]
            back = sweep[::-1]
            if sweep and self._sweep_m(goals[-1], back) < self._sweep_m(goals[-1], sweep):
                sweep = back
            goals += [node for node in sweep if node != home]
        return (*goals, home) if goals[-1] != home else tuple(goals)

    def _sweep_m(self, start: str, sweep: list[str]) -> float:
        return round(self.length_m((start, *sweep)), 6)
