"""The operator's orders that stand until they are obeyed or taken back.  Pure."""

from __future__ import annotations

import math

from flightd.config.mission import MissionConfig
from flightd.core.types import Command, CommandKind
from flightd.mission.machine import State
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


def refusal(command: Command, state: State) -> str:
    """Why an order that means nothing in this state has no effect, in words."""
    ordered = f"{command.kind.value} {command.node}".strip()
    if command.kind in {CommandKind.HOME, CommandKind.GOTO} and not state.airborne:
        return f"{command.kind.value} refused: the drone does not fly"
    if command.kind is CommandKind.GOTO and state.returning:
        return f"{ordered} refused: on the way home"
    return f"{ordered} refused: not in phase {state.phase.value}"


class StartOrder:
    """A start command: counted down, and void a while after, so that it never arms by surprise."""

    def __init__(self, params: MissionConfig) -> None:
        self._countdown_s = 0.0
        self._expires_s = params.expert.start_expires_s
        self._given_ns: int | None = None

    def give(self, now_ns: int, countdown_s: float) -> None:
        """The command comes, to be counted down for so long; again, it changes nothing."""
        if self._given_ns is None:
            self._given_ns, self._countdown_s = now_ns, countdown_s

    def withdraw(self) -> None:
        """It stands no longer."""
        self._given_ns = None

    @property
    def given(self) -> bool:
        """A command stands."""
        return self._given_ns is not None

    def left_s(self, now_ns: int) -> int:
        """Whole seconds of the count-down that are left; 0 when it is over, and without a command."""
        return 0 if self._given_ns is None else max(math.ceil(self._countdown_s - self._age_s(now_ns)), 0)

    def is_void(self, now_ns: int) -> bool:
        """It has not armed in time."""
        return self.given and self._age_s(now_ns) > self._countdown_s + self._expires_s

    def _age_s(self, now_ns: int) -> float:
        return (now_ns - (self._given_ns or now_ns)) * 1e-9
