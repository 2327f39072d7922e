"""Why a MAVLink autopilot is not flown, or does not do what it was asked."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from flightd.adapters.vehicle.mavlink.required_parameters import Names, ParameterFinding, Rule, judge
from flightd.adapters.vehicle.mavlink.services.commands import Answer
from flightd.core.refusal import Refusal


@dataclass(frozen=True, slots=True)
class WrongFirmware(Refusal):
    """Names as configuration and documents have them."""

    found: str
    configured: str

    def __str__(self) -> str:
        return f"the autopilot is {self.found}, the configuration says {self.configured}"


@dataclass(frozen=True, slots=True)
class WrongSystemId(Refusal):
    found: int
    configured: int

    def __str__(self) -> str:
        return f"the vehicle's system id is {self.found}, the configuration says {self.configured}"


@dataclass(frozen=True, slots=True)
class BeyondLibrary(Refusal):
    """MAVSDK flies one firmware here, and this is another."""

    found: str

    def __str__(self) -> str:
        return f"the autopilot is {self.found}: MAVSDK flies PX4 only, use vehicle.kind"


@dataclass(frozen=True, slots=True)
class ParameterUnread(Refusal):
    name: str

    def __str__(self) -> str:
        return f"{self.name} not read yet"


@dataclass(frozen=True, slots=True)
class SharedSystemId(Refusal):
    """Another sender's heartbeats would keep the vehicle in the air if this computer died."""

    own_system_id: int

    def __str__(self) -> str:
        return f"somebody else sends heartbeats as system {self.own_system_id} (vehicle.own_system_id)"


@dataclass(frozen=True, slots=True)
class NoWayDown(Refusal):
    """A parameter by which the vehicle would stay in the air if this computer died."""

    finding: ParameterFinding

    def __str__(self) -> str:
        return f"{self.finding} (flightd doctor --fix sets it)"


def no_way_down(rules: Sequence[Rule], read: Callable[[Names], tuple[str, float] | None]) -> Refusal | None:
    """Why the vehicle would stay in the air if this computer died, by what is `read` of its parameters; None
    where it would land."""
    for rule in rules:
        found = read(rule.names)
        if found is None and rule.optional:
            continue
        if found is None:
            return ParameterUnread(rule.names[0])
        if finding := judge(rule, found):
            return NoWayDown(finding)
    return None


@dataclass(frozen=True, slots=True)
class ThrustMismatch(Refusal):
    """What the autopilot takes the thrust field for is not what the configuration says it does."""

    raw: bool

    def __str__(self) -> str:
        state = "set" if self.raw else "not set"
        return f"bit 3 of GUID_OPTIONS is {state}, against vehicle.raw_thrust: see flightd doctor"


@dataclass(frozen=True, slots=True)
class CommandRefused(Refusal):
    """The autopilot's answer to a command."""

    command: str
    answer: Answer

    def __str__(self) -> str:
        return f"{self.command}: {self.answer}"


@dataclass(frozen=True, slots=True)
class ExplainedRefusal(Refusal):
    """A refusal with what the autopilot said at that time."""

    refusal: Refusal
    said: str

    def __str__(self) -> str:
        return f"{self.refusal} ({self.said})"


@dataclass(frozen=True, slots=True)
class TakenOver(Refusal):
    """The vehicle is in a mode that we did not ask for."""

    def __str__(self) -> str:
        return "the pilot or a failsafe changed the mode"


@dataclass(frozen=True, slots=True)
class OffFloor(Refusal):
    """A vehicle at this height (NaN: not known) is not disarmed."""

    height_m: float

    def __str__(self) -> str:
        where = "nobody says that it stands" if math.isnan(self.height_m) else f"{self.height_m:.1f} m high"
        return f"disarming: {where}"
