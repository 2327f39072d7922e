"""The floor as traffic sees it: vertices in the air over nodes and on pads, lanes between them, and the cells
of each: boxes of air of which two drones never share one.

A vertex is a node at one level of flight, or a pad on the floor.  A lane is a painted line at one level, the
climb between two levels over a node, or the way between a node and its pad.  A column is all the air over a
node, in which a drone climbs while it counts.  Vertices, lanes and columns are the resources that traffic
hands out; they are numbered in this order.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

from flightd.site.site import Site
from flightd.site.ways import KEEP_OUT_HEIGHT_M

UPRIGHT: Final = -1
"""In place of the quarter of a lane: it leads up or down, or to a pad, under whatever heading."""


@dataclass(frozen=True, slots=True)
class Vertex:
    """Where a drone may stand still: over `node` at `height_m`, or on the `pad` beside it."""

    name: str
    node: str
    x_m: float
    y_m: float
    height_m: float
    pad: str | None = None


@dataclass(frozen=True, slots=True)
class Lane:
    """A way between two vertices, flown both ways unless `one_way`, from a to b.  `quarter` is the heading of
    a flight from a to b in quarter turns clockwise from x, or UPRIGHT."""

    a: int
    b: int
    length_m: float
    quarter: int
    one_way: bool = False


@dataclass(frozen=True, slots=True)
class Arc:
    """One direction of a lane; `resource` is the number of the lane among the resources."""

    to: int
    resource: int
    length_m: float
    quarter: int


@dataclass(frozen=True, slots=True)
class Box:
    """Air from one corner to the other, metres on the map and above the floor."""

    x0_m: float
    y0_m: float
    z0_m: float
    x1_m: float
    y1_m: float
    z1_m: float


class LaneGraph:
    """Vertices and lanes, and the numbers of their resources."""

    def __init__(self, vertices: Sequence[Vertex], lanes: Sequence[Lane]) -> None:
        self.vertices = tuple(vertices)
        self.lanes = tuple(lanes)
        self.index: Mapping[str, int] = {vertex.name: i for i, vertex in enumerate(vertices)}
        self.arcs: tuple[tuple[Arc, ...], ...] = self._arcs()
        heights: dict[str, list[float]] = {}
        for vertex in vertices:
            if vertex.pad is None:
                heights.setdefault(vertex.node, []).append(vertex.height_m)
        self._nodes = tuple(heights)
        self._spans = {node: (min(all_m), max(all_m)) for node, all_m in heights.items()}
        first = len(self.vertices) + len(self.lanes)
        self.column_of: Mapping[str, int] = {node: first + i for i, node in enumerate(self._nodes)}
        """The resource of all the air over a node."""

    def _arcs(self) -> tuple[tuple[Arc, ...], ...]:
        found: list[list[Arc]] = [[] for _ in self.vertices]
        for i, lane in enumerate(self.lanes, start=len(self.vertices)):
            found[lane.a].append(Arc(lane.b, i, lane.length_m, lane.quarter))
            if not lane.one_way:
                back = lane.quarter if lane.quarter == UPRIGHT else (lane.quarter + 2) % 4
                found[lane.b].append(Arc(lane.a, i, lane.length_m, back))
        return tuple(map(tuple, found))

    @property
    def pads(self) -> tuple[int, ...]:
        """The vertices on pads."""
        return tuple(i for i, vertex in enumerate(self.vertices) if vertex.pad is not None)

    @property
    def resources(self) -> int:
        """How many there are."""
        return len(self.vertices) + len(self.lanes) + len(self._nodes)

    @cached_property
    def boxes(self) -> tuple[Box, ...]:
        """What the middle of a drone on each resource may pass."""
        return (
            *(_around(vertex, vertex) for vertex in self.vertices),
            *(_around(self.vertices[lane.a], self.vertices[lane.b]) for lane in self.lanes),
            *self._columns(),
        )

    def _columns(self) -> list[Box]:
        """All the air over each node, from its lowest level to its highest."""
        lowest: dict[str, Vertex] = {}
        for vertex in self.vertices:
            if vertex.pad is None:
                lowest.setdefault(vertex.node, vertex)
        return [
            Box(there.x_m, there.y_m, self._spans[node][0], there.x_m, there.y_m, self._spans[node][1])
            for node, there in lowest.items()
        ]

    def over(self, node: str) -> int:
        """The vertex over a node at the lowest level.  KeyError where there is none."""
        return self.index[node]

    def name(self, resource: int) -> str:
        """A resource in words."""
        if resource < len(self.vertices):
            return self.vertices[resource].name
        if (number := resource - len(self.vertices)) < len(self.lanes):
            lane = self.lanes[number]
            return f"{self.vertices[lane.a].name}-{self.vertices[lane.b].name}"
        return f"all over {self._nodes[number - len(self.lanes)]}"

    def nodes_of(self, resource: int) -> tuple[str, ...]:
        """The nodes of the map that a resource belongs to: one, or the two ends of a lane."""
        if resource < len(self.vertices):
            return (self.vertices[resource].node,)
        if (number := resource - len(self.vertices)) < len(self.lanes):
            lane = self.lanes[number]
            return self.vertices[lane.a].node, self.vertices[lane.b].node
        return (self._nodes[number - len(self.lanes)],)

    def ends_of(self, lane: int) -> tuple[int, int]:
        """The vertices between which a lane leads, by its number among the resources."""
        found = self.lanes[lane - len(self.vertices)]
        return found.a, found.b

    def lanes_between(self, pairs: Iterable[tuple[str, str]]) -> frozenset[int]:
        """The resources of the lanes over the lines between these pairs of nodes, at every level."""
        wanted = {frozenset(pair) for pair in pairs}
        first = len(self.vertices)
        return frozenset(
            first + i
            for i, lane in enumerate(self.lanes)
            if frozenset((self.vertices[lane.a].node, self.vertices[lane.b].node)) in wanted
        )


def _around(a: Vertex, b: Vertex) -> Box:
    return Box(
        min(a.x_m, b.x_m),
        min(a.y_m, b.y_m),
        min(a.height_m, b.height_m),
        max(a.x_m, b.x_m),
        max(a.y_m, b.y_m),
        max(a.height_m, b.height_m),
    )


def lanes_of(site: Site, levels_m: Sequence[float] = (1.5,)) -> LaneGraph:
    """The lanes of a site for flight at `levels_m`, rising.  Lines that are blocked or closed by a keep-out
    at a level have no lane there."""
    vertices: list[Vertex] = []
    at: dict[tuple[str, int], int] = {}
    for level, height_m in enumerate(levels_m):
        for node in site.nodes.values():
            name = node.id if level == 0 else f"{node.id}@{height_m:g}m"
            at[node.id, level] = len(vertices)
            vertices.append(Vertex(name, node.id, node.x_m, node.y_m, height_m))
    lanes: list[Lane] = []
    for level, height_m in enumerate(levels_m):
        there = site.between(height_m - KEEP_OUT_HEIGHT_M, height_m + KEEP_OUT_HEIGHT_M)
        for edge in site.edges:
            if not there.is_closed(edge):
                a, b = at[edge.a, level], at[edge.b, level]
                lanes.append(_level_lane(vertices, a, b, edge.one_way))
    for level in range(1, len(levels_m)):
        low_m, high_m = levels_m[level - 1], levels_m[level]
        lanes += [
            Lane(at[node.id, level - 1], at[node.id, level], high_m - low_m, UPRIGHT)
            for node in site.nodes.values()
            if site.is_clear((node.x_m, node.y_m, low_m), (node.x_m, node.y_m, high_m))
        ]
    for pad in site.pads:
        x_m, y_m = site.pad_centre(pad)
        lanes.append(Lane(at[pad.node, 0], len(vertices), levels_m[0] + math.hypot(*pad.offset_m), UPRIGHT))
        vertices.append(Vertex(f"pad {pad.id}", pad.node, x_m, y_m, 0.0, pad.id))
    return LaneGraph(vertices, lanes)


def _level_lane(vertices: Sequence[Vertex], a: int, b: int, one_way: bool) -> Lane:
    one, two = vertices[a], vertices[b]
    dx, dy = two.x_m - one.x_m, two.y_m - one.y_m
    return Lane(a, b, math.hypot(dx, dy), round(math.atan2(dy, dx) / (math.pi / 2)) % 4, one_way)
