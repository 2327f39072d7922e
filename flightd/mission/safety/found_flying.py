"""The first look at the vehicle: does it fly already?  Then this process was started anew in flight."""

from __future__ import annotations

from flightd.config.mission import MissionConfig
from flightd.core.types import LandedState
from flightd.mission.guidance import MissionInputs


class FoundFlyingCheck:
    """Ask at each tick before the flight.  One that stood when first seen and takes off later is flown by
    somebody else."""

    def __init__(self, params: MissionConfig) -> None:
        self._params = params
        self._stood = False

    def flies_already(self, s: MissionInputs) -> bool:
        """Whether the vehicle has been in the air since it was first heard."""
        v = s.vehicle
        if v is None or s.telemetry_age_s > self._params.telemetry_hold_s:
            return False
        self._stood |= not v.armed or v.landed is LandedState.ON_GROUND
        high = v.landed is LandedState.UNKNOWN and s.height_m > self._params.expert.touch_below_m
        return not self._stood and (high or v.landed is LandedState.IN_AIR)
