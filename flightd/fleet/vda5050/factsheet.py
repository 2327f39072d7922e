"""What a type of vehicle is and can do."""

from __future__ import annotations

import enum
from typing import Any

import msgspec

from flightd.fleet.vda5050.parts import BlockingType, Header, NotNegative, Part, Percent, UInt32


class TypeSpecification(Part, frozen=True):
    """Kinds by the words of version 3.0, which may be other words than the standard's."""

    series_name: str
    mobile_robot_kinematics: str
    mobile_robot_class: str
    maximum_load_mass: NotNegative
    localization_types: list[str]
    navigation_types: list[str]
    series_description: str | None = None
    supported_zones: list[str] | None = None


class PhysicalParameters(Part, frozen=True):
    """Speeds and measures."""

    minimum_speed: NotNegative
    maximum_speed: NotNegative
    maximum_acceleration: NotNegative
    maximum_deceleration: float
    minimum_height: float
    maximum_height: float
    width: float
    length: float
    minimum_angular_speed: NotNegative | None = None
    maximum_angular_speed: NotNegative | None = None


class StringLengths(Part, frozen=True):
    """At most so many characters; None: any number."""

    maximum_message_length: UInt32 | None = None
    maximum_topic_serial_length: UInt32 | None = None
    maximum_topic_element_length: UInt32 | None = None
    maximum_id_length: UInt32 | None = None
    id_numerical_only: bool | None = None
    maximum_load_id_length: UInt32 | None = None


class Timing(Part, frozen=True):
    """Seconds between messages."""

    minimum_order_interval: NotNegative
    minimum_state_interval: NotNegative
    default_state_interval: NotNegative | None = None
    visualization_interval: NotNegative | None = None


class ProtocolLimits(Part, frozen=True):
    """`maximum_array_lengths` by the full names of the lists, as in order.nodes."""

    maximum_string_lengths: StringLengths
    maximum_array_lengths: dict[str, UInt32]
    timing: Timing


class Support(enum.StrEnum):
    """How an optional parameter is taken."""

    SUPPORTED = "SUPPORTED"
    REQUIRED = "REQUIRED"


class OptionalParameter(Part, frozen=True):
    """By its full name, as in order.edges.maximumSpeed."""

    parameter: str
    support: Support
    description: str | None = None


class ActionScope(enum.StrEnum):
    """Where an action can be asked for."""

    INSTANT = "INSTANT"
    NODE = "NODE"
    EDGE = "EDGE"
    ZONE = "ZONE"


class ValueType(enum.StrEnum):
    """Of a parameter."""

    BOOL = "BOOL"
    NUMBER = "NUMBER"
    INTEGER = "INTEGER"
    STRING = "STRING"
    OBJECT = "OBJECT"
    ARRAY = "ARRAY"


class KnownParameter(Part, frozen=True):
    """A parameter of an action."""

    key: str
    value_data_type: ValueType
    description: str | None = None
    is_optional: bool | None = None


class KnownAction(Part, frozen=True):
    """An action that the vehicle can do."""

    action_type: str
    action_scopes: list[ActionScope]
    pause_allowed: bool
    cancel_allowed: bool
    action_description: str | None = None
    action_parameters: list[KnownParameter] | None = None
    action_result: str | None = None
    blocking_types: list[BlockingType] | None = None


class ProtocolFeatures(Part, frozen=True):
    """What of the protocol the vehicle can do."""

    optional_parameters: list[OptionalParameter]
    mobile_robot_actions: list[KnownAction]


class Vertex(Part, frozen=True):
    """Of an outline."""

    x: float
    y: float


class Envelope2d(Part, frozen=True):
    """An outline seen from above."""

    envelope_id: str = msgspec.field(name="envelope2dId")
    vertices: list[Vertex]
    description: str | None = None


class Geometry(Part, frozen=True):
    """The vehicle's outlines."""

    envelopes2d: list[Envelope2d] | None = None


class LoadSpecification(Part, frozen=True):
    """A drone carries nothing."""

    load_positions: list[str] | None = None


class VersionInfo(Part, frozen=True):
    """A version of a part of the vehicle."""

    key: str
    value: str


class BatteryCharging(Part, frozen=True):
    """Percent of charge, and seconds."""

    critical_low_charging_level: Percent | None = None
    minimum_desired_charging_level: Percent | None = None
    maximum_desired_charging_level: Percent | None = None
    minimum_charging_time: NotNegative | None = None


class Configuration(Part, frozen=True):
    """How the vehicle is set up."""

    versions: list[VersionInfo] | None = None
    network: dict[str, Any] | None = None
    battery_charging: BatteryCharging | None = None


class Factsheet(Header, frozen=True):
    """A type of vehicle."""

    type_specification: TypeSpecification
    physical_parameters: PhysicalParameters
    protocol_limits: ProtocolLimits
    protocol_features: ProtocolFeatures
    mobile_robot_geometry: Geometry
    load_specification: LoadSpecification
    mobile_robot_configuration: Configuration | None = None
