"""Why a MAVLink autopilot is not flown, or does not do what it was asked."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from flightd.adapters.vehicle.mavlink.parameter_rule import ParameterFinding, Read, Rule, judge
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
class ParametersUnread(Refusal):
    """The autopilot's parameters are being read."""

    def __str__(self) -> str:
        return "its parameters are still being read"


@dataclass(frozen=True, slots=True)
class WrongParameter(Refusal):
    """A parameter that is unsafe or wrong for this job."""

    finding: ParameterFinding

    def __str__(self) -> str:
        by_doctor = self.finding.better is not None
        remedy = "flightd doctor --fix sets it" if by_doctor else "choose it yourself, in a ground station"
        return f"{self.finding} ({remedy})"


def not_set_up(
    way_down: Sequence[Rule], rules: Sequence[Rule], read: Read, *, examined: bool
) -> Refusal | None:
    """Why a vehicle must not be armed, by what is `read` of its parameters; None where it may.  Those of the
    `way_down` have to be known, of the others what is answered until the vehicle is `examined`."""
    for rule in way_down:
        if read(rule.names) is None and not rule.optional:
            return ParameterUnread(rule.names[0])
    problem = _wrong_parameter(way_down, read)
    if problem is None and not examined:
        return ParametersUnread()
    return problem or _wrong_parameter(rules, read)


def _wrong_parameter(rules: Sequence[Rule], read: Read) -> Refusal | None:
    """The first that is unsafe or wrong, of those that were read; None where there is none."""
    findings = (judge(rule, read(rule.names)) for rule in rules)
    found = next((finding for finding in findings if finding is not None), None)
    return None if found is None else WrongParameter(found)


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
class FarFromOrigin(Refusal):
    """The compass does not agree with the earth's field at an origin that nobody has chosen."""

    refusal: Refusal

    def __str__(self) -> str:
        origin = "vehicle.origin_deg is the shipped default: set it to the hall's latitude and longitude"
        return f"{self.refusal}; {origin}"


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
