"""VDMA LIF 1.0 as it is written: its objects with their types, and what is wrong with a file that is none.

What the format requires and a floor does not need may be missing; what is there has to be of its type.
"""

from __future__ import annotations

import math
import re
from typing import Any, Final, Literal

import msgspec

from flightd.core.errors import InputError

MAX_FROM_ORIGIN_M: Final = 10_000.0
_PATH: Final = re.compile(r" - at `\$\.?(?P<path>.*)`$")
_MISSING: Final = re.compile(r"Object missing required field `(?P<key>\w+)`")
_EXPECTED: Final = re.compile(r"Expected `(?P<kind>\w+)")
_CHOICE: Final = re.compile(r"Invalid enum value (?P<value>.+)")
_KINDS: Final = {
    "object": "is no JSON object: this is no LIF",
    "array": "is no list: this is no LIF",
    "str": "is no text",
    "float": "is no number",
    "bool": "is neither true nor false",
}
_LISTS: Final = {"layouts", "nodes", "edges"}
_REMEDY: Final = "mend it in the program that wrote it"

Rotation = Literal["NONE", "CCW", "CW", "BOTH"]
_CHOICES: Final = {
    "orientationType": "GLOBAL, TANGENTIAL",
    "rotationAtStartNodeAllowed": "NONE, CCW, CW, BOTH",
    "rotationAtEndNodeAllowed": "NONE, CCW, CW, BOTH",
    "requirementType": "REQUIRED, CONDITIONAL, OPTIONAL",
    "blockingType": "NONE, SOFT, HARD",
}


class _Part(msgspec.Struct, frozen=True, rename="camel"):
    pass


class Meta(_Part, frozen=True):
    """Whose file it is.  `export_timestamp`: ISO 8601, UTC."""

    project_identification: str | None = None
    creator: str | None = None
    export_timestamp: str | None = None
    lif_version: str | None = None


class ActionParameter(_Part, frozen=True):
    """A value that goes with an action."""

    key: str | None = None
    value: str | None = None


class Action(_Part, frozen=True):
    """What a vehicle can do on a node or an edge, in the words of VDA 5050."""

    action_type: str | None = None
    action_description: str | None = None
    requirement_type: Literal["REQUIRED", "CONDITIONAL", "OPTIONAL"] | None = None
    blocking_type: Literal["NONE", "SOFT", "HARD"] | None = None
    action_parameters: list[ActionParameter] | None = None


class NodeVehicle(_Part, frozen=True):
    """What a node is for one type of vehicle.  `theta` in radians."""

    vehicle_type_id: str | None = None
    theta: float | None = None
    actions: list[Action] | None = None


class Position(_Part, frozen=True):
    """Metres from the origin of the project, y to the left of x seen from above; `theta` in radians."""

    x: float
    y: float
    theta: float | None = None


class Node(_Part, frozen=True):
    """Where vehicles may stop."""

    node_id: str
    node_position: Position
    node_name: str | None = None
    node_description: str | None = None
    map_id: str | None = None
    vehicle_type_node_properties: list[NodeVehicle] | None = None


class LoadRestriction(_Part, frozen=True):
    """With which loads an edge may be used."""

    unloaded: bool | None = None
    loaded: bool | None = None
    load_set_names: list[str] | None = None


class ControlPoint(_Part, frozen=True):
    """Of a trajectory."""

    x: float
    y: float
    weight: float | None = None


class Trajectory(_Part, frozen=True):
    """An edge as a NURBS."""

    knot_vector: list[float] | None = None
    control_points: list[ControlPoint] | None = None
    degree: float | None = None


class EdgeVehicle(_Part, frozen=True):
    """What an edge is for one type of vehicle: metres, seconds, radians."""

    vehicle_type_id: str | None = None
    rotation_allowed: bool | None = None
    vehicle_orientation: float | None = None
    orientation_type: Literal["GLOBAL", "TANGENTIAL"] | None = None
    rotation_at_start_node_allowed: Rotation | None = None
    rotation_at_end_node_allowed: Rotation | None = None
    max_speed: float | None = None
    max_rotation_speed: float | None = None
    min_height: float | None = None
    max_height: float | None = None
    load_restriction: LoadRestriction | None = None
    actions: list[Action] | None = None
    trajectory: Trajectory | None = None
    reentry_allowed: bool | None = None


class Edge(_Part, frozen=True):
    """A way in one direction."""

    start_node_id: str
    end_node_id: str
    edge_id: str | None = None
    edge_name: str | None = None
    edge_description: str | None = None
    vehicle_type_edge_properties: list[EdgeVehicle] | None = None


class Station(_Part, frozen=True):
    """Where vehicles meet the rest of the world.  `station_height` in metres."""

    station_id: str
    interaction_node_ids: list[str]
    station_name: str | None = None
    station_description: str | None = None
    station_height: float | None = None
    station_position: Position | None = None


class Layout(_Part, frozen=True):
    """One level of a building, or a part of it."""

    nodes: list[Node]
    edges: list[Edge]
    layout_id: str | None = None
    layout_name: str | None = None
    layout_version: str | None = None
    layout_level_id: str | None = None
    layout_description: str | None = None
    stations: list[Station] | None = None


class Lif(_Part, frozen=True):
    """A whole file."""

    layouts: list[Layout]
    meta_information: Meta | None = None


def lif_of(document: Any) -> Lif:
    """What the JSON of a file says.  InputError naming the key that is missing or of another type."""
    try:
        told = msgspec.convert(
            document, Lif, strict=False
        )  # the standard's own examples have numbers in quotes
    except (msgspec.ValidationError, OverflowError) as err:
        raise _refusal(str(err)) from None
    if not told.layouts:
        raise InputError("the file has no layout")
    for i, layout in enumerate(told.layouts):
        _check_places(layout, f"layouts[{i}]")
    return told


def _check_places(layout: Layout, where: str) -> None:
    for i, node in enumerate(layout.nodes):
        _check_near(node.node_position, f"{where}.nodes[{i}].nodePosition")
    for i, station in enumerate(layout.stations or ()):
        if station.station_position is not None:
            _check_near(station.station_position, f"{where}.stations[{i}].stationPosition")
        _check_metres(station.station_height or 0.0, f"{where}.stations[{i}].stationHeight")
    for i, edge in enumerate(layout.edges):
        for k, told in enumerate(edge.vehicle_type_edge_properties or ()):
            key = f"{where}.edges[{i}].vehicleTypeEdgeProperties[{k}].maxHeight"
            _check_metres(told.max_height or 0.0, key)


def _check_near(position: Position, where: str) -> None:
    _check_metres(position.x, f"{where}.x")
    _check_metres(position.y, f"{where}.y")


def _check_metres(value: float, where: str) -> None:
    if not math.isfinite(value):
        raise InputError(f"{where} is no number", remedy=_REMEDY)
    if abs(value) > MAX_FROM_ORIGIN_M:
        raise InputError(f"{where} is {value:g} m; at most 10,000 m from the origin")


def _refusal(told: str) -> InputError:
    at = _PATH.search(told)
    where = at["path"] if at is not None else ""
    if missing := _MISSING.match(told):
        key, what = missing["key"], where or "the file"
        if key in _LISTS:
            return InputError(f"{what} has no list {key!r}: this is no LIF")
        return InputError(f"{what} has no {key!r}", remedy=_REMEDY)
    where = where or "the file"
    if choice := _CHOICE.match(told):
        value = choice["value"].partition(" - at ")[0]
        known = _CHOICES.get(where.rpartition(".")[2], "")
        return InputError(f"{where}: LIF does not know {value}", remedy=f"one of {known}")
    expected = _EXPECTED.match(told)
    kind = _KINDS.get(expected["kind"] if expected else "", "is no number")
    return InputError(f"{where} {kind}", remedy=_REMEDY)
