"""How messages look in the log: JSON, with JSON schemas that Foxglove and other MCAP tools read.

Events are `foxglove.Log`, pictures `foxglove.CompressedImage`, line sets and poses are our fields and
those of the Foxglove schema that fits; the warehouse, the cameras and where the drone's frame is are
Foxglove's fields alone; the rest are the fields of the dataclasses by name.  A float
that is not a number is written as null, a reason as its words.
"""

from __future__ import annotations

import dataclasses
from functools import partial

import msgspec
import numpy as np

from flightd.adapters.foxglove import schemas as foxglove
from flightd.adapters.foxglove.frames import time_of
from flightd.adapters.foxglove.schemas import JsonObject, WellKnown, json_schema
from flightd.core.refusal import Refusal, words
from flightd.core.tick import TickInput
from flightd.core.topics import DronePlace
from flightd.core.types import Event, EventLevel, LineSet, VehicleState

_FOXGLOVE_LEVEL = {EventLevel.INFO: 2, EventLevel.WARNING: 3, EventLevel.ERROR: 4}

_POSE_FIELDS = frozenset({"x_m", "y_m", "height_m", "yaw_rad"})
"""A message with these is a pose on the map."""

_IN_WORDS: JsonObject = {"type": "string"}
"""The schema of a reason."""


def picture_schema() -> tuple[str, JsonObject]:
    """Name and JSON schema of a picture."""
    return foxglove.COMPRESSED_IMAGE, json_schema(foxglove.COMPRESSED_IMAGE)


def schema_of(message: object) -> tuple[str, JsonObject]:
    """Name and JSON schema of a message's type, without references (not every reader follows them)."""
    name = _foxglove_alone(message)
    if name:
        return name, json_schema(name)
    if not dataclasses.is_dataclass(message):
        return "flightd.Object", {"type": "object"}
    kind = type(message)
    schema = msgspec.json.schema(kind, schema_hook=_schema_of_reason)
    inlined = _inline(schema, schema.get("$defs", {}))
    assert isinstance(inlined, dict)
    if isinstance(message, LineSet):
        return foxglove.IMAGE_ANNOTATIONS, json_schema(foxglove.IMAGE_ANNOTATIONS, inlined["properties"])
    if {field.name for field in dataclasses.fields(message)} >= _POSE_FIELDS:
        return foxglove.POSE_IN_FRAME, json_schema(foxglove.POSE_IN_FRAME, inlined["properties"])
    return f"flightd.{kind.__name__}", inlined


def _foxglove_alone(message: object) -> str:
    """The Foxglove schema of a message that has none of our fields in the log, else empty."""
    match message:
        case Event():
            return foxglove.LOG
        case DronePlace():
            return foxglove.FRAME_TRANSFORMS
        case WellKnown():
            return message.schema
    return ""


def _schema_of_reason(kind: type) -> JsonObject:
    if kind is Refusal:
        return _IN_WORDS
    raise NotImplementedError(f"a {kind.__name__} has no schema")


def _inline(node: object, definitions: JsonObject) -> object:
    if isinstance(node, dict):
        if _IN_WORDS in node.get("anyOf", ()):  # or none, which is an empty text
            return _IN_WORDS | {"default": ""}
        if "$ref" in node:
            return _inline(definitions[node["$ref"].rpartition("/")[2]], definitions)
        return {key: _inline(value, definitions) for key, value in node.items() if key != "$defs"}
    if isinstance(node, list):
        return [_inline(value, definitions) for value in node]
    return node


def _plain(value: object) -> object:
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    raise TypeError(f"a {type(value).__name__} cannot be recorded")


_encode = partial(msgspec.json.Encoder(enc_hook=_plain).encode)


def encode(message: object) -> bytes:
    """One message as JSON; TypeError if it holds something that has no JSON form."""
    if isinstance(message, Event):
        return _encode(
            {
                "timestamp": time_of(message.stamp_ns),
                "level": _FOXGLOVE_LEVEL[message.level],
                "message": message.text,
                "name": message.name,
                "file": "",
                "line": 0,
            }
        )
    if isinstance(message, WellKnown):
        return _encode(message.fields)
    if isinstance(message, TickInput | VehicleState):
        return _encode(_in_words(message))
    return _encode(message)


_FIELDS = {
    kind: tuple(field.name for field in dataclasses.fields(kind)) for kind in (TickInput, VehicleState)
}
"""Of the messages that hold reasons, and are recorded at each tick."""


def _in_words(message: TickInput | VehicleState) -> JsonObject:
    """The fields of a message that holds reasons, those as their words."""
    fields = {name: getattr(message, name) for name in _FIELDS[type(message)]}
    if isinstance(message, VehicleState):
        return fields | {"refusal": words(message.refusal), "unfit": words(message.unfit)}
    vehicle = message.vehicle and _in_words(message.vehicle)
    return fields | {"vehicle": vehicle, "unfit": words(message.unfit)}
