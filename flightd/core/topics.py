"""The flight log's topics: one name and one message type for each, shared by who writes and who reads."""

from __future__ import annotations

import enum
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from flightd.core.flight_order import FlightOrder
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
    """Names of the streams in `flight.mcap`; TRUTH, UNKNOWNS, FAULT and ARMED are in the simulator's
    `truth.mcap`.

    TICK and DECISION are all that the pilot was given and all that it answered (`core.tick.TickInput`,
    `core.tick.TickOutput`), so that a flight can be replayed; FAILURE is what a tick raised;
    the others are for people and their tools.
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
    LEARNT = "/learnt"
    TRUTH = "/truth"
    SCENARIO = "/scenario"
    FAULT = "/fault"
    ARMED = "/armed"
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


FOR_PEOPLE = frozenset(Topic) - {Topic.FRAME, Topic.TICK, Topic.DECISION}
"""All but the pictures and what only a replay needs."""

RETAINED = frozenset({Topic.CONFIG, Topic.MAP, Topic.ORDER, Topic.LEARNT, Topic.SCENARIO})
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
        Topic.LEARNT: LearntSensors,
        Topic.SCENARIO: Document,
        Topic.UNKNOWNS: Document,
    }
)
"""What a topic's messages are decoded to; a topic not named here holds plain JSON objects."""
