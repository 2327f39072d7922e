"""What of the hazards that were found is told to people.  Pure."""

from __future__ import annotations

from collections.abc import Set as AbstractSet

from flightd.config.hazards import LossAction
from flightd.core.types import Phase
from flightd.mission.event_log import EventLog
from flightd.mission.machine import State, taken_in
from flightd.mission.safety.hazard_table import ACTIONS, Action, triggers_of
from flightd.mission.triggers import Trigger

NEAR_FLOOR = frozenset({Phase.TAKE_OFF, Phase.LAND})
"""Where lines come and go."""
_RANK = {trigger: rank for rank, trigger in enumerate(Trigger)}


class HazardReporter:
    """Reports hazards as events, each with the action taken for it."""

    def __init__(self, events: EventLog) -> None:
        self._events = events

    def report(self, now_ns: int, triggers: AbstractSet[Trigger], state: State) -> None:
        """The hazards among the triggers of a tick, as far as they decide anything in this state."""
        reported = triggers & ACTIONS.keys()
        if not state.airborne:  # on the ground only what decides something there is worth reporting
            reported &= taken_in(state)
        elif state.phase in NEAR_FLOOR:
            reported &= taken_in(state) | triggers_of(Action.REPORT, Action.HOME)
        for trigger in sorted(reported, key=_RANK.__getitem__):
            self._events.hazard(now_ns, trigger, ACTIONS[trigger].value)

    def report_loss(self, now_ns: int, lost: Trigger, action: LossAction, state: State) -> None:
        """Something that flying itself does not need, with its configured action."""
        if state.airborne or (not state.over and action is not LossAction.CONTINUE):
            self._events.hazard(now_ns, lost, action.value)
