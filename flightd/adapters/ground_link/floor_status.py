"""A site as the ground link tells it: what a client draws of the warehouse."""

from __future__ import annotations

from flightd.adapters.ground_link.messages.base import finite
from flightd.adapters.ground_link.messages.floor import (
    FloorArea,
    FloorLine,
    FloorNode,
    FloorPad,
    FloorRack,
    FloorStatus,
    FloorWay,
)
from flightd.site.racks import bay_edges
from flightd.site.site import Node, Shelf, Side, Site


def floor_status(site: Site) -> FloorStatus:
    """The map as it goes over the link."""
    levels: dict[tuple[str, Side], set[int]] = {}
    for location in site.locations.values():
        levels.setdefault((location.node, location.side), set()).add(location.level)
    return FloorStatus(
        name=site.name,
        home=site.home.node,
        nodes=tuple(
            _node(node, *(levels.get((node.id, side), set()) for side in (Side.LEFT, Side.RIGHT)))
            for node in site.nodes.values()
        ),
        lines=tuple(FloorLine(line.x0_m, line.y0_m, line.x1_m, line.y1_m) for line in site.lines),
        line_width_m=site.line_width_m,
        line_colour=site.line_colour,
        racks=tuple(
            FloorRack(
                shelf.aisle,
                shelf.side.value,
                shelf.x0_m,
                shelf.x1_m,
                shelf.y_m,
                shelf.height_m,
                _bays(site, shelf),
            )
            for shelf in site.shelves
        ),
        keep_outs=tuple(
            FloorArea(area.x0_m, area.y0_m, area.x1_m, area.y1_m, area.from_m, finite(area.to_m))
            for area in site.keep_outs
        ),
        pads=tuple(
            FloorPad(pad.id, *site.pad_centre(pad), pad.size_m, pad.charge, pad.shared) for pad in site.pads
        ),
        ways=tuple(
            FloorWay(edge.a, edge.b, site.is_closed(edge))
            for edge in site.edges
            if edge.one_way or site.is_closed(edge)
        ),
        unattended_start=site.unattended_start,
    )


def _node(node: Node, left: set[int], right: set[int]) -> FloorNode:
    both = (tuple(sorted(levels)) for levels in (left | right, left, right))
    return FloorNode(node.id, node.x_m, node.y_m, node.aisle, *both)


def _bays(site: Site, front: Shelf) -> tuple[float, ...]:
    for rack in site.racks:
        if front.aisle in rack.aisles and front.side in rack.sides:
            return bay_edges(rack, front)
    return ()
