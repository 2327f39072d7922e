"""The warehouse as a Foxglove scene: painted lines, nodes, racks with their bays, keep-outs, pads.

One entity for each kind, always all of them: what is told anew takes the place of what was told before.
They have no lifetime, so that one message at the beginning of a log holds wherever a viewer seeks to.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from flightd.adapters.foxglove.frames import Frames, place, quaternion, time_of, vector
from flightd.adapters.foxglove.schemas import PRIMITIVES, JsonObject
from flightd.adapters.ground_link.messages.floor import (
    FloorArea,
    FloorLine,
    FloorNode,
    FloorPad,
    FloorRack,
    FloorStatus,
)

PAINT_M = 0.002
"""Paint and mats are drawn so thick, on the floor."""
ASSUMED_LINE_WIDTH_M = 0.05
"""Of paint whose width is not told."""
FRONT_DEPTH_M = 0.02
"""The map knows fronts, not depths: a front is a board behind its plane, a bay a flat box behind that."""
BAY_DEPTH_M = 0.15
BAY_GAP_M = 0.02
"""Bays are drawn so much narrower than they are, to be told apart."""
ENDLESS_M = 5.0
"""A keep-out without an upper end is drawn so high."""

_NODE_M = 0.12
_TEXT_M = 0.18
_TEXT_HEIGHT_M = 0.15

_PAINT = {
    "yellow": (0.98, 0.80, 0.10, 1.0),
    "white": (0.95, 0.95, 0.95, 1.0),
    "red": (0.85, 0.15, 0.12, 1.0),
    "blue": (0.12, 0.35, 0.85, 1.0),
}
_OTHER_PAINT = (0.6, 0.6, 0.6, 1.0)
_NODE = (0.1, 0.1, 0.1, 1.0)
_TEXT = (1.0, 1.0, 1.0, 1.0)
_FRONT = (0.35, 0.42, 0.5, 0.35)
_BAY = (0.45, 0.55, 0.7, 0.5)
_KEEP_OUT = (0.9, 0.1, 0.1, 0.3)
_PAD = (0.3, 0.45, 0.75, 0.9)
_CHARGE_PAD = (0.15, 0.6, 0.3, 0.9)
_UPRIGHT = quaternion(0.0, 0.0, 0.0)


def warehouse_scene(floor: FloorStatus, stamp_ns: int, frames: Frames) -> JsonObject:
    """`foxglove.SceneUpdate` of the whole floor."""

    def entity(name: str, **primitives: list[JsonObject]) -> JsonObject:
        return {
            "timestamp": time_of(stamp_ns),
            "frame_id": frames.map,
            "id": name,
            "lifetime": {"sec": 0, "nsec": 0},
            "frame_locked": True,
            "metadata": [{"key": "site", "value": floor.name}],
            **{kind: primitives.get(kind, []) for kind in PRIMITIVES},
        }

    return {
        "deletions": [],
        "entities": [
            entity("lines", cubes=list(_lines(floor))),
            entity(
                "nodes",
                cylinders=[_node(node) for node in floor.nodes],
                texts=[_text(node.id, node.x_m, node.y_m, _TEXT_HEIGHT_M) for node in floor.nodes],
            ),
            entity(
                "racks",
                cubes=[_front(rack) for rack in floor.racks],
                texts=[_rack_name(rack) for rack in floor.racks],
            ),
            entity("bays", cubes=[bay for rack in floor.racks for bay in _bays(rack)]),
            entity("keep_outs", cubes=[_keep_out(area) for area in floor.keep_outs]),
            entity(
                "pads",
                cubes=[_pad(pad) for pad in floor.pads],
                texts=[_text(pad.id, pad.x_m, pad.y_m, 2 * _TEXT_HEIGHT_M) for pad in floor.pads],
            ),
        ],
    }


def _lines(floor: FloorStatus) -> Iterator[JsonObject]:
    width_m = floor.line_width_m or ASSUMED_LINE_WIDTH_M
    colour = _PAINT.get(floor.line_colour, _OTHER_PAINT)
    for line in floor.lines:
        yield _line(line, width_m, colour)


def _line(line: FloorLine, width_m: float, colour: Sequence[float]) -> JsonObject:
    along_x_m, along_y_m = line.x1_m - line.x0_m, line.y1_m - line.y0_m
    middle = place((line.x0_m + line.x1_m) / 2, (line.y0_m + line.y1_m) / 2, PAINT_M / 2)
    turned = quaternion(0.0, 0.0, math.atan2(-along_y_m, along_x_m))
    return _solid(middle, vector(math.hypot(along_x_m, along_y_m), width_m, PAINT_M), colour, turned)


def _node(node: FloorNode) -> JsonObject:
    return _solid(place(node.x_m, node.y_m, PAINT_M), vector(_NODE_M, _NODE_M, 2 * PAINT_M), _NODE)


def _front(rack: FloorRack) -> JsonObject:
    return _behind(rack, rack.x0_m, rack.x1_m, 0.0, FRONT_DEPTH_M, _FRONT)


def _bays(rack: FloorRack) -> Iterator[JsonObject]:
    for left_m, right_m in zip(rack.bays_m, rack.bays_m[1:], strict=False):
        gap_m = min(BAY_GAP_M, (right_m - left_m) / 2) / 2
        yield _behind(rack, left_m + gap_m, right_m - gap_m, FRONT_DEPTH_M, BAY_DEPTH_M, _BAY)


def _behind(
    rack: FloorRack, x0_m: float, x1_m: float, from_m: float, depth_m: float, colour: Sequence[float]
) -> JsonObject:
    """A box that begins `from_m` behind the front, away from its aisle."""
    y_m = rack.y_m + _away(rack) * (from_m + depth_m / 2)
    middle = place((x0_m + x1_m) / 2, y_m, rack.height_m / 2)
    return _solid(middle, vector(x1_m - x0_m, depth_m, rack.height_m), colour)


def _away(rack: FloorRack) -> float:
    return -1.0 if rack.side == "left" else 1.0


def _rack_name(rack: FloorRack) -> JsonObject:
    y_m = rack.y_m + _away(rack) * FRONT_DEPTH_M
    return _text(f"{rack.aisle} {rack.side}", (rack.x0_m + rack.x1_m) / 2, y_m, rack.height_m + _TEXT_M)


def _keep_out(area: FloorArea) -> JsonObject:
    to_m = area.from_m + ENDLESS_M if area.to_m is None else area.to_m
    middle = place((area.x0_m + area.x1_m) / 2, (area.y0_m + area.y1_m) / 2, (area.from_m + to_m) / 2)
    size = vector(area.x1_m - area.x0_m, area.y1_m - area.y0_m, to_m - area.from_m)
    return _solid(middle, size, _KEEP_OUT)


def _pad(pad: FloorPad) -> JsonObject:
    size = vector(pad.size_m, pad.size_m, PAINT_M)
    return _solid(place(pad.x_m, pad.y_m, PAINT_M / 2), size, _CHARGE_PAD if pad.charge else _PAD)


def _solid(
    position: JsonObject, size: JsonObject, colour: Sequence[float], turned: JsonObject = _UPRIGHT
) -> JsonObject:
    pose = {"position": position, "orientation": turned}
    return {"pose": pose, "size": size, "color": _colour(colour)}


def _text(text: str, x_m: float, y_m: float, height_m: float) -> JsonObject:
    return {
        "pose": {"position": place(x_m, y_m, height_m), "orientation": _UPRIGHT},
        "billboard": True,
        "font_size": _TEXT_M,
        "scale_invariant": False,
        "color": _colour(_TEXT),
        "text": text,
    }


def _colour(rgba: Sequence[float]) -> JsonObject:
    return dict(zip("rgba", rgba, strict=True))
