"""What a fleet control sends: orders and instant actions."""

from __future__ import annotations

import enum
from typing import Annotated

import msgspec
from msgspec import Meta

from flightd.fleet.vda5050.parts import Action, Angle, Header, NotNegative, Part, Trajectory, UInt32


class AllowedDeviation(Part, frozen=True):
    """An ellipse around a node: half axes, and the angle of the longer one against x."""

    a: NotNegative
    b: NotNegative
    theta: Annotated[float, Meta(ge=-1.570796327, le=1.570796327)]


class NodePosition(Part, frozen=True):
    """Where a node lies on the map."""

    x: float
    y: float
    map_id: str
    theta: Angle | None = None
    allowed_deviation_xy: AllowedDeviation | None = msgspec.field(name="allowedDeviationXY", default=None)
    allowed_deviation_theta: Annotated[float, Meta(ge=0.0, le=3.141592654)] | None = None


class Node(Part, frozen=True):
    """A node to be traversed; part of the base where `released`."""

    node_id: str
    sequence_id: UInt32
    released: bool
    actions: list[Action]
    node_descriptor: str | None = None
    node_position: NodePosition | None = None


class OrientationType(enum.StrEnum):
    """To what an orientation is relative."""

    GLOBAL = "GLOBAL"
    TANGENTIAL = "TANGENTIAL"


class CorridorReference(enum.StrEnum):
    """What has to stay inside a corridor."""

    KINEMATIC_CENTER = "KINEMATIC_CENTER"
    CONTOUR = "CONTOUR"


class ReleaseLoss(enum.StrEnum):
    """What is done when the release of a corridor is lost."""

    STOP = "STOP"
    RETURN = "RETURN"


class Corridor(Part, frozen=True):
    """How far a vehicle may leave its trajectory."""

    left_width: NotNegative
    right_width: NotNegative
    corridor_reference_point: CorridorReference | None = None
    release_required: bool | None = None
    release_loss_behavior: ReleaseLoss | None = None


class Edge(Part, frozen=True):
    """The way between the nodes with the sequence ids before and after its own."""

    edge_id: str
    sequence_id: UInt32
    released: bool
    actions: list[Action]
    edge_descriptor: str | None = None
    maximum_speed: float | None = None
    maximum_mobile_robot_height: float | None = None
    minimum_load_handling_device_height: float | None = None
    orientation: Angle | None = None
    orientation_type: OrientationType | None = None
    direction: str | None = None
    reach_orientation_before_entering: bool | None = None
    max_rotation_speed: float | None = None
    trajectory: Trajectory | None = None
    length: float | None = None
    corridor: Corridor | None = None


class Order(Header, frozen=True):
    """A way with actions, or what is added to one."""

    order_id: str
    order_update_id: UInt32
    nodes: list[Node]
    edges: list[Edge]
    order_description: str | None = None


class InstantActions(Header, frozen=True):
    """What is to be done at once."""

    actions: list[Action]
