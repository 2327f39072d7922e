"""What version 3.0 does otherwise than the model, which has its names."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from flightd.fleet.vda5050.order import InstantActions, Order
from flightd.fleet.vda5050.parts import Header
from flightd.fleet.vda5050.renaming import Key, Object, Table
from flightd.fleet.vda5050.state import State


def _rotation(edge: Object) -> Object:
    """The document says maximumRotationSpeed, its schema maxRotationSpeed: both are read."""
    told = {**edge}
    if "maximumRotationSpeed" in told:
        told.setdefault("maxRotationSpeed", told.pop("maximumRotationSpeed"))
    return told


def _never_blocking(_value: Any) -> str:
    return "NONE"


# whole numbers by the document, though not by the schema
_POWER: Final = Table(
    {"batteryHealth": Key("batteryHealth", None, round), "range": Key("range", None, round)}
)
TABLES: Final[Mapping[type[Header], Table]] = {
    Order: Table({"edges": Key("edges", Table(start=_rotation))}),
    State: Table({"powerSupply": Key("powerSupply", _POWER)}),
    InstantActions: Table(
        {
            "actions": Key(
                "actions",
                Table({"blockingType": Key("blockingType", None, _never_blocking), "retriable": Key(None)}),
            )
        }
    ),
}
