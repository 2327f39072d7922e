"""What a vehicle tells of itself all the time: connection, state, visualization."""

from __future__ import annotations

import enum

from flightd.fleet.vda5050.parts import (
    Angle,
    Header,
    MobileRobotPosition,
    NotNegative,
    Part,
    Percent,
    Trajectory,
    UInt32,
    Velocity,
)


class ConnectionState(enum.StrEnum):
    """Of the link to the broker; CONNECTION_BROKEN is said by the broker."""

    ONLINE = "ONLINE"
    OFFLINE = "OFFLINE"
    HIBERNATING = "HIBERNATING"
    CONNECTION_BROKEN = "CONNECTION_BROKEN"


class Connection(Header, frozen=True):
    """Whether a vehicle is there."""

    connection_state: ConnectionState


class MapStatus(enum.StrEnum):
    """Whether orders may use a map."""

    ENABLED = "ENABLED"
    DISABLED = "DISABLED"


class MapState(Part, frozen=True):
    """A map that the vehicle has."""

    map_id: str
    map_version: str
    map_status: MapStatus
    map_descriptor: str | None = None


class StatePosition(Part, frozen=True):
    """Where a node that is ahead lies."""

    x: float
    y: float
    map_id: str
    theta: Angle | None = None


class NodeState(Part, frozen=True):
    """A node that is ahead."""

    node_id: str
    sequence_id: UInt32
    released: bool
    node_descriptor: str | None = None
    node_position: StatePosition | None = None


class EdgeState(Part, frozen=True):
    """An edge that is ahead, or that the vehicle is on."""

    edge_id: str
    sequence_id: UInt32
    released: bool
    edge_descriptor: str | None = None
    trajectory: Trajectory | None = None


class ActionStatus(enum.StrEnum):
    """How far an action is."""

    WAITING = "WAITING"
    INITIALIZING = "INITIALIZING"
    RUNNING = "RUNNING"
    PAUSED = "PAUSED"
    RETRIABLE = "RETRIABLE"
    FINISHED = "FINISHED"
    FAILED = "FAILED"

    @property
    def is_over(self) -> bool:
        """Whether nothing more comes of it."""
        return self in {ActionStatus.FINISHED, ActionStatus.FAILED}


class ActionState(Part, frozen=True):
    """An action by its id, and how far it is."""

    action_id: str
    action_status: ActionStatus
    action_type: str | None = None
    action_descriptor: str | None = None
    action_result: str | None = None


class PowerSupply(Part, frozen=True):
    """Of the battery: percent, volts, amperes; `range` is how far it takes the vehicle."""

    state_of_charge: Percent
    charging: bool
    battery_voltage: float | None = None
    battery_current: float | None = None
    battery_health: Percent | None = None
    range: NotNegative | None = None


class OperatingMode(enum.StrEnum):
    """Who is in control."""

    STARTUP = "STARTUP"
    AUTOMATIC = "AUTOMATIC"
    SEMIAUTOMATIC = "SEMIAUTOMATIC"
    INTERVENED = "INTERVENED"
    MANUAL = "MANUAL"
    SERVICE = "SERVICE"
    TEACH_IN = "TEACH_IN"


class Reference(Part, frozen=True):
    """What an error or a piece of information is about."""

    reference_key: str
    reference_value: str


class ErrorLevel(enum.StrEnum):
    """WARNING and URGENT go on; CRITICAL ends what is done now, FATAL wants a person."""

    WARNING = "WARNING"
    URGENT = "URGENT"
    CRITICAL = "CRITICAL"
    FATAL = "FATAL"


class Translation(Part, frozen=True):
    """A text in a language, ISO 639-1."""

    translation_key: str
    translation_value: str


class Error(Part, frozen=True):
    """What is wrong; `error_type` is a predefined name (`errors.ErrorType`) or one of the maker's."""

    error_type: str
    error_level: ErrorLevel
    error_references: list[Reference] | None = None
    error_description: str | None = None
    error_description_translations: list[Translation] | None = None
    error_hint: str | None = None
    error_hint_translations: list[Translation] | None = None


class InfoLevel(enum.StrEnum):
    """For whom a piece of information is."""

    INFO = "INFO"
    DEBUG = "DEBUG"


class Info(Part, frozen=True):
    """For people to see; nothing is decided by it."""

    info_type: str
    info_level: InfoLevel
    info_references: list[Reference] | None = None
    info_descriptor: str | None = None


class EmergencyStop(enum.StrEnum):
    """Who has to release an emergency stop."""

    MANUAL = "MANUAL"
    REMOTE = "REMOTE"
    NONE = "NONE"


class SafetyState(Part, frozen=True):
    """Of the safety functions."""

    active_emergency_stop: EmergencyStop
    field_violation: bool


class State(Header, frozen=True):
    """Everything that a fleet control decides by."""

    order_id: str
    order_update_id: UInt32
    last_node_id: str
    last_node_sequence_id: UInt32
    node_states: list[NodeState]
    edge_states: list[EdgeState]
    driving: bool
    action_states: list[ActionState]
    instant_action_states: list[ActionState]
    power_supply: PowerSupply
    operating_mode: OperatingMode
    errors: list[Error]
    safety_state: SafetyState
    maps: list[MapState] | None = None
    mobile_robot_position: MobileRobotPosition | None = None
    velocity: Velocity | None = None
    paused: bool | None = None
    new_base_request: bool | None = None
    distance_since_last_node: float | None = None
    information: list[Info] | None = None


class Visualization(Header, frozen=True):
    """Where a vehicle is, more often than its state."""

    reference_state_header_id: UInt32
    mobile_robot_position: MobileRobotPosition | None = None
    velocity: Velocity | None = None
