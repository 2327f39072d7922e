"""The warehouse map and the cameras, as the daemon tells them to a client."""

from __future__ import annotations

from typing import Annotated

import msgspec
from msgspec import Meta

from flightd.core.preview import CameraName


class FloorNode(msgspec.Struct, frozen=True):
    """A crossing on the map."""

    id: Annotated[str, Meta(description="name")]
    x_m: Annotated[float, Meta(description="m along the aisles")]
    y_m: Annotated[float, Meta(description="m to the right of x")]
    aisle: Annotated[str, Meta(description="of which aisle")] = ""
    levels: Annotated[tuple[int, ...], Meta(description="shelf levels with locations that it faces")] = ()
    left: Annotated[
        tuple[int, ...] | None,
        Meta(description="of these on its left, towards -y; null: a daemon that takes no `counts`"),
    ] = None
    right: Annotated[tuple[int, ...] | None, Meta(description="of these on its right; null: as `left`")] = (
        None
    )


class FloorLine(msgspec.Struct, frozen=True):
    """A stroke of guide paint."""

    x0_m: Annotated[float, Meta(description="one end")]
    y0_m: Annotated[float, Meta(description="one end")]
    x1_m: Annotated[float, Meta(description="other end")]
    y1_m: Annotated[float, Meta(description="other end")]


class FloorRack(msgspec.Struct, frozen=True):
    """A shelf front: a vertical rectangle parallel to x, which faces its aisle."""

    aisle: Annotated[str, Meta(description="of which aisle")]
    side: Annotated[str, Meta(description="left (towards -y) or right of it")]
    x0_m: Annotated[float, Meta(description="one end")]
    x1_m: Annotated[float, Meta(description="other end")]
    y_m: Annotated[float, Meta(description="where the front stands")]
    height_m: Annotated[float, Meta(description="above the floor")]
    bays_m: Annotated[
        tuple[float, ...], Meta(description="x at which its bays meet and end, rising; empty: not divided")
    ] = ()


class FloorArea(msgspec.Struct, frozen=True):
    """A rectangle of floor over which nothing flies between two heights."""

    x0_m: Annotated[float, Meta(description="smaller x")]
    y0_m: Annotated[float, Meta(description="smaller y")]
    x1_m: Annotated[float, Meta(description="larger x")]
    y1_m: Annotated[float, Meta(description="larger y")]
    from_m: Annotated[float, Meta(description="from this height")]
    to_m: Annotated[float | None, Meta(description="to this height; null: without end")]


class FloorPad(msgspec.Struct, frozen=True):
    """A pad to start from, to land or to charge on."""

    id: Annotated[str, Meta(description="name")]
    x_m: Annotated[float, Meta(description="of its centre")]
    y_m: Annotated[float, Meta(description="of its centre")]
    size_m: Annotated[float, Meta(description="length of its sides")]
    charge: Annotated[bool, Meta(description="batteries are charged or changed here")]
    shared: Annotated[bool, Meta(description="drones come down here only where they are told to")] = False


class FloorWay(msgspec.Struct, frozen=True):
    """A line between two nodes that is not simply open."""

    a: Annotated[str, Meta(description="node")]
    b: Annotated[str, Meta(description="node")]
    closed: Annotated[bool, Meta(description="blocked, or too near a keep-out; else one way, from a to b")]


class FloorStatus(msgspec.Struct, frozen=True):
    """The warehouse map, as far as a client draws it."""

    name: Annotated[str, Meta(description="of the site")]
    home: Annotated[str, Meta(description="node of the pad")]
    nodes: Annotated[tuple[FloorNode, ...], Meta(description="every node")]
    lines: Annotated[tuple[FloorLine, ...], Meta(description="every painted line")]
    line_width_m: Annotated[float, Meta(description="width of the paint; 0: not told")] = 0.0
    line_colour: Annotated[
        str, Meta(description="colour of the paint, or its tone as #rrggbb; empty: not told")
    ] = ""
    racks: Annotated[tuple[FloorRack, ...], Meta(description="every shelf front")] = ()
    keep_outs: Annotated[tuple[FloorArea, ...], Meta(description="every keep-out")] = ()
    pads: Annotated[tuple[FloorPad, ...], Meta(description="every pad")] = ()
    ways: Annotated[tuple[FloorWay, ...], Meta(description="closed and one-way lines")] = ()
    unattended_start: Annotated[
        bool, Meta(description="schedules of a ground station may start a flight without a person")
    ] = False


class CameraOptics(msgspec.Struct, frozen=True):
    """A camera's lens, and how it sits in the drone: as its configuration has them."""

    camera: Annotated[CameraName, Meta(description="which camera's")]
    width_px: Annotated[int, Meta(description="width of its frames; pictures may be smaller")]
    height_px: Annotated[int, Meta(description="height of its frames")]
    fx_px: Annotated[float, Meta(description="focal length in x, at the frames' size")]
    fy_px: Annotated[float, Meta(description="focal length in y")]
    cx_px: Annotated[float, Meta(description="principal point x; pixels' centres are integers")]
    cy_px: Annotated[float, Meta(description="principal point y")]
    distortion: Annotated[
        tuple[float, float, float, float, float], Meta(description="k1 k2 p1 p2 k3, OpenCV's order")
    ]
    offset_m: Annotated[
        tuple[float, float, float],
        Meta(description="forward, right, down of the point whose height is reported"),
    ]
    turn: Annotated[
        tuple[float, float, float, float],
        Meta(
            description="quaternion x y z w that turns the picture's axes (right, down, ahead) into the "
            "drone's (forward, right, down)"
        ),
    ]
