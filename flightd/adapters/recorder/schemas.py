"""How messages look in the log: JSON, with JSON schemas that Foxglove and other MCAP tools read.

Events are `foxglove.Log`, pictures `foxglove.CompressedImage` (both with a field or two more), the rest
are the fields of the dataclasses by name.  A float that is not a number is written as null.
"""

from __future__ import annotations

import dataclasses
from functools import partial
from typing import Any, TypeAlias

import msgspec
import numpy as np

from flightd.core.types import Event, EventLevel

JsonObject: TypeAlias = dict[str, Any]

NS_PER_S = 1_000_000_000

_TIME: JsonObject = {
    "type": "object",
    "title": "time",
    "properties": {"sec": {"type": "integer", "minimum": 0}, "nsec": {"type": "integer", "minimum": 0}},
}
_FOXGLOVE_LEVEL = {EventLevel.INFO: 2, EventLevel.WARNING: 3, EventLevel.ERROR: 4}

LOG_SCHEMA: JsonObject = {
    "title": "foxglove.Log",
    "type": "object",
    "properties": {
        "timestamp": _TIME,
        "level": {"type": "integer", "description": "2 info, 3 warning, 4 error"},
        "message": {"type": "string"},
        "name": {"type": "string"},
        "file": {"type": "string"},
        "line": {"type": "integer", "minimum": 0},
    },
}

PICTURE_SCHEMA: JsonObject = {
    "title": "foxglove.CompressedImage",
    "type": "object",
    "properties": {
        "timestamp": _TIME,
        "frame_id": {"type": "string"},
        "data": {"type": "string", "contentEncoding": "base64"},
        "format": {"type": "string"},
        "seq": {"type": "integer", "minimum": 0},
    },
}

FREE_SCHEMA: JsonObject = {"type": "object"}
"""Of messages that are plain objects."""


def foxglove_time(stamp_ns: int) -> JsonObject:
    return {"sec": stamp_ns // NS_PER_S, "nsec": stamp_ns % NS_PER_S}


def schema_of(message: object) -> tuple[str, JsonObject]:
    """Name and JSON schema of a message's type, without references (not every reader follows them)."""
    if isinstance(message, Event):
        return "foxglove.Log", LOG_SCHEMA
    if dataclasses.is_dataclass(message):
        kind = type(message)
        schema = msgspec.json.schema(kind)
        inlined = _inline(schema, schema.get("$defs", {}))
        assert isinstance(inlined, dict)
        return f"flightd.{kind.__name__}", inlined
    return "flightd.Object", FREE_SCHEMA


def _inline(node: object, definitions: JsonObject) -> object:
    if isinstance(node, dict):
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
                "timestamp": foxglove_time(message.stamp_ns),
                "level": _FOXGLOVE_LEVEL[message.level],
                "message": message.text,
                "name": message.name,
                "file": "",
                "line": 0,
            }
        )
    return _encode(message)
