"""The mission's transition table: every phase against every trigger, as data.

`TABLE[phase][trigger]` is the next phase; a trigger that a phase does not list leaves it as it is.
Triggers are tried in the order of the enum: what keeps people safe stands first.  What hazards ask for
comes from their own table.
"""

from __future__ import annotations

from collections.abc import Mapping

from flightd.core.types import Phase
from flightd.mission.safety.hazards import ACTIONS, PHASE_OF, Action, triggers_of
from flightd.mission.triggers import Trigger

_SAFETY = {
    trigger: PHASE_OF[ACTIONS[trigger]] for trigger in triggers_of(Action.HANDS_OFF, Action.STOP, Action.LAND)
} | {
    Trigger.DISARMED: Phase.ABORTED,
    Trigger.LAND_HERE: Phase.LAND,
    Trigger.GROUND_LOST: Phase.LAND,
    Trigger.RECORD_LOST: Phase.LAND,
}
_SEEING = _SAFETY | dict.fromkeys(triggers_of(Action.HOLD) | {Trigger.HOLD}, Phase.HOLD)
_ON_LINES = _SEEING | dict.fromkeys(triggers_of(Action.RELOCATE), Phase.RELOCATE)

TABLE: Mapping[Phase, Mapping[Trigger, Phase]] = {
    Phase.PREFLIGHT: {
        Trigger.STOP: Phase.ABORTED,
        Trigger.LAND_HERE: Phase.ABORTED,
        Trigger.FOUND_FLYING: Phase.RECOVER,
        Trigger.READY: Phase.ARMING,
    },
    Phase.RECOVER: _SAFETY | {Trigger.UNATTENDED: Phase.LAND},
    Phase.ARMING: {
        Trigger.STOP: Phase.ABORTED,
        Trigger.LAND_HERE: Phase.ABORTED,
        Trigger.GROUND_LOST: Phase.ABORTED,
        Trigger.TIMED_OUT: Phase.ABORTED,
        Trigger.ARMED: Phase.TAKE_OFF,
    },
    Phase.TAKE_OFF: _SAFETY | {Trigger.TIMED_OUT: Phase.LAND, Trigger.AT_HEIGHT: Phase.ACQUIRE},
    Phase.ACQUIRE: _ON_LINES | {Trigger.TIMED_OUT: Phase.LAND, Trigger.ACQUIRED: Phase.TURN},
    Phase.FOLLOW: _ON_LINES | {Trigger.TIMED_OUT: Phase.LAND, Trigger.ARRIVED: Phase.HOVER},
    Phase.HOVER: _ON_LINES
    | {Trigger.SCAN_DUE: Phase.CLIMB, Trigger.DWELLED: Phase.TURN, Trigger.ROUTE_DONE: Phase.LAND},
    Phase.CLIMB: _ON_LINES | {Trigger.TIMED_OUT: Phase.LAND, Trigger.AT_VIEW: Phase.SCAN},
    Phase.SCAN: _ON_LINES
    | {Trigger.VIEW_DONE: Phase.CLIMB, Trigger.DWELLED: Phase.TURN, Trigger.ROUTE_DONE: Phase.LAND},
    Phase.TURN: _ON_LINES | {Trigger.TIMED_OUT: Phase.LAND, Trigger.TURNED: Phase.FOLLOW},
    Phase.HOLD: _SAFETY
    | {
        Trigger.HAZARD_LASTS: Phase.LAND,
        Trigger.LINES_LOST_LONG: Phase.LAND,
        Trigger.LINES_FOUND: Phase.ACQUIRE,
    },
    Phase.RELOCATE: _SEEING
    | {
        Trigger.POSITION_UNKNOWN: Phase.LAND,
        Trigger.POSITION_SURE: Phase.ACQUIRE,
    },
    Phase.LAND: {
        Trigger.PILOT_TOOK: Phase.PILOT,
        Trigger.DISARMED: Phase.DONE,
        Trigger.DOWN_TO_SWAP: Phase.SWAP,
        Trigger.VANISHED: Phase.ABORTED,
        Trigger.STOP: Phase.LAND,
    },
    Phase.SWAP: {
        Trigger.STOP: Phase.ABORTED,
        Trigger.LAND_HERE: Phase.ABORTED,
        Trigger.TIMED_OUT: Phase.ABORTED,
        Trigger.READY: Phase.ARMING,
    },
    Phase.DONE: {},
    Phase.ABORTED: {},
    Phase.PILOT: {},
}


def next_phase(phase: Phase, triggers: set[Trigger]) -> tuple[Phase, Trigger | None]:
    """The phase that follows and the trigger that made it so (None when nothing changes)."""
    row = TABLE[phase]
    for trigger in Trigger:
        if trigger in triggers and trigger in row:
            return row[trigger], trigger
    return phase, None
