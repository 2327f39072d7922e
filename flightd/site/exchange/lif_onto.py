"""A site written onto the LIF file that it came from: what has changed since is changed there, and the rest
(other vehicle types, orientations, actions, trajectories, names) stays as it is."""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

from flightd.core.errors import InputError
from flightd.site.exchange.graph import Imported
from flightd.site.exchange.lif import lif_document, tables_of_lif
from flightd.site.exchange.lif_unheld import CHARGING, VEHICLE
from flightd.site.exchange.listed import listed
from flightd.site.site import Site
from flightd.site.site_tables import SiteTablesError, site_of

_Part = dict[str, Any]
_OF_TYPES: Final = ("vehicleTypeNodeProperties", "vehicleTypeEdgeProperties")
_KEYS: Final[Mapping[str, Callable[[_Part], Any]]] = {
    "nodes": lambda node: node["nodeId"],
    "edges": lambda edge: (edge["startNodeId"], edge["endNodeId"]),
    "stations": lambda station: station["stationId"],
}


def lif_onto(base: Any, site: Site, exported_at: str, vehicle: str = "") -> _Part:
    """The LIF `base` with the floor of `site`, which was made of it for `vehicle`.  InputError where `base`
    makes no sound site, or one that has no node of this one."""
    found = tables_of_lif(base, vehicle)
    try:
        was = site_of(found.tables)
    except SiteTablesError as err:
        raise InputError(f"makes no sound site: {err}", remedy="export without --onto") from None
    if not was.nodes.keys() & site.nodes.keys():
        raise InputError("has no node of this site", remedy="give the LIF that the site was imported from")
    taken = [name for name in site.nodes.keys() - was.nodes.keys() if name in found.names]
    if taken:
        raise InputError(f"has other nodes by the names of new ones: {listed(sorted(taken))}")
    before, now = (_in_words_of(found, lif_document(one, exported_at)["layouts"][0]) for one in (was, site))
    document: _Part = copy.deepcopy(base)
    layout: _Part = document["layouts"][0]
    for kind in _KEYS:
        _merge(layout, kind, before, now, vehicle)
    left = {node["nodeId"] for node in layout["nodes"]}
    gone = {node["nodeId"] for node in before["nodes"]} - {node["nodeId"] for node in now["nodes"]} - left
    for edge in [edge for edge in layout["edges"] if gone & {edge["startNodeId"], edge["endNodeId"]}]:
        layout["edges"].remove(edge)
    stranded = [
        station["stationId"]
        for station in layout.get("stations") or ()
        if gone & set(station["interactionNodeIds"])
    ]
    if stranded:
        raise InputError(f"has stations at nodes that the site lost: {listed(stranded)}")
    meta = document.get("metaInformation")
    document["metaInformation"] = {**(meta if isinstance(meta, dict) else {}), "exportTimestamp": exported_at}
    return document


def _in_words_of(found: Imported, layout: _Part) -> _Part:
    """Our own layout with the names and in the frame of the file that the site came from."""
    old = {new: name for name, new in found.names.items()}
    for node in layout["nodes"]:
        node["nodeId"] = old.get(node["nodeId"], node["nodeId"])
        _turn_back(node["nodePosition"], found.turned)
    for edge in layout["edges"]:
        for key in ("startNodeId", "endNodeId"):
            edge[key] = old.get(edge[key], edge[key])
        edge["edgeId"] = f"{edge['startNodeId']}-{edge['endNodeId']}"
    for station in layout["stations"]:
        station["interactionNodeIds"] = [old.get(node, node) for node in station["interactionNodeIds"]]
        _turn_back(station["stationPosition"], found.turned)
    return layout


def _turn_back(position: dict[str, float], turned: bool) -> None:
    if turned:
        # the import made x of the old y, both in frames with y to the left
        position["x"], position["y"] = 0.0 - position["y"], position["x"]


def _merge(layout: _Part, kind: str, before: _Part, now: _Part, vehicle: str) -> None:
    """Do to one kind of parts of the file what was done to it between the two layouts of ours, for one type
    of `vehicle` (empty: all)."""
    key = _KEYS[kind]
    was, new = ({key(part): part for part in one[kind]} for one in (before, now))
    there: list[_Part] = layout.setdefault(kind, []) if new.keys() - was.keys() else layout.get(kind) or []
    there[:] = [part for part in there if key(part) in new or key(part) not in was or _left(part, vehicle)]
    met: dict[Any, _Part] = {}
    for part in there:
        name = key(part)
        met.setdefault(name, part)
        if name in was and name in new and was[name] != new[name]:
            _change(part, was[name], new[name], vehicle)
    for name, part in new.items():
        if part != was.get(name):
            if name not in met:
                there.append(_for(vehicle, part))
            elif name not in was and vehicle:
                _join(met[name], _for(vehicle, part))


def _left(part: _Part, vehicle: str) -> bool:
    """Whether the part is still there for others when `vehicle` has left it."""
    for key in _OF_TYPES:
        others = [one for one in part.get(key) or () if one.get("vehicleTypeId") != vehicle]
        if vehicle and others:
            part[key] = others
            return True
    return False


def _join(part: _Part, ours: _Part) -> None:
    """Open a part that others have to our vehicles, too."""
    for key in _OF_TYPES:
        if key in ours:
            part[key] = [*(part.get(key) or ()), *ours[key]]


def _for(vehicle: str, part: _Part) -> _Part:
    told = copy.deepcopy(part)
    for key in _OF_TYPES:
        for one in told.get(key, ()):
            one["vehicleTypeId"] = vehicle or VEHICLE
    return told


def _change(part: _Part, was: _Part, new: _Part, vehicle: str) -> None:
    for key in new.keys() | was.keys():
        if was.get(key) == new.get(key):
            continue
        if key in _OF_TYPES:
            ours = new[key][0]
            for one in part.get(key) or ():
                if vehicle not in {"", one.get("vehicleTypeId")}:
                    continue
                if key == "vehicleTypeEdgeProperties":
                    _put(one, "maxHeight", ours.get("maxHeight"))
                else:
                    _put(one, "actions", _actions(one.get("actions") or (), ours.get("actions") or ()))
        elif isinstance(new.get(key), dict) and isinstance(part.get(key), dict):
            part[key].update(new[key])
        else:
            part[key] = new[key]


def _actions(there: Sequence[_Part], ours: Sequence[_Part]) -> list[_Part]:
    return [*(one for one in there if one.get("actionType") != CHARGING), *ours]


def _put(part: _Part, key: str, value: Any) -> None:
    if value:
        part[key] = value
    else:
        part.pop(key, None)
