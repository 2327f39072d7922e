"""Why an AR.Drone does not do what is demanded, and why it ended a flight by itself."""

from __future__ import annotations

from dataclasses import dataclass

from flightd.adapters.vehicle.ardrone.navdata import DroneState
from flightd.core.refusal import Refusal

EMERGENCY_CAUSES = {
    DroneState.CUTOUT: "cut-out, a propeller was blocked",
    DroneState.ANGLES_OUT_OF_RANGE: "tilted too far",
    DroneState.MOTORS: "motor problem",
    DroneState.SOFTWARE_FAULT: "software fault",
    DroneState.VBAT_LOW: "battery low",
    DroneState.USER_EMERGENCY_LANDING: "emergency landing by the user",
}


@dataclass(frozen=True, slots=True)
class Emergency(Refusal):
    """The motors are cut.  `state` holds the bits of the causes, `in_flight` says that it ended a flight."""

    state: DroneState
    in_flight: bool = False

    def __str__(self) -> str:
        causes = ", ".join(text for bit, text in EMERGENCY_CAUSES.items() if self.state & bit)
        return f"emergency{' in flight' if self.in_flight else ''}: {causes or 'cause not told'}"


@dataclass(frozen=True, slots=True)
class NoNavdata(Refusal):
    def __str__(self) -> str:
        return "no navdata from the drone"


@dataclass(frozen=True, slots=True)
class DisarmInFlight(Refusal):
    def __str__(self) -> str:
        return "disarming in the air would drop the drone: land first"


@dataclass(frozen=True, slots=True)
class NotConfigured(Refusal):
    def __str__(self) -> str:
        return "the drone is still being configured"


@dataclass(frozen=True, slots=True)
class KeepsValue(Refusal):
    """The drone was told a value of its configuration, and has another one in force."""

    key: str
    found: str
    wanted: str

    def __str__(self) -> str:
        return f"the drone keeps {self.key} = {self.found or '(no such key)'} instead of {self.wanted}"


@dataclass(frozen=True, slots=True)
class StaysLanded(Refusal):
    """Take-off was ordered for longer than it takes."""

    battery_percent: int

    def __str__(self) -> str:
        battery = f"battery at {self.battery_percent} %"
        return f"the drone stays landed and does not say why; {battery} (below about 20 % it refuses)"


@dataclass(frozen=True, slots=True)
class LinkLost(Refusal):
    silent_s: float

    def __str__(self) -> str:
        return f"no navdata for {self.silent_s:g} s in flight: landing"


@dataclass(frozen=True, slots=True)
class LandedByItself(Refusal):
    battery_percent: int

    def __str__(self) -> str:
        return f"the drone landed by itself, battery at {self.battery_percent} %"


@dataclass(frozen=True, slots=True)
class Unattended(Refusal):
    """It was found flying, and nobody demanded anything for so long."""

    waited_s: float

    def __str__(self) -> str:
        return f"found flying, nothing demanded for {self.waited_s:g} s: landing"
