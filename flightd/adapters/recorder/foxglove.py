"""What makes our own messages conform to the Foxglove schemas.

A recorded line set is also a `foxglove.ImageAnnotations` (drawn over the picture of the same time), a
pose also a `foxglove.PoseInFrame`: our fields come first, theirs are appended by the writing process, so
that the control task does not pay for them.  Where the drone's body is becomes a
`foxglove.FrameTransforms` there, too, and nothing else.

Own code: foxglove-sdk 0.30's types write protobuf alone, which leaves no room for our own fields in the same
message, and it is 11 MB installed on aarch64 (54 MB on x86-64).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType

import msgspec

from flightd.adapters.foxglove.frames import IN_LOG, body_attitude, drone_on_map, place, time_of
from flightd.adapters.foxglove.schemas import (
    FRAME_TRANSFORMS,
    IMAGE_ANNOTATIONS,
    POSE_IN_FRAME,
    JsonObject,
)
from flightd.core.types import VERTICAL_LIMIT_RAD

_VERTICAL = {"r": 0.0, "g": 0.9, "b": 1.0, "a": 1.0}
_HORIZONTAL = {"r": 1.0, "g": 0.3, "b": 0.85, "a": 1.0}
_WHITE = {"r": 1.0, "g": 1.0, "b": 1.0, "a": 1.0}
_CLEAR = {"r": 0.0, "g": 0.0, "b": 0.0, "a": 0.0}
_LINE_LOOP, _LINE_LIST = 2, 4


def conforming(schema_name: str) -> Callable[[bytes, int], bytes] | None:
    """What appends a schema's fields to one of our messages (JSON, stamp), None if nothing need be."""
    if schema_name == FRAME_TRANSFORMS:
        return _transforms
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
    orientation = body_attitude(pose.roll_rad, pose.pitch_rad, pose.yaw_rad)
    return {
        "timestamp": time_of(stamp_ns),
        "frame_id": IN_LOG.map,
        "pose": {"position": place(pose.x_m, pose.y_m, pose.height_m or 0.0), "orientation": orientation},
    }


def _transforms(payload: bytes, stamp_ns: int) -> bytes:
    """The drone on the map in place of our message; one that is of the schema already stays as it is."""
    try:
        pose = _POSES.decode(payload)
    except (msgspec.MsgspecError, ValueError):
        return payload
    at = pose.x_m, pose.y_m, pose.height_m or 0.0
    return msgspec.json.encode(drone_on_map(stamp_ns, at, (pose.roll_rad, pose.pitch_rad, pose.yaw_rad)))


_BUILDERS: Mapping[str, Callable[[bytes, int], JsonObject]] = MappingProxyType(
    {IMAGE_ANNOTATIONS: _annotations, POSE_IN_FRAME: _pose}
)
