"""The Foxglove schemas that flightd writes, as JSON schemas: in the flight log and to live viewers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, TypeAlias

JsonObject: TypeAlias = dict[str, Any]

IMAGE_ANNOTATIONS = "foxglove.ImageAnnotations"
POSE_IN_FRAME = "foxglove.PoseInFrame"
LOG = "foxglove.Log"
COMPRESSED_IMAGE = "foxglove.CompressedImage"
SCENE_UPDATE = "foxglove.SceneUpdate"
FRAME_TRANSFORMS = "foxglove.FrameTransforms"
CAMERA_CALIBRATION = "foxglove.CameraCalibration"

PRIMITIVES = ("arrows", "cubes", "spheres", "cylinders", "lines", "triangles", "texts", "models")
"""The lists that every entity of a scene has."""


@dataclass(frozen=True, slots=True)
class WellKnown:
    """A message that is of a Foxglove schema as it stands: `schema` is its name, `fields` are all of it."""

    schema: str
    fields: JsonObject


def _object(**properties: JsonObject) -> JsonObject:
    return {"type": "object", "properties": properties}


def _list(items: JsonObject, size: int | None = None) -> JsonObject:
    exact = {} if size is None else {"minItems": size, "maxItems": size}
    return {"type": "array", "items": items, **exact}


_NUMBER: JsonObject = {"type": "number"}
_TEXT: JsonObject = {"type": "string"}
_INTEGER: JsonObject = {"type": "integer"}
_FLAG: JsonObject = {"type": "boolean"}
_TIME = _object(sec=_INTEGER, nsec=_INTEGER) | {"title": "time"}
_DURATION = _object(sec=_INTEGER, nsec=_INTEGER) | {"title": "duration"}
_COLOUR = _object(r=_NUMBER, g=_NUMBER, b=_NUMBER, a=_NUMBER)
_POINT = _object(x=_NUMBER, y=_NUMBER)
_VECTOR = _object(x=_NUMBER, y=_NUMBER, z=_NUMBER)
_QUATERNION = _object(x=_NUMBER, y=_NUMBER, z=_NUMBER, w=_NUMBER)
_POSE = _object(position=_VECTOR, orientation=_QUATERNION)
_SOLID = _object(pose=_POSE, size=_VECTOR, color=_COLOUR)
_LABEL = _object(
    pose=_POSE, billboard=_FLAG, font_size=_NUMBER, scale_invariant=_FLAG, color=_COLOUR, text=_TEXT
)
_ENTITY = _object(
    timestamp=_TIME,
    frame_id=_TEXT,
    id=_TEXT,
    lifetime=_DURATION,
    frame_locked=_FLAG,
    metadata=_list(_object(key=_TEXT, value=_TEXT)),
    **{
        kind: _list({"cubes": _SOLID, "cylinders": _SOLID, "texts": _LABEL}.get(kind, _object()))
        for kind in PRIMITIVES
    },
)

PROPERTIES: Mapping[str, JsonObject] = MappingProxyType(
    {
        LOG: {
            "timestamp": _TIME,
            "level": _INTEGER | {"description": "2 info, 3 warning, 4 error"},
            "message": _TEXT,
            "name": _TEXT,
            "file": _TEXT,
            "line": _INTEGER,
        },
        COMPRESSED_IMAGE: {
            "timestamp": _TIME,
            "frame_id": _TEXT,
            "data": _TEXT | {"contentEncoding": "base64"},
            "format": _TEXT,
            "seq": _INTEGER,
        },
        POSE_IN_FRAME: {"timestamp": _TIME, "frame_id": _TEXT, "pose": _POSE},
        IMAGE_ANNOTATIONS: {
            "circles": _list(
                _object(
                    timestamp=_TIME,
                    position=_POINT,
                    diameter=_NUMBER,
                    thickness=_NUMBER,
                    fill_color=_COLOUR,
                    outline_color=_COLOUR,
                )
            ),
            "points": _list(
                _object(
                    timestamp=_TIME,
                    type=_INTEGER,
                    points=_list(_POINT),
                    outline_color=_COLOUR,
                    outline_colors=_list(_COLOUR),
                    fill_color=_COLOUR,
                    thickness=_NUMBER,
                )
            ),
            "texts": _list(_object(timestamp=_TIME, position=_POINT, text=_TEXT)),
        },
        SCENE_UPDATE: {
            "deletions": _list(_object(timestamp=_TIME, type=_INTEGER, id=_TEXT)),
            "entities": _list(_ENTITY),
        },
        FRAME_TRANSFORMS: {
            "transforms": _list(
                _object(
                    timestamp=_TIME,
                    parent_frame_id=_TEXT,
                    child_frame_id=_TEXT,
                    translation=_VECTOR,
                    rotation=_QUATERNION,
                )
            )
        },
        CAMERA_CALIBRATION: {
            "timestamp": _TIME,
            "frame_id": _TEXT,
            "width": _INTEGER,
            "height": _INTEGER,
            "distortion_model": _TEXT,
            "D": _list(_NUMBER),
            "K": _list(_NUMBER, 9),
            "R": _list(_NUMBER, 9),
            "P": _list(_NUMBER, 12),
        },
    }
)
"""The properties of each schema, as JSON schema."""


def json_schema(name: str, ours: JsonObject | None = None) -> JsonObject:
    """A schema by its name; fields of `ours` come first."""
    return {"title": name, "type": "object", "properties": (ours or {}) | PROPERTIES[name]}
