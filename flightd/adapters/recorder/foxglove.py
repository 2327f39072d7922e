"""The well-known Foxglove schemas, and what makes our own messages conform to them.

A recorded line set is also a `foxglove.ImageAnnotations` (drawn over the picture of the same time), a
pose also a `foxglove.PoseInFrame`: our fields come first, theirs are appended by the writing process,
so that the control task does not pay for them.  Foxglove's z is up and its y to the left: positions
and angles are turned over from the map frame (y right, yaw clockwise).

Own code: foxglove-sdk 0.30's types write protobuf alone, which leaves no room for our own fields in the same
message, and it is 11 MB installed on aarch64 (54 MB on x86-64).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import Any, TypeAlias

import msgspec

from flightd.core.types import VERTICAL_LIMIT_RAD

JsonObject: TypeAlias = dict[str, Any]

NS_PER_S = 1_000_000_000

IMAGE_ANNOTATIONS = "foxglove.ImageAnnotations"
POSE_IN_FRAME = "foxglove.PoseInFrame"
LOG = "foxglove.Log"
COMPRESSED_IMAGE = "foxglove.CompressedImage"

_VERTICAL = {"r": 0.0, "g": 0.9, "b": 1.0, "a": 1.0}
_HORIZONTAL = {"r": 1.0, "g": 0.3, "b": 0.85, "a": 1.0}
_WHITE = {"r": 1.0, "g": 1.0, "b": 1.0, "a": 1.0}
_CLEAR = {"r": 0.0, "g": 0.0, "b": 0.0, "a": 0.0}
_LINE_LOOP, _LINE_LIST = 2, 4


def _object(**properties: JsonObject) -> JsonObject:
    return {"type": "object", "properties": properties}


_NUMBER: JsonObject = {"type": "number"}
_TEXT: JsonObject = {"type": "string"}
_INTEGER: JsonObject = {"type": "integer"}
_TIME = _object(sec=_INTEGER, nsec=_INTEGER) | {"title": "time"}
_COLOUR = _object(r=_NUMBER, g=_NUMBER, b=_NUMBER, a=_NUMBER)
_POINT = _object(x=_NUMBER, y=_NUMBER)


def _list(items: JsonObject) -> JsonObject:
    return {"type": "array", "items": items}


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
        POSE_IN_FRAME: {
            "timestamp": _TIME,
            "frame_id": _TEXT,
            "pose": _object(
                position=_object(x=_NUMBER, y=_NUMBER, z=_NUMBER),
                orientation=_object(x=_NUMBER, y=_NUMBER, z=_NUMBER, w=_NUMBER),
            ),
        },
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
    }
)
"""The properties of each schema, as JSON schema."""


def time_of(stamp_ns: int) -> JsonObject:
    return {"sec": stamp_ns // NS_PER_S, "nsec": stamp_ns % NS_PER_S}


def conforming(schema_name: str) -> Callable[[bytes, int], bytes] | None:
    """What appends a schema's fields to one of our messages (JSON, stamp), None if nothing need be."""
    build = _BUILDERS.get(schema_name)
    if build is None:
        return None

    def append(payload: bytes, stamp_ns: int) -> bytes:
        try:
            fields = build(payload, stamp_ns)
        except (msgspec.MsgspecError, ValueError):
            return payload  # recorded as it is: better than not at all
        return payload[:-1] + b"," + msgspec.json.encode(fields)[1:]

    return append


class _Line(msgspec.Struct):
    rho_px: float
    theta_rad: float
    width_px: float
    start_px: float
    end_px: float


class _Junction(msgspec.Struct):
    x_px: float
    y_px: float


class _LineSet(msgspec.Struct):
    width_px: int
    height_px: int
    lines: list[_Line]
    junctions: list[_Junction]


class _Pose(msgspec.Struct):
    x_m: float
    y_m: float
    height_m: float | None
    yaw_rad: float
    roll_rad: float = 0.0
    pitch_rad: float = 0.0


_LINE_SETS = msgspec.json.Decoder(_LineSet)
_POSES = msgspec.json.Decoder(_Pose)


def _annotations(payload: bytes, stamp_ns: int) -> JsonObject:
    seen = _LINE_SETS.decode(payload)
    time = time_of(stamp_ns)
    middle = seen.width_px / 2, seen.height_px / 2
    points: list[JsonObject] = []
    for line in seen.lines:
        half, start, end = line.width_px / 2, line.start_px, line.end_px
        band = ((start, -half), (end, -half), (end, half), (start, half))
        points.append(_stroke(time, _LINE_LOOP, line, band, middle, 1.0))
        points.append(_stroke(time, _LINE_LIST, line, ((start, 0.0), (end, 0.0)), middle, 2.0))
    circles = [
        {
            "timestamp": time,
            "position": {"x": middle[0] + junction.x_px, "y": middle[1] + junction.y_px},
            "diameter": 18.0,
            "thickness": 2.0,
            "fill_color": _CLEAR,
            "outline_color": _WHITE,
        }
        for junction in seen.junctions
    ]
    return {"circles": circles, "points": points, "texts": []}


def _stroke(
    time: JsonObject,
    kind: int,
    line: _Line,
    corners: Iterable[tuple[float, float]],
    middle: tuple[float, float],
    thickness: float,
) -> JsonObject:
    """Points given along and across a line, joined in the line's colour."""
    c, s = math.cos(line.theta_rad), math.sin(line.theta_rad)
    points = [
        {
            "x": middle[0] + (line.rho_px + across) * c - along * s,
            "y": middle[1] + (line.rho_px + across) * s + along * c,
        }
        for along, across in corners
    ]
    horizontal = VERTICAL_LIMIT_RAD <= line.theta_rad <= math.pi - VERTICAL_LIMIT_RAD
    return {
        "timestamp": time,
        "type": kind,
        "points": points,
        "outline_color": _HORIZONTAL if horizontal else _VERTICAL,
        "outline_colors": [],
        "fill_color": _CLEAR,
        "thickness": thickness,
    }


def _pose(payload: bytes, stamp_ns: int) -> JsonObject:
    pose = _POSES.decode(payload)
    position = {"x": pose.x_m, "y": -pose.y_m, "z": pose.height_m or 0.0}
    orientation = _quaternion(pose.roll_rad, -pose.pitch_rad, -pose.yaw_rad)
    return {
        "timestamp": time_of(stamp_ns),
        "frame_id": "map",
        "pose": {"position": position, "orientation": orientation},
    }


def _quaternion(roll_rad: float, pitch_rad: float, yaw_rad: float) -> JsonObject:
    """Of yaw about z, then pitch about y, then roll about x."""
    cr, sr = math.cos(roll_rad / 2), math.sin(roll_rad / 2)
    cp, sp = math.cos(pitch_rad / 2), math.sin(pitch_rad / 2)
    cy, sy = math.cos(yaw_rad / 2), math.sin(yaw_rad / 2)
    return {
        "x": sr * cp * cy - cr * sp * sy,
        "y": cr * sp * cy + sr * cp * sy,
        "z": cr * cp * sy - sr * sp * cy,
        "w": cr * cp * cy + sr * sp * sy,
    }


_BUILDERS: Mapping[str, Callable[[bytes, int], JsonObject]] = MappingProxyType(
    {IMAGE_ANNOTATIONS: _annotations, POSE_IN_FRAME: _pose}
)
