"""VDMA LIF 1.0, the layout interchange format of vehicle fleets (VDA 5050): JSON of nodes, edges, stations.

Its frame is right-handed, y to the left of x seen from above; a site's y lies to the right.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

from flightd.core.errors import InputError
from flightd.site.exchange.graph import Graph, Imported, PadAt, site_tables
from flightd.site.exchange.lif_file import Edge, Layout, Node, Position, Station, lif_of
from flightd.site.exchange.lif_unheld import CHARGING, PAD, PAD_WITHOUT_CHARGER, VEHICLE, unheld
from flightd.site.exchange.listed import listed
from flightd.site.exchange.low_ways import open_below_m
from flightd.site.exchange.places import PlaceAt
from flightd.site.site import Site

_PADS: Final = frozenset({PAD, PAD_WITHOUT_CHARGER})
_PAD_OFFSET_M: Final = 0.5


def lif_document(site: Site, exported_at: str) -> dict[str, Any]:
    """The site as LIF: every node, every way in the directions in which it is open and below which height, a
    station for each pad and each location.  `exported_at`: ISO 8601, UTC."""
    charged = {pad.node for pad in site.pads if pad.charge}
    layout = {
        "layoutId": site.name,
        "layoutName": site.name,
        "layoutVersion": "1",
        "nodes": [
            {
                "nodeId": node.id,
                "mapId": site.name,
                "nodePosition": _position(node.x_m, node.y_m),
                "vehicleTypeNodeProperties": [_node_properties(node.id in charged)],
            }
            for node in site.nodes.values()
        ],
        "edges": [
            {
                "edgeId": f"{a}-{b}",
                "startNodeId": a,
                "endNodeId": b,
                "vehicleTypeEdgeProperties": [_edge_properties(below_m)],
            }
            for a, b, below_m in _open_ways(site)
        ],
        "stations": [*_pad_stations(site), *_location_stations(site)],
    }
    meta = {
        "projectIdentification": site.name,
        "creator": VEHICLE,
        "exportTimestamp": exported_at,
        "lifVersion": "1.0.0",
    }
    return {"metaInformation": meta, "layouts": [layout]}


def _position(x_m: float, y_m: float) -> dict[str, float]:
    return {"x": round(x_m, 6), "y": round(0.0 - y_m, 6)}


def _node_properties(charges: bool) -> dict[str, Any]:
    action = {"actionType": CHARGING, "blockingType": "HARD", "requirementType": "OPTIONAL"}
    return {"vehicleTypeId": VEHICLE, **({"actions": [action]} if charges else {})}


def _edge_properties(below_m: float) -> dict[str, Any]:
    height = {"maxHeight": below_m} if math.isfinite(below_m) else {}
    return {"vehicleTypeId": VEHICLE, "rotationAllowed": True, **height}


def _open_ways(site: Site) -> Iterator[tuple[str, str, float]]:
    for edge in site.edges:
        below_m = open_below_m(site, edge)
        if below_m is not None:
            yield edge.a, edge.b, below_m
            if not edge.one_way:
                yield edge.b, edge.a, below_m


def _pad_stations(site: Site) -> Iterator[dict[str, Any]]:
    for pad in site.pads:
        yield {
            "stationId": pad.id,
            "stationDescription": PAD if pad.charge else PAD_WITHOUT_CHARGER,
            "interactionNodeIds": [pad.node],
            "stationPosition": _position(*site.pad_centre(pad)),
        }


def _location_stations(site: Site) -> Iterator[dict[str, Any]]:
    for place in site.locations.values():
        yield {
            "stationId": place.code,
            "interactionNodeIds": [place.node],
            "stationHeight": round(place.height_m, 6),
            "stationPosition": _position(place.x_m, place.y_m),
        }


def tables_of_lif(document: Any, vehicle: str = "") -> Imported:
    """The first layout of a LIF file as the tables of a site file: all its ways, or those of one type of
    `vehicle`.  InputError for what is none."""
    told = lif_of(document)
    layout = told.layouts[0]
    types = _vehicle_types(layout)
    if vehicle and vehicle not in types:
        known = ", ".join(types) or "none"
        raise InputError(f"no vehicle type is called {vehicle!r}", remedy=f"the file has {known}")
    notes = unheld(document["layouts"][0], layout)
    nodes = _nodes(layout, vehicle)
    ways, below_m = _ways(told.layouts, nodes, vehicle, notes)
    pads, places = _stations(layout, nodes, notes)
    title = layout.layout_name or layout.layout_id or ""
    found = site_tables(Graph(title, nodes, ways, pads, below_m, places))
    if len(told.layouts) > 1:
        notes.append(f"the file has {len(told.layouts)} layouts; this is the first")
    if len(types) > 1 and not vehicle:
        notes.append(f"the ways of all vehicle types are taken: {', '.join(types)}")
    return replace(found, notes=(*found.notes, *notes))


def _vehicle_types(layout: Layout) -> list[str]:
    told = [
        *(one.vehicle_type_id for node in layout.nodes for one in node.vehicle_type_node_properties or ()),
        *(one.vehicle_type_id for edge in layout.edges for one in edge.vehicle_type_edge_properties or ()),
    ]
    return [name for name in dict.fromkeys(told) if name]


def _nodes(layout: Layout, vehicle: str) -> dict[str, tuple[float, float]]:
    nodes: dict[str, tuple[float, float]] = {}
    for i, node in enumerate(layout.nodes):
        if not node.node_id:
            raise InputError(f"layouts[0].nodes[{i}] has no 'nodeId'")
        if node.node_id in nodes:
            raise InputError(f"layouts[0].nodes[{i}].nodeId: {node.node_id!r} comes twice")
        nodes[node.node_id] = _place(node.node_position)
    return {node.node_id: nodes[node.node_id] for node in layout.nodes if _is_for(node, vehicle)}


def _is_for(part: Node | Edge, vehicle: str) -> bool:
    """Whether vehicles of the type may be there; where nothing is told, all may."""
    told = part.vehicle_type_node_properties if isinstance(part, Node) else part.vehicle_type_edge_properties
    return not vehicle or not told or any(one.vehicle_type_id == vehicle for one in told)


def _place(position: Position) -> tuple[float, float]:
    return position.x, 0.0 - position.y


def _ways(
    layouts: Sequence[Layout], nodes: Mapping[str, tuple[float, float]], vehicle: str, notes: list[str]
) -> tuple[list[tuple[str, str]], dict[tuple[str, str], float]]:
    """Each way, and below which height it is open where that is told."""
    here = {node.node_id for node in layouts[0].nodes}
    elsewhere = {node.node_id for layout in layouts[1:] for node in layout.nodes}
    ways: list[tuple[str, str]] = []
    below_m: dict[tuple[str, str], float] = {}
    away: list[tuple[str, str]] = []
    for i, edge in enumerate(layouts[0].edges):
        way = edge.start_node_id, edge.end_node_id
        for end, node in zip(("start", "end"), way, strict=True):
            if node not in here | elsewhere:
                raise InputError(f"layouts[0].edges[{i}].{end}NodeId: there is no node {node!r}")
        if way[0] not in here or way[1] not in here:
            away.append(way)
        elif _is_for(edge, vehicle) and way[0] in nodes and way[1] in nodes and way[0] != way[1]:
            ways.append(way)
            told = [
                one.max_height
                for one in edge.vehicle_type_edge_properties or ()
                if one.max_height is not None and vehicle in {"", one.vehicle_type_id}
            ]
            if told:
                below_m[way] = min(told)
    if away:
        notes.append(f"ways to other layouts, left out: {listed([f'{a} to {b}' for a, b in away])}")
    return ways, below_m


def _stations(
    layout: Layout, nodes: Mapping[str, tuple[float, float]], notes: list[str]
) -> tuple[dict[str, PadAt], list[PlaceAt]]:
    """The pads, in the order of their stations, and the places for goods."""
    charging = [node.node_id for node in layout.nodes if node.node_id in nodes and _charges(node)]
    met = [
        (station, next((node for node in station.interaction_node_ids if node in nodes), None))
        for station in layout.stations or ()
    ]
    own = {node for station, node in met if station.station_description in _PADS}
    pads: dict[str, PadAt] = {}
    places: list[PlaceAt] = []
    bare: list[str] = []
    for station, node in met:
        if node is None:
            bare.append(station.station_id)
            continue
        # a charger is the first thing on the floor at a node where vehicles charge
        charger = node in charging and node not in own and not station.station_height
        if node not in pads and (charger or station.station_description in _PADS):
            pads[node] = _pad(station, node, nodes, node in charging)
        elif station.station_position is None or station.station_height is None:
            bare.append(station.station_id)
        else:
            x_m, y_m = _place(station.station_position)
            places.append(PlaceAt(station.station_id, node, x_m, y_m, station.station_height))
    for node in charging:
        pads.setdefault(node, PadAt(f"pad-{node}"))
    if bare:
        notes.append(f"stations without node, height or position, left out: {listed(bare)}")
    return pads, places


def _pad(station: Station, node: str, nodes: Mapping[str, tuple[float, float]], charges: bool) -> PadAt:
    """Its station, off the node only where flightd wrote it so: others have the charger's place there."""
    pad = PadAt(station.station_id or f"pad-{node}", charges or station.station_description == PAD)
    if station.station_position is None or station.station_description not in _PADS:
        return pad
    (x_m, y_m), (node_x_m, node_y_m) = _place(station.station_position), nodes[node]
    offset_m = round(x_m - node_x_m, 6) + 0.0, round(y_m - node_y_m, 6) + 0.0
    return replace(pad, offset_m=offset_m) if max(map(abs, offset_m)) <= _PAD_OFFSET_M else pad


def _charges(node: Node) -> bool:
    return any(
        action.action_type == CHARGING
        for one in node.vehicle_type_node_properties or ()
        for action in one.actions or ()
    )
