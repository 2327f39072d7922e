"""The factsheet of a drone that flies along painted lines."""

from __future__ import annotations

from dataclasses import dataclass

from flightd import __version__
from flightd.fleet.vda5050.factsheet import (
    Configuration,
    Envelope2d,
    Factsheet,
    Geometry,
    LoadSpecification,
    OptionalParameter,
    PhysicalParameters,
    ProtocolFeatures,
    ProtocolLimits,
    StringLengths,
    Support,
    Timing,
    TypeSpecification,
    VersionInfo,
    Vertex,
)
from flightd.fleet.vehicle.abilities import known_actions

_USED = (
    "order.nodes.nodePosition",
    "order.nodes.nodePosition.allowedDeviationXY",
)


@dataclass(frozen=True, slots=True)
class Measures:
    """Of a drone: speeds, what it stops by, and its body with the propellers."""

    max_speed_mps: float
    max_acceleration_mps2: float
    max_deceleration_mps2: float
    length_m: float
    width_m: float
    height_m: float


def drone_factsheet(series: str, measures: Measures) -> Factsheet:
    """What is known of the type; the header is put on when it is sent."""
    half_x, half_y = measures.length_m / 2, measures.width_m / 2
    corners = [(half_x, half_y), (-half_x, half_y), (-half_x, -half_y), (half_x, -half_y)]
    return Factsheet(
        header_id=0,
        timestamp="",
        version="",
        manufacturer="",
        serial_number="",
        type_specification=TypeSpecification(
            series_name=series,
            series_description="Camera drone that flies along painted lines and counts shelves",
            mobile_robot_kinematics="OMNIDIRECTIONAL",
            mobile_robot_class="DRONE",
            maximum_load_mass=0.0,
            localization_types=["GRID"],
            navigation_types=["PHYSICAL_LINE_GUIDED"],
        ),
        physical_parameters=PhysicalParameters(
            minimum_speed=0.0,
            maximum_speed=measures.max_speed_mps,
            maximum_acceleration=measures.max_acceleration_mps2,
            maximum_deceleration=measures.max_deceleration_mps2,
            minimum_height=measures.height_m,
            maximum_height=measures.height_m,
            width=measures.width_m,
            length=measures.length_m,
        ),
        protocol_limits=ProtocolLimits(
            maximum_string_lengths=StringLengths(),
            maximum_array_lengths={},
            timing=Timing(minimum_order_interval=0.0, minimum_state_interval=0.0),
        ),
        protocol_features=ProtocolFeatures(
            optional_parameters=[
                OptionalParameter(parameter=name, support=Support.SUPPORTED) for name in _USED
            ],
            mobile_robot_actions=known_actions(),
        ),
        mobile_robot_geometry=Geometry(
            envelopes2d=[Envelope2d(envelope_id="body", vertices=[Vertex(x=x, y=y) for x, y in corners])]
        ),
        load_specification=LoadSpecification(),
        mobile_robot_configuration=Configuration(versions=[VersionInfo(key="flightd", value=__version__)]),
    )
