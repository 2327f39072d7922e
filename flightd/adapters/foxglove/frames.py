"""Places and directions as Foxglove has them.

Foxglove's axes are right-handed with z up: x forward (along the aisles), y to the left.  flightd's map has
y to the right and yaw clockwise from above, its body z down, so both are turned over.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from flightd.adapters.foxglove.schemas import JsonObject

NS_PER_S = 1_000_000_000
_DIGITS = 4
"""Places are told to a tenth of a millimetre, directions to a ten-thousandth."""
_FINE_DIGITS = 7


@dataclass(frozen=True, slots=True)
class Frames:
    """Names of the frames of one drone: that of its map, its own, and those of its cameras."""

    map: str = "map"
    drone: str = "drone"
    of_cameras: str = ""

    def camera(self, name: str) -> str:
        return f"{self.of_cameras}{name}_camera"


IN_LOG = Frames()
"""A flight log has one drone."""


def time_of(stamp_ns: int) -> JsonObject:
    return {"sec": stamp_ns // NS_PER_S, "nsec": stamp_ns % NS_PER_S}


def place(x_m: float, y_m: float, height_m: float) -> JsonObject:
    """A point of flightd's map."""
    return vector(x_m, -y_m, height_m)


def vector(x: float, y: float, z: float) -> JsonObject:
    """In Foxglove's own axes."""
    return {"x": round(x, _DIGITS), "y": round(y, _DIGITS), "z": round(z, _DIGITS)}


def body_attitude(roll_rad: float, pitch_rad: float, yaw_rad: float) -> JsonObject:
    """The quaternion of flightd's roll (right side down), pitch (nose up) and yaw (clockwise from above)."""
    return quaternion(roll_rad, -pitch_rad, -yaw_rad)


def quaternion(roll_rad: float, pitch_rad: float, yaw_rad: float) -> JsonObject:
    """In Foxglove's own axes: of yaw about z, then pitch about y, then roll about x."""
    cr, sr = math.cos(roll_rad / 2), math.sin(roll_rad / 2)
    cp, sp = math.cos(pitch_rad / 2), math.sin(pitch_rad / 2)
    cy, sy = math.cos(yaw_rad / 2), math.sin(yaw_rad / 2)
    return {
        "x": round(sr * cp * cy - cr * sp * sy, _FINE_DIGITS),
        "y": round(cr * sp * cy + sr * cp * sy, _FINE_DIGITS),
        "z": round(cr * cp * sy - sr * sp * cy, _FINE_DIGITS),
        "w": round(cr * cp * cy + sr * sp * sy, _FINE_DIGITS),
    }


def transform(
    stamp_ns: int, parent: str, child: str, translation: JsonObject, rotation: JsonObject
) -> JsonObject:
    """One frame in another."""
    return {
        "timestamp": time_of(stamp_ns),
        "parent_frame_id": parent,
        "child_frame_id": child,
        "translation": translation,
        "rotation": rotation,
    }


def drone_on_map(
    stamp_ns: int,
    at: tuple[float, float, float],
    attitude_rad: tuple[float, float, float],
    frames: Frames = IN_LOG,
) -> JsonObject:
    """`foxglove.FrameTransforms` of the drone `at` (x, y, height; m) with roll, pitch and yaw."""
    moved = transform(stamp_ns, frames.map, frames.drone, place(*at), body_attitude(*attitude_rad))
    return {"transforms": [moved]}
