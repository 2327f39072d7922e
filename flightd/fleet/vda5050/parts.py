"""What several messages of VDA 5050 are made of, by the names of version 3.0.  Metres, seconds, radians."""

from __future__ import annotations

import enum
from typing import Annotated, Any

import msgspec
from msgspec import Meta

UInt32 = Annotated[int, Meta(ge=0, le=2**32 - 1)]
Angle = Annotated[float, Meta(ge=-3.14159265359, le=3.14159265359)]
NotNegative = Annotated[float, Meta(ge=0.0)]
Share = Annotated[float, Meta(ge=0.0, le=1.0)]
Percent = Annotated[float, Meta(ge=0.0, le=100.0)]
Value = str | bool | int | float | list[Any] | dict[str, Any]
"""Of a parameter: anything that JSON has but null."""


class Part(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True, rename="camel"):
    """A JSON object; what is None is not written."""


class BlockingType(enum.StrEnum):
    """What may go on beside an action."""

    NONE = "NONE"
    SINGLE = "SINGLE"
    SOFT = "SOFT"
    HARD = "HARD"

    @property
    def stops_driving(self) -> bool:
        """Whether the vehicle stands still meanwhile."""
        return self in {BlockingType.SOFT, BlockingType.HARD}

    @property
    def alone(self) -> bool:
        """Whether no other action runs meanwhile."""
        return self in {BlockingType.SINGLE, BlockingType.HARD}


class ActionParameter(Part, frozen=True):
    """A value by its key."""

    key: str
    value: Value


class Action(Part, frozen=True):
    """What a vehicle is to do on a node, an edge, or at once."""

    action_type: str
    action_id: str
    blocking_type: BlockingType
    action_descriptor: str | None = None
    action_parameters: list[ActionParameter] | None = None
    retriable: bool | None = None

    def parameter(self, key: str) -> Value | None:
        """The value of a parameter; None where it is not given."""
        return next((one.value for one in self.action_parameters or () if one.key == key), None)


class ControlPoint(Part, frozen=True):
    """Of a NURBS."""

    x: float
    y: float
    weight: NotNegative | None = None


class Trajectory(Part, frozen=True):
    """A path as a NURBS; without knots they are clamped and even."""

    control_points: list[ControlPoint]
    degree: Annotated[int, Meta(ge=1)] | None = None
    knot_vector: list[Share] | None = None


class Velocity(Part, frozen=True):
    """In the vehicle's own frame."""

    vx: float | None = None
    vy: float | None = None
    omega: float | None = None


class MobileRobotPosition(Part, frozen=True):
    """Where a vehicle is on the map, y to the left of x seen from above."""

    x: float
    y: float
    theta: Angle
    map_id: str
    localized: bool
    localization_score: Share | None = None
    deviation_range: NotNegative | None = None


class Header(Part, frozen=True):
    """What every message begins with.  `timestamp`: ISO 8601, UTC, to the millisecond."""

    header_id: UInt32
    timestamp: str
    version: str
    manufacturer: str
    serial_number: str
