"""The operator's orders that stand until they are obeyed or taken back.  Pure."""

from __future__ import annotations

from flightd.core.types import CommandKind
from flightd.mission.triggers import Trigger

_URGENT = {CommandKind.LAND: Trigger.LAND_HERE, CommandKind.STOP: Trigger.STOP}


class StandingOrders:
    """A pause until the flight is resumed or turns back, a landing or stop until the mission has acted; a
    landing does not take back a stop."""

    def __init__(self) -> None:
        self.paused = False
        self._urgent: Trigger | None = None

    def take(self, kind: CommandKind) -> None:
        """Let an order stand; those that are obeyed at once do not."""
        if kind in {CommandKind.PAUSE, CommandKind.RESUME}:
            self.paused = kind is CommandKind.PAUSE
        elif kind in _URGENT and self._urgent is not Trigger.STOP:
            self._urgent = _URGENT[kind]

    def acted_on(self, trigger: Trigger) -> None:
        """The mission has begun a phase for this."""
        self._urgent = None if trigger is self._urgent else self._urgent

    @property
    def urgent(self) -> set[Trigger]:
        """The landing or stop that stands."""
        return set() if self._urgent is None else {self._urgent}
