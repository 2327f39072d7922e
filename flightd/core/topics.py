"""The flight log's topics: one name and one message type for each, shared by who writes and who reads."""

from __future__ import annotations

import enum
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from flightd.core.flight_order import ChosenPlan, FlightOrder
from flightd.core.learnt import LearntSensors
from flightd.core.scanning import CodeSet, Finding
from flightd.core.tick import StepFailure
from flightd.core.types import (
    AttitudeSetpoint,
    Command,
    Event,
    GridPose,
    LineSet,
    Status,
    VehicleState,
)


class Topic(enum.StrEnum):
    """Names of the streams in `flight.mcap`; TRUTH, UNKNOWNS, FAULT, ARMED and EXPOSED (of streamed frames)
    are in the simulator's `truth.mcap`.

    TICK and DECISION are all that the pilot was given and all that it answered (`core.tick.TickInput`,
    `core.tick.TickOutput`), so that a flight can be replayed; FAILURE is what a tick raised;
    SCENE, DRONE_FRAME, CAMERA_FRAMES and the calibrations are for viewers (Foxglove), and nothing of flightd
    reads them; the others are for people and their tools.
    """

    LINES = "/lines"
    CODES = "/codes"
    FINDING = "/finding"
    POSE = "/pose"
    VEHICLE = "/vehicle"
    SETPOINT = "/setpoint"
    STATUS = "/status"
    EVENT = "/event"
    COMMAND = "/command"
    FRAME = "/frame"
    TICK = "/tick"
    DECISION = "/decision"
    FAILURE = "/failure"
    CONFIG = "/config"
    MAP = "/map"
    ORDER = "/order"
    PLAN = "/plan"
    LEARNT = "/learnt"
    SCENE = "/scene"
    DRONE_FRAME = "/drone_frame"
    CAMERA_FRAMES = "/camera_frames"
    DOWN_CALIBRATION = "/down_camera/calibration"
    FRONT_CALIBRATION = "/front_camera/calibration"
    TRUTH = "/truth"
    SCENARIO = "/scenario"
    FAULT = "/fault"
    ARMED = "/armed"
    EXPOSED = "/exposed"
    UNKNOWNS = "/unknowns"


@dataclass(frozen=True, slots=True)
class RecordedFrame:
    """A compressed picture of the down camera; `stamp_ns` is mid-exposure, `seq` the frame's number."""

    seq: int
    stamp_ns: int
    jpeg: bytes


@dataclass(frozen=True, slots=True)
class Document:
    """A text that the flight was flown with: the configuration, the site map, the scenario (TOML or JSON)."""

    text: str


@dataclass(frozen=True, slots=True)
class DronePlace:
    """Where the drone's body is on the map and how it leans, for viewers; the log has it as their frame."""

    stamp_ns: int
    x_m: float
    y_m: float
    height_m: float
    roll_rad: float
    pitch_rad: float
    yaw_rad: float


_STANDING = frozenset({Topic.SCENE, Topic.CAMERA_FRAMES, Topic.DOWN_CALIBRATION, Topic.FRONT_CALIBRATION})
FOR_VIEWERS = _STANDING | {Topic.DRONE_FRAME}
"""What only viewers read: warehouse, frames, cameras."""

FOR_PEOPLE = frozenset(Topic) - {Topic.FRAME, Topic.TICK, Topic.DECISION} - FOR_VIEWERS
"""All but the pictures, what only a replay needs and what only viewers read."""

RETAINED = (
    frozenset({Topic.CONFIG, Topic.MAP, Topic.ORDER, Topic.PLAN, Topic.LEARNT, Topic.SCENARIO}) | _STANDING
)
"""Topics whose newest message holds for the whole flight, so that every log file must carry it."""

MESSAGE_TYPES: Mapping[str, type] = MappingProxyType(
    {
        Topic.LINES: LineSet,
        Topic.CODES: CodeSet,
        Topic.FINDING: Finding,
        Topic.POSE: GridPose,
        Topic.VEHICLE: VehicleState,
        Topic.SETPOINT: AttitudeSetpoint,
        Topic.STATUS: Status,
        Topic.EVENT: Event,
        Topic.COMMAND: Command,
        Topic.FRAME: RecordedFrame,
        Topic.FAILURE: StepFailure,
        Topic.CONFIG: Document,
        Topic.MAP: Document,
        Topic.ORDER: FlightOrder,
        Topic.PLAN: ChosenPlan,
        Topic.LEARNT: LearntSensors,
        Topic.SCENARIO: Document,
        Topic.UNKNOWNS: Document,
    }
)
"""What a topic's messages are decoded to; a topic not named here holds plain JSON objects."""
