"""What goes into the vehicle's state machine and what comes out of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from flightd.fleet.vda5050.codec import MalformedError
from flightd.fleet.vda5050.factsheet import Factsheet
from flightd.fleet.vda5050.order import InstantActions, Order
from flightd.fleet.vda5050.parts import Action, MobileRobotPosition, Velocity
from flightd.fleet.vda5050.state import (
    ActionStatus,
    EmergencyStop,
    Error,
    Info,
    OperatingMode,
    PowerSupply,
    SafetyState,
    State,
)
from flightd.fleet.vehicle.refusals import Refusal

_SAFE: Final = SafetyState(active_emergency_stop=EmergencyStop.NONE, field_violation=False)


@dataclass(frozen=True, slots=True)
class Malformed:
    """A message on the topic `order` or `instantActions` that could not be read."""

    topic: str
    error: MalformedError


@dataclass(frozen=True, slots=True)
class Situation:
    """How the drone is.  `node`: the one that it stands on; `driving`: whether it moves, or turns; `errors`
    and `information` of its own, beside what is said of orders."""

    mode: OperatingMode
    driving: bool
    power: PowerSupply
    node: str | None = None
    position: MobileRobotPosition | None = None
    velocity: Velocity | None = None
    safety: SafetyState = _SAFE
    errors: tuple[Error, ...] = ()
    information: tuple[Info, ...] = ()


@dataclass(frozen=True, slots=True)
class Reached:
    """The drone is at a node."""

    node: str


@dataclass(frozen=True, slots=True)
class Progress:
    """How far an action is that was begun."""

    action_id: str
    status: ActionStatus
    result: str | None = None


Said = Order | InstantActions | Malformed
"""What a fleet control says."""


@dataclass(frozen=True, slots=True)
class Missed:
    """A message that is not obeyed, whatever else holds: it is refused, unless it is here already."""

    message: Order | InstantActions
    refusal: Refusal


Input = Said | Missed | Situation | Reached | Progress


@dataclass(frozen=True, slots=True)
class Stop:
    """A node of the way."""

    node: str
    sequence_id: int


@dataclass(frozen=True, slots=True)
class Fly:
    """Fly along these nodes and hold at the last; it takes the place of what was said before."""

    stops: tuple[Stop, ...]


@dataclass(frozen=True, slots=True)
class Hold:
    """Stop where the drone is."""


@dataclass(frozen=True, slots=True)
class Begin:
    """Do an action, here."""

    action: Action


@dataclass(frozen=True, slots=True)
class Abort:
    """Leave an action off."""

    action_id: str


@dataclass(frozen=True, slots=True)
class PauseAction:
    """Hold an action until it is resumed."""

    action_id: str


@dataclass(frozen=True, slots=True)
class ResumeAction:
    """Go on with a paused action."""

    action_id: str


@dataclass(frozen=True, slots=True)
class Decided:
    """An order or an instant action is taken; or refused, and why."""

    about: Order | Action
    refusal: Refusal | None = None


Output = Fly | Hold | Begin | Abort | PauseAction | ResumeAction | Decided | State | Factsheet
