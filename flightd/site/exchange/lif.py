"""VDMA LIF 1.0, the layout interchange format of vehicle fleets (VDA 5050): JSON of nodes, edges, stations.

Its frame is right-handed, y to the left of x seen from above; a site's y lies to the right.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any, Final

from flightd.core.errors import InputError
from flightd.site.exchange.graph import Graph, Imported, site_tables
from flightd.site.site import Site

_VEHICLE: Final = "flightd"
_CHARGING: Final = "startCharging"
_PAD: Final = "charging pad"


def lif_document(site: Site, exported_at: str) -> dict[str, Any]:
    """The site as LIF: every node, every way in the directions in which it is open, a station for each pad
    and each location.  `exported_at`: ISO 8601, UTC."""
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
                "vehicleTypeEdgeProperties": [{"vehicleTypeId": _VEHICLE, "rotationAllowed": True}],
            }
            for a, b in _open_ways(site)
        ],
        "stations": [*_pad_stations(site), *_location_stations(site)],
    }
    meta = {
        "projectIdentification": site.name,
        "creator": _VEHICLE,
        "exportTimestamp": exported_at,
        "lifVersion": "1.0.0",
    }
    return {"metaInformation": meta, "layouts": [layout]}


def _position(x_m: float, y_m: float) -> dict[str, float]:
    return {"x": round(x_m, 6), "y": round(0.0 - y_m, 6)}


def _node_properties(charges: bool) -> dict[str, Any]:
    action = {"actionType": _CHARGING, "blockingType": "HARD", "requirementType": "OPTIONAL"}
    return {"vehicleTypeId": _VEHICLE, **({"actions": [action]} if charges else {})}


def _open_ways(site: Site) -> Iterator[tuple[str, str]]:
    for edge in site.edges:
        if not site.is_closed(edge):
            yield edge.a, edge.b
            if not edge.one_way:
                yield edge.b, edge.a


def _pad_stations(site: Site) -> Iterator[dict[str, Any]]:
    for pad in site.pads:
        yield {
            "stationId": pad.id,
            "stationDescription": _PAD if pad.charge else "pad",
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


def tables_of_lif(document: Any) -> Imported:
    """The first layout of a LIF file as the tables of a site file.  InputError for what is none."""
    layouts = _list(_map(document, "the file"), "layouts", "the file")
    if not layouts:
        raise InputError("the file has no layout")
    layout = _map(layouts[0], "layouts[0]")
    nodes: dict[str, tuple[float, float]] = {}
    pads: dict[str, str] = {}
    for i, told in enumerate(_list(layout, "nodes", "layouts[0]")):
        node = _map(told, f"nodes[{i}]")
        name = _text(node, "nodeId", f"nodes[{i}]")
        if name in nodes:
            raise InputError(f"nodes[{i}]: nodeId {name!r} comes twice")
        position = _map(node.get("nodePosition"), f"nodes[{i}].nodePosition")
        nodes[name] = _number(position, "x", name), 0.0 - _number(position, "y", name)
        if _charges(node):
            pads[name] = f"pad-{name}"
    ways: list[tuple[str, str]] = []
    for i, told in enumerate(_list(layout, "edges", "layouts[0]")):
        edge = _map(told, f"edges[{i}]")
        ends = (
            _text(edge, "startNodeId", f"edges[{i}]"),
            _text(edge, "endNodeId", f"edges[{i}]"),
        )
        for node_id in ends:
            if node_id not in nodes:
                raise InputError(f"edges[{i}]: there is no node {node_id!r}")
        if ends[0] != ends[1]:
            ways.append(ends)
    others = _name_pads(layout, pads, nodes)
    title = layout.get("layoutName") or layout.get("layoutId")
    found = site_tables(Graph(title if isinstance(title, str) else "", nodes, ways, pads))
    notes = list(found.notes)
    if len(layouts) > 1:
        notes.append(f"the file has {len(layouts)} layouts; this is the first")
    if others:
        notes.append(f"{others} stations are no chargers: draw the racks that they belong to")
    return Imported(found.tables, tuple(notes))


def _charges(node: Mapping[str, Any]) -> bool:
    told = node.get("vehicleTypeNodeProperties")
    properties = [one for one in told if isinstance(one, dict)] if isinstance(told, list) else []
    actions = [one.get("actions") for one in properties]
    return any(
        isinstance(action, dict) and action.get("actionType") == _CHARGING
        for some in actions
        if isinstance(some, list)
        for action in some
    )


def _name_pads(layout: Mapping[str, Any], pads: dict[str, str], nodes: Mapping[str, Any]) -> int:
    """Give the pads of our own export their names; how many stations are something else."""
    others = 0
    for told in layout.get("stations") or ():
        station = _map(told, "stations")
        at = station.get("interactionNodeIds")
        node = at[0] if isinstance(at, list) and at and isinstance(at[0], str) else ""
        if node in nodes and station.get("stationDescription") in {_PAD, "pad"}:
            pads[node] = str(station.get("stationId", node))
        else:
            others += 1
    return others


def _map(told: Any, where: str) -> Mapping[str, Any]:
    if not isinstance(told, dict):
        raise InputError(f"{where} is no JSON object: this is no LIF")
    return told


def _list(told: Mapping[str, Any], key: str, where: str) -> list[Any]:
    value = told.get(key)
    if not isinstance(value, list):
        raise InputError(f"{where} has no list {key!r}: this is no LIF")
    return value


def _text(told: Mapping[str, Any], key: str, where: str) -> str:
    value = told.get(key)
    if not isinstance(value, str) or not value:
        raise InputError(f"{where} has no {key!r}")
    return value


def _number(told: Mapping[str, Any], key: str, where: str) -> float:
    value = told.get(key)
    if not isinstance(value, int | float) or isinstance(value, bool) or not math.isfinite(value):
        raise InputError(f"node {where!r}: {key} is no number")
    if abs(value) > 10_000:
        raise InputError(f"node {where!r}: {key} is {value:g} m; at most 10,000 m from the origin")
    return float(value)
