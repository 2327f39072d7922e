"""Which airframe flies: our own, or RotorPy's."""

from __future__ import annotations

import enum

from flightd.sim.plant.airframe import Airframe


class PlantKind(enum.StrEnum):
    """Whose airframe it is."""

    OWN = "own"
    ROTORPY = "rotorpy"


def airframe_kind(kind: PlantKind) -> type[Airframe]:
    """Its class."""
    if kind is PlantKind.OWN:
        return Airframe
    from flightd.sim.plant.rotorpy_airframe import RotorpyAirframe  # noqa: PLC0415 - slow, and of an extra

    return RotorpyAirframe
