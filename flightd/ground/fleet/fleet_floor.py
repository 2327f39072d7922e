"""The one floor of a fleet's drones, as traffic sees it: made of what each drone tells of its own map.

A drone climbs and comes down at the nodes where it counts, and flies at the height of its own configuration.
So there is one level of flight, and the cell of a drone reaches from the floor to the ceiling.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import msgspec

from flightd.adapters.ground_link.messages.floor import FloorPad, FloorStatus
from flightd.core.errors import InputError
from flightd.fleet.traffic.cells import CellSize
from flightd.fleet.traffic.docks import Dock, DockKind
from flightd.fleet.traffic.lanes import UPRIGHT, Box, Lane, LaneGraph, Vertex
from flightd.ground.mqtt.linked_floor import node_of_pad, open_ways
from flightd.site.ways import Ways

HEIGHT_M: Final = 1.5
"""Of all nodes; no two drones are ever apart by their heights."""
WHOLE_AIR_M: Final = 1000.0
_TO_PAD: Final = "pad of "
_DOCK: Final = "dock "
_NEAR_M: Final = 0.4
"""A drone hovers over a node that is so near."""
_CHARGES_S: Final = 1800.0
"""What a shared pad is taken to need to fill an empty battery."""


@dataclass(frozen=True, slots=True)
class OwnPad:
    """Where a drone stands at first, and comes home to; `charges`: its battery is filled there."""

    node: str
    x_m: float
    y_m: float
    charges: bool


def own_pad(drone: str, floor: FloorStatus, stands_on: str) -> OwnPad:
    """The pad of one drone, which stands beside the node `stands_on`.  InputError where it might come down on
    another one, which may be another drone's."""
    for pad in floor.pads:
        if pad.charge and not pad.shared and node_of_pad(floor, pad) != floor.home:
            raise InputError(
                f"{drone} would come down on the pad {pad.id}, too, on a low battery",
                remedy="let its site file say charge = false of every pad but its own",
            )
    if stands_on not in {floor.home, *(node_of_pad(floor, pad) for pad in _shared(floor))}:
        raise InputError(
            f"{drone} stands on the pad at {stands_on} and comes home to that at {floor.home}",
            remedy='call its own pad "home" in its site file',
        )
    pads: Iterable[FloorPad] = [pad for pad in floor.pads if node_of_pad(floor, pad) == floor.home]
    found = next(iter(pads), None)
    if found is None:
        raise InputError(f"{drone} has no pad at {floor.home}")
    return OwnPad(floor.home, found.x_m, found.y_m, found.charge)


class FleetFloor:
    """Lanes and pads.  InputError, one line, where the drones cannot be flown on it together."""

    def __init__(self, floors: Mapping[str, FloorStatus], stands: Mapping[str, str], cell: CellSize) -> None:
        first, *others = floors
        self._like = _without_own_pads(floors[first])
        for other in others:
            if not self.is_of(floors[other]):
                raise InputError(
                    f"{first} and {other} fly by different maps: {floors[first].name}, {floors[other].name}",
                    remedy="give both the same site file, but for their pads",
                )
        self.map = with_all_pads([*floors.values()])
        self.nodes = floors[first].nodes
        self.racks = floors[first].racks
        self.pads = {drone: own_pad(drone, floor, stands[drone]) for drone, floor in floors.items()}
        docks = {
            pad.id: OwnPad(node_of_pad(floors[first], pad), pad.x_m, pad.y_m, charges=True)
            for pad in _shared(floors[first])
        }
        _check_apart([*self.pads.items(), *docks.items()], cell)
        self.lanes = _lanes(floors[first], self.pads, docks)
        self.docks = tuple(
            Dock(name, self.lanes.index[f"{_DOCK}{name}"], DockKind.CONTACT, _CHARGES_S) for name in docks
        )
        """The pads that the drones share."""
        self._dock_at = {self.lanes.vertices[dock.place].node: dock.place for dock in self.docks}
        vertices = self.lanes.vertices
        self._lane_of = {
            frozenset((lane.a, lane.b)): number
            for number, lane in enumerate(self.lanes.lanes, start=len(vertices))
        }
        ways = {(lane.a, lane.b): lane.length_m for lane in self.lanes.lanes if lane.quarter != UPRIGHT}
        names = [vertex.name for vertex in vertices]
        arcs = [(names[a], names[b], metres) for (a, b), metres in ways.items()]
        # who comes home in need flies against one-way lines, too
        self._ways = Ways(names, [*arcs, *((b, a, metres) for a, b, metres in arcs)])

    @property
    def everywhere(self) -> frozenset[int]:
        """All the air there is."""
        return frozenset(range(len(self.lanes.boxes)))

    def is_of(self, floor: FloorStatus) -> bool:
        """Whether a drone's map is this floor, but for its own pads."""
        return _without_own_pads(floor) == self._like

    def objection(self, drone: str, floor: FloorStatus, stands_on: str | None) -> str:
        """Why a drone that flies by its map `floor`, and stands beside that node, is not flown on this one;
        empty where it is."""
        if not self.is_of(floor):
            return f"it flies by another map: {floor.name}"
        try:
            pad = own_pad(drone, floor, floor.home if stands_on is None else stands_on)
        except InputError as err:
            return str(err)
        return "" if pad == self.pads[drone] else f"it has another pad than before: at {pad.node}"

    def beside(self, floor: FloorStatus) -> tuple[int, float]:
        """The vertex over the node that is nearest to the pad which a map calls home, and how far that is."""
        homes = [pad for pad in floor.pads if node_of_pad(floor, pad) == floor.home]
        at = (homes[0].x_m, homes[0].y_m) if homes else (0.0, 0.0)
        nearest = self._nearest(at)
        return self.lanes.over(nearest.node), math.dist((nearest.x_m, nearest.y_m), at)

    def pad(self, drone: str) -> int:
        """The vertex on a drone's pad."""
        return self.lanes.index[f"{_TO_PAD}{drone}"]

    def dock_at(self, node: str | None) -> int | None:
        """The vertex on the shared pad of a node; None where there is none."""
        return self._dock_at.get(node or "")

    def stand(self, drone: str, node: str | None) -> int:
        """The vertex on which a drone stands that says so of this node: on a shared pad, else on its own."""
        return self._dock_at.get(node or "", self.pad(drone))

    def onto(self, pad: int) -> frozenset[int]:
        """The air from over a pad down onto it."""
        over = self.lanes.index[self.lanes.vertices[pad].node]
        return frozenset({pad, over, self._lane_of[frozenset((pad, over))]})

    def is_pad(self, drone: str, at: tuple[float, float]) -> bool:
        """Whether a drone is on its pad."""
        pad = self.pads[drone]
        return math.dist((pad.x_m, pad.y_m), at) <= 2 * _NEAR_M

    def node_at(self, at: tuple[float, float]) -> str | None:
        """The node over which a drone is, if it is over one."""
        nearest = self._nearest(at)
        return nearest.node if math.dist((nearest.x_m, nearest.y_m), at) <= _NEAR_M else None

    def nearest(self, at: tuple[float, float]) -> str:
        """The node that is nearest to a drone."""
        return self._nearest(at).node

    def around(self, at: tuple[float, float]) -> frozenset[int]:
        """The lanes on which a drone may be that is not over a node, not those that only end near it; all at
        its nearest node where it is on none."""
        if self.node_at(at) is not None:
            return frozenset()
        first, boxes = len(self.lanes.vertices), self.lanes.boxes
        number = range(first, first + len(self.lanes.lanes))
        near = frozenset(i for i in number if _apart_m(boxes[i], at) <= _NEAR_M)
        near = frozenset(i for i in near if self._leads_past(i, at)) or near
        over = self.lanes.over(self.nearest(at))
        return near or frozenset(arc.resource for arc in self.lanes.arcs[over])

    def _leads_past(self, lane: int, at: tuple[float, float]) -> bool:
        """Whether a place is further along a lane, from its nearer end, than it is beside it."""
        ends = self.lanes.lanes[lane - len(self.lanes.vertices)]
        a, b = self.lanes.vertices[ends.a], self.lanes.vertices[ends.b]
        dx, dy, x_m, y_m = b.x_m - a.x_m, b.y_m - a.y_m, at[0] - a.x_m, at[1] - a.y_m
        length_m = math.hypot(dx, dy)
        if not length_m:
            return False
        along_m, beside_m = (x_m * dx + y_m * dy) / length_m, abs(x_m * dy - y_m * dx) / length_m
        return min(along_m, length_m - along_m) >= beside_m

    def way(self, drone: str, nodes: Sequence[str]) -> frozenset[int]:
        """All the air of a way over these nodes and onto the drone's pad, by the shortest ways."""
        home = self.pads[drone].node
        known = [node for node in (*nodes, home) if node in self.lanes.index]
        passed: list[str] = []
        for start, end in itertools.pairwise(known):
            passed += self._ways.path(start, end) or (start, end)
        index = self.lanes.index
        over = [index[node] for node in (*known, *passed)]
        between = (frozenset(pair) for pair in itertools.pairwise(over))
        pad = self.pad(drone)
        found = {self._lane_of[pair] for pair in between if pair in self._lane_of}
        return frozenset({*over, *found, pad, self._lane_of[frozenset((pad, index[home]))]})

    def _nearest(self, at: tuple[float, float]) -> Vertex:
        over = (vertex for vertex in self.lanes.vertices if vertex.pad is None)
        return min(over, key=lambda vertex: math.dist((vertex.x_m, vertex.y_m), at))


def _apart_m(box: Box, at: tuple[float, float]) -> float:
    x_m, y_m = at
    return math.hypot(max(box.x0_m - x_m, x_m - box.x1_m, 0.0), max(box.y0_m - y_m, y_m - box.y1_m, 0.0))


def with_all_pads(floors: Sequence[FloorStatus]) -> FloorStatus:
    """The first map, with the pads of all that are the same but for own pads."""
    like = _without_own_pads(floors[0])
    pads = (pad for floor in floors if _without_own_pads(floor) == like for pad in floor.pads)
    return msgspec.structs.replace(floors[0], pads=tuple(dict.fromkeys(pads)))


def _without_own_pads(floor: FloorStatus) -> FloorStatus:
    return msgspec.structs.replace(floor, home="", pads=_shared(floor))


def _shared(floor: FloorStatus) -> tuple[FloorPad, ...]:
    return tuple(sorted((pad for pad in floor.pads if pad.shared), key=lambda pad: pad.id))


def _check_apart(pads: Sequence[tuple[str, OwnPad]], cell: CellSize) -> None:
    for (a, one), (b, two) in itertools.combinations(pads, 2):
        apart_m = math.dist((one.x_m, one.y_m), (two.x_m, two.y_m))
        if one.node == two.node or apart_m < cell.separation_m:
            raise InputError(
                f"the pads of {a} and {b} are {apart_m:.1f} m apart: {cell.separation_m:.1f} m are needed,"
                " and a node each"
            )


def _lanes(floor: FloorStatus, pads: Mapping[str, OwnPad], docks: Mapping[str, OwnPad]) -> LaneGraph:
    vertices = [Vertex(node.id, node.id, node.x_m, node.y_m, HEIGHT_M) for node in floor.nodes]
    index = {vertex.name: number for number, vertex in enumerate(vertices)}
    ways = open_ways(floor)
    lanes: list[Lane] = []
    for a, b in sorted(ways):
        both = (b, a) in ways
        if not both or a < b:
            lanes.append(_level(vertices, index[a], index[b], one_way=not both))
    own = ((f"{_TO_PAD}{drone}", drone, pad) for drone, pad in pads.items())
    shared = ((f"{_DOCK}{dock}", dock, pad) for dock, pad in docks.items())
    for name, of, pad in (*own, *shared):
        over = vertices[index[pad.node]]
        beside_m = math.dist((over.x_m, over.y_m), (pad.x_m, pad.y_m))
        lanes.append(Lane(index[pad.node], len(vertices), HEIGHT_M + beside_m, UPRIGHT))
        vertices.append(Vertex(name, pad.node, pad.x_m, pad.y_m, 0.0, of))
    return LaneGraph(vertices, lanes)


def _level(vertices: Sequence[Vertex], a: int, b: int, *, one_way: bool) -> Lane:
    dx, dy = vertices[b].x_m - vertices[a].x_m, vertices[b].y_m - vertices[a].y_m
    return Lane(a, b, math.hypot(dx, dy), round(math.atan2(dy, dx) / (math.pi / 2)) % 4, one_way)
