"""Lays a site out from its aisles: nodes, edges, strokes of paint and shelf fronts, all checked.

A cross joins two aisles at right angles and is painted through; every other node has only its own short
cross line.  Shelves stop short of the crosses, so that a drone can change aisles between them.
"""

from __future__ import annotations

import itertools
from collections.abc import Collection, Iterable, Sequence

from flightd.site.closures import mistakes
from flightd.site.racks import RackError, place_locations
from flightd.site.site import (
    ASSUMED_CEILING_M,
    Aisle,
    Edge,
    LineColour,
    Marker,
    Node,
    Pad,
    PaintedLine,
    Rack,
    Shelf,
    Side,
    Site,
)
from flightd.site.ways import KeepOut, OneWay

SAME_X_M = 0.01
"""Strokes across the aisles this close in x are one line."""
CROSS_CLEARANCE_M = 0.6
"""Free way between the centre of a cross and the nearest shelf."""
MIN_SHELF_M = 0.8
"""Leftovers beside a cross too short for one pallet get no shelf."""


class LayoutError(ValueError):
    """The parts do not make a floor; `key` is where, in the words of the site file."""

    def __init__(self, key: str, problem: str) -> None:
        super().__init__(f"{key}: {problem}")
        self.key = key
        self.problem = problem


def lay_out(
    name: str,
    aisles: Sequence[Aisle],
    crosses: Iterable[tuple[str, str]],
    pads: Iterable[Pad],
    *,
    line_width_m: float = 0.075,
    line_colour: str = LineColour.YELLOW,
    ceiling_m: float | None = None,
    interlock: bool = False,
    unattended_start: bool = False,
    racks: Sequence[Rack] = (),
    one_way_crosses: Collection[tuple[str, str]] = (),
    blocked: Sequence[tuple[str, str]] = (),
    keep_outs: Sequence[KeepOut] = (),
    markers: Sequence[Marker] = (),
) -> Site:
    """Make the site, or raise LayoutError naming the part that does not fit.

    `crosses` are pairs of node ids at equal x in neighbouring aisles, in any order; those that are also
    `one_way_crosses` are flown from the first to the second only.  Without a `ceiling_m` nothing may be flown
    above 2 m."""
    _check_aisles(aisles, line_width_m, ceiling_m)
    nodes = {node.id: node for aisle in aisles for node in _nodes(aisle)}
    cross_edges = _crosses(tuple(crosses), aisles, nodes, one_way_crosses)
    edges = (*(edge for aisle in aisles for edge in _along(aisle)), *cross_edges)
    _check_connected(nodes, edges)
    lines = (*_aisle_strokes(aisles, line_width_m), *_cross_strokes(aisles, nodes, cross_edges, line_width_m))
    shelves = tuple(shelf for aisle in aisles for shelf in _shelves(aisle, nodes, cross_edges))
    try:
        locations = place_locations(racks, shelves, nodes.values())
    except RackError as err:
        key, _, problem = str(err).partition(": ")
        raise LayoutError(key, problem) from None
    site = Site(
        name=name,
        aisles=tuple(aisles),
        crosses=cross_edges,
        nodes=nodes,
        edges=edges,
        lines=lines,
        pads=_check_pads(tuple(pads), nodes),
        shelves=shelves,
        line_width_m=line_width_m,
        line_colour=line_colour,
        ceiling_m=ASSUMED_CEILING_M if ceiling_m is None else ceiling_m,
        ceiling_given=ceiling_m is not None,
        interlock=interlock,
        unattended_start=unattended_start,
        racks=tuple(racks),
        locations=locations,
        blocked=tuple(blocked),
        keep_outs=tuple(keep_outs),
        markers=tuple(markers),
    )
    for key, problem in mistakes(site):
        raise LayoutError(key, problem)
    return site


def _along(aisle: Aisle) -> list[Edge]:
    """The aisle's edges, each in the direction in which it is flown."""
    pairs = itertools.pairwise(f"{aisle.id}{i}" for i in range(1, aisle.size + 1))
    back = aisle.one_way is OneWay.MINUS_X
    return [Edge(b, a, True) if back else Edge(a, b, aisle.one_way is not None) for a, b in pairs]


def _nodes(aisle: Aisle) -> list[Node]:
    x_m = aisle.x_m
    nodes = [Node(f"{aisle.id}1", x_m, aisle.y_m, aisle.id, 1)]
    for index, step_m in enumerate(aisle.spacing_m, start=2):
        x_m += step_m
        nodes.append(Node(f"{aisle.id}{index}", x_m, aisle.y_m, aisle.id, index))
    return nodes


def _check_aisles(aisles: Sequence[Aisle], width_m: float, ceiling_m: float | None) -> None:
    if not aisles:
        raise LayoutError("aisle", "there is none; a site needs at least one [[aisle]]")
    seen: set[str] = set()
    for i, aisle in enumerate(aisles):
        key = f"aisle[{i}] ({aisle.id})"
        if aisle.id in seen:
            raise LayoutError(f"{key}.id", f"{aisle.id} is taken by an earlier aisle; name it otherwise")
        seen.add(aisle.id)
        if not aisle.spacing_m:
            raise LayoutError(f"{key}.spacing_m", "is empty; give at least one distance to a second node")
        tightest = 4 * width_m
        if min(aisle.spacing_m) < tightest:
            problem = (
                f"{min(aisle.spacing_m)} m is too close; keep nodes {tightest:.2f} m (4 line widths) apart"
            )
            raise LayoutError(f"{key}.spacing_m", problem)
        if aisle.cross_half_m <= width_m:
            problem = f"{aisle.cross_half_m} m does not show beside the line; make it > {width_m} m"
            raise LayoutError(f"{key}.cross_half_m", problem)
        if aisle.shelves and aisle.shelf_distance_m <= aisle.cross_half_m:
            problem = (
                f"{aisle.shelf_distance_m} m: the cross lines reach {aisle.cross_half_m} m, into the shelf"
            )
            raise LayoutError(f"{key}.shelf_distance_m", problem)
        if aisle.shelves and ceiling_m is not None and aisle.shelf_height_m > ceiling_m:
            problem = f"{aisle.shelf_height_m} m is above the ceiling ({ceiling_m} m)"
            raise LayoutError(f"{key}.shelf_height_m", problem)
    for i, a in enumerate(aisles):
        for b in aisles[i + 1 :]:
            _check_apart(a, b, width_m)


def _check_apart(a: Aisle, b: Aisle, width_m: float) -> None:
    if a.end_x_m + a.overrun_m < b.x_m - b.overrun_m or b.end_x_m + b.overrun_m < a.x_m - a.overrun_m:
        return
    left, right = (a, b) if a.y_m <= b.y_m else (b, a)
    gap_m = right.y_m - left.y_m
    need_m = left.cross_half_m + right.cross_half_m + 2 * width_m
    if gap_m < need_m:
        problem = (
            f"aisles {left.id} and {right.id} are {gap_m:g} m apart, their cross lines need {need_m:.2f} m"
        )
        raise LayoutError(f"aisle ({b.id}).y_m", problem)
    if Side.RIGHT in left.shelves and Side.LEFT in right.shelves:
        need_m = left.shelf_distance_m + right.shelf_distance_m
        if gap_m < need_m:
            problem = (
                f"aisles {left.id} and {right.id} are {gap_m:g} m apart, their shelves need {need_m:g} m"
            )
            raise LayoutError(f"aisle ({b.id}).y_m", problem)


def _crosses(
    pairs: Sequence[tuple[str, str]],
    aisles: Sequence[Aisle],
    nodes: dict[str, Node],
    one_way: Collection[tuple[str, str]],
) -> tuple[Edge, ...]:
    found: list[Edge] = []
    for i, pair in enumerate(pairs):
        key = f"cross[{i}].nodes"
        for node in pair:
            if node not in nodes:
                raise LayoutError(key, f"there is no node {node}; nodes are called aisle + number, as in A1")
        a, b = sorted((nodes[node] for node in pair), key=lambda node: node.y_m)
        if a.aisle == b.aisle:
            raise LayoutError(key, f"{a.id} and {b.id} are in one aisle; a cross joins two aisles")
        if abs(a.x_m - b.x_m) > SAME_X_M:
            problem = (
                f"{a.id} (x {a.x_m:g} m) and {b.id} (x {b.x_m:g} m) differ in x, "
                "the cross would not be square to the aisles"
            )
            raise LayoutError(key, problem)
        for other in aisles:
            inside = other.x_m - other.overrun_m <= a.x_m <= other.end_x_m + other.overrun_m
            if other.id not in {a.aisle, b.aisle} and a.y_m < other.y_m < b.y_m and inside:
                problem = (
                    f"{a.id} to {b.id} runs over aisle {other.id}; write one cross to it and one from it"
                )
                raise LayoutError(key, problem)
        edge = Edge(*pair, True) if pair in one_way else Edge(a.id, b.id)
        if any({edge.a, edge.b} == {other.a, other.b} for other in found):
            raise LayoutError(key, f"{a.id} and {b.id} are already joined by an earlier cross")
        found.append(edge)
    return tuple(found)


def _check_connected(nodes: dict[str, Node], edges: Sequence[Edge]) -> None:
    beside: dict[str, list[str]] = {node: [] for node in nodes}
    for edge in edges:
        beside[edge.a].append(edge.b)
        beside[edge.b].append(edge.a)
    reached = {next(iter(nodes))}
    pending = list(reached)
    while pending:
        fresh = set(beside[pending.pop()]) - reached
        reached |= fresh
        pending += fresh
    cut_off = [node for node in nodes if node not in reached]
    if cut_off:
        aisle = nodes[cut_off[0]].aisle
        raise LayoutError(
            "cross", f"aisle {aisle} cannot be reached from {next(iter(nodes))}; add a [[cross]] to it"
        )


def _check_pads(pads: tuple[Pad, ...], nodes: dict[str, Node]) -> tuple[Pad, ...]:
    if not any(pad.start for pad in pads):
        raise LayoutError("pad", 'there is none to start from; add [[pad]] id = "home", node = "A1"')
    if not any(pad.charge for pad in pads):
        raise LayoutError("pad", "there is none to charge on; set charge = true for one")
    for i, pad in enumerate(pads):
        if pad.node not in nodes:
            raise LayoutError(f"pad[{i}] ({pad.id}).node", f"there is no node {pad.node}")
        if any(pad.id == other.id or pad.node == other.node for other in pads[:i]):
            raise LayoutError(f"pad[{i}] ({pad.id})", "its id or node is taken by an earlier pad")
        if pad.shared and (pad.start or not pad.charge):
            raise LayoutError(f"pad[{i}] ({pad.id}).shared", "needs charge = true, start = false")
    return pads


def _aisle_strokes(aisles: Iterable[Aisle], width_m: float) -> list[PaintedLine]:
    # half a width more at each end: an aisle without overrun ends in a full corner or tee
    return [
        PaintedLine(
            aisle.x_m - max(aisle.overrun_m, width_m / 2),
            aisle.y_m,
            aisle.end_x_m + max(aisle.overrun_m, width_m / 2),
            aisle.y_m,
            width_m,
        )
        for aisle in aisles
    ]


def _cross_strokes(
    aisles: Iterable[Aisle], nodes: dict[str, Node], crosses: Iterable[Edge], width_m: float
) -> list[PaintedLine]:
    """One stroke for each unbroken line across the aisles: own cross lines and crosses merged."""
    reach = {aisle.id: aisle.cross_half_m for aisle in aisles}
    pieces = [
        (node.x_m, node.y_m - reach[node.aisle], node.y_m + reach[node.aisle]) for node in nodes.values()
    ]
    for edge in crosses:
        ends = sorted((nodes[edge.a].y_m, nodes[edge.b].y_m))
        pieces.append((nodes[edge.a].x_m, ends[0], ends[1]))
    pieces.sort()
    merged: list[list[float]] = []
    for x_m, y0_m, y1_m in pieces:
        joined = [m for m in merged if abs(m[0] - x_m) <= SAME_X_M and m[1] <= y1_m and y0_m <= m[2]]
        merged = [m for m in merged if m not in joined]
        y0_m, y1_m = min([y0_m, *(m[1] for m in joined)]), max([y1_m, *(m[2] for m in joined)])  # noqa: PLW2901
        merged.append([joined[0][0] if joined else x_m, y0_m, y1_m])
    return [PaintedLine(x_m, y0_m, x_m, y1_m, width_m) for x_m, y0_m, y1_m in merged]


def _shelves(aisle: Aisle, nodes: dict[str, Node], crosses: Iterable[Edge]) -> list[Shelf]:
    """Fronts along the aisle, half a spacing past its end nodes, interrupted at the crosses."""
    fronts = []
    for side in aisle.shelves:
        sign = -1.0 if side is Side.LEFT else 1.0
        ways = [
            nodes[here].x_m
            for edge in crosses
            for here, there in ((edge.a, edge.b), (edge.b, edge.a))
            if nodes[here].aisle == aisle.id and (nodes[there].y_m - aisle.y_m) * sign > 0
        ]
        start_m, end_m = aisle.x_m - aisle.spacing_m[0] / 2, aisle.end_x_m + aisle.spacing_m[-1] / 2
        stops = [start_m - CROSS_CLEARANCE_M, *sorted(ways), end_m + CROSS_CLEARANCE_M]
        for left, right in itertools.pairwise(stops):
            x0_m, x1_m = left + CROSS_CLEARANCE_M, right - CROSS_CLEARANCE_M
            if x1_m - x0_m >= MIN_SHELF_M:
                y_m = aisle.y_m + sign * aisle.shelf_distance_m
                fronts.append(Shelf(aisle.id, side, x0_m, x1_m, y_m, aisle.shelf_height_m))
    return fronts
