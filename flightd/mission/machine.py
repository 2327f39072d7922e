"""The mission as a machine: what it does (phase), what for (intent), and what each event makes of that.

`TABLE[state][trigger]` is defined for every state and every trigger.  A trigger either means nothing there
(`STAYS`), or turns the intent of the phase in hand, or begins a phase, maybe the same one anew.  `next_state`
chooses among all that happens at one tick what begins a phase: triggers are tried in the order of the enum,
what keeps people safe first.  What turns an intent is taken as it happens.  What hazards ask for comes from
their own table.
"""

from __future__ import annotations

import enum
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import cache

from flightd.core.types import OVER, WAITING, CommandKind, Phase
from flightd.mission.safety.hazard_table import ACTIONS, PHASE_OF, Action, triggers_of
from flightd.mission.triggers import Trigger


class Intent(enum.Enum):
    """What a phase is for, and so what follows when it is over."""

    __hash__ = object.__hash__  # as for a trigger

    WAIT = "wait for the order to start"
    VISIT = "fly the plan, and land on its pad"
    RETURN = "to a charge pad, and on from there with a fresh battery"
    HOME = "to a pad before the plan was flown: the mission ends there"
    END = "down where it is: the mission is over"
    STOP = "down at once, level, neither steering nor braking"
    ADOPTED = "found flying, where is not known: level, then down"
    ADOPTED_STOP = "found flying, and down at once"


_ON_GROUND = OVER | {Phase.PREFLIGHT, Phase.ARMING, Phase.SWAP}
_HALTED = frozenset({Phase.HOLD, Phase.RELOCATE})
FLYING = (
    Phase.TAKE_OFF, Phase.ACQUIRE, Phase.FOLLOW, Phase.HOVER, Phase.TURN, Phase.CLIMB, Phase.SCAN, Phase.HOLD,
    Phase.RELOCATE,
)  # fmt: skip
"""The phases on the way, in which the route may still be changed."""
_ON_WAY = (Intent.VISIT, Intent.RETURN, Intent.HOME)
_BACK = (Intent.RETURN, Intent.HOME)
_ADOPTED = (Intent.ADOPTED, Intent.ADOPTED_STOP)
"""Of a vehicle found flying at a restart."""
_STOPPED = (Intent.STOP, Intent.ADOPTED_STOP)

_INTENTS: Mapping[Phase, tuple[Intent, ...]] = {
    Phase.PREFLIGHT: (Intent.WAIT, Intent.VISIT),
    Phase.RECOVER: (Intent.ADOPTED,),
    Phase.ARMING: (Intent.VISIT,),
    **dict.fromkeys(FLYING, _ON_WAY),
    Phase.LAND: (*_ON_WAY, Intent.END, Intent.STOP, *_ADOPTED),
    Phase.SWAP: (Intent.WAIT, Intent.VISIT),
    **dict.fromkeys(OVER, (Intent.END,)),
}


@dataclass(frozen=True, slots=True)
class State:
    """A phase and its intent; ValueError for two that never go together."""

    phase: Phase
    intent: Intent

    def __post_init__(self) -> None:
        if self.intent not in _INTENTS[self.phase]:
            raise ValueError(f"no phase {self.phase} to {self.intent.value}")

    @property
    def airborne(self) -> bool:
        """The mission believes the drone to fly and answers for it."""
        return self.phase not in _ON_GROUND

    @property
    def over(self) -> bool:
        """Nothing leads on from here."""
        return self.phase in OVER

    @property
    def waiting(self) -> bool:
        """On the floor before a flight."""
        return self.phase in WAITING

    @property
    def returning(self) -> bool:
        """On the way to a pad, or where the way is not known: nothing on it is visited."""
        return self.intent in _BACK or self.intent in _ADOPTED

    @property
    def on_pad(self) -> bool:
        """Coming down on the pad of the stop that was flown to."""
        return self.phase is Phase.LAND and self.intent in _ON_WAY

    @property
    def halted(self) -> bool:
        """Interrupted in the air, where it is, until that is over."""
        return self.phase in _HALTED

    @property
    def stopped(self) -> bool:
        """Neither steers nor brakes nor waits."""
        return self.intent in _STOPPED

    @property
    def adopted(self) -> bool:
        """Found flying: where it is, and so where it may go, is not known."""
        return self.intent in _ADOPTED


STATES = tuple(State(phase, intent) for phase in Phase for intent in _INTENTS[phase])
"""All there are; every other pair of phase and intent is refused by `State`."""
BEGIN = State(Phase.PREFLIGHT, Intent.WAIT)


class Cause(enum.Enum):
    """What the mission then gives as its reason."""

    TRIGGER = "what has just happened"
    KEPT = "what it gave before"
    LANDED = "it stands where it should"


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a trigger makes of a state.  `begins`: a phase begins with it; otherwise the one in hand goes on,
    and where `state` is the one before, too, the trigger is taken and acts by other means than the state."""

    state: State
    begins: bool
    cause: Cause


STAYS = None
"""The trigger means nothing in that state."""

_SAFETY = {
    trigger: PHASE_OF[ACTIONS[trigger]] for trigger in triggers_of(Action.HANDS_OFF, Action.STOP, Action.LAND)
} | {
    Trigger.DISARMED: Phase.ABORTED,
    Trigger.LAND_HERE: Phase.LAND,
    Trigger.GROUND_LOST: Phase.LAND,
    Trigger.BATTERY_UNKNOWN: Phase.LAND,
    Trigger.RECORD_LOST: Phase.LAND,
    Trigger.AISLE_OPEN: Phase.LAND,
}
_UNDER_WAY = _SAFETY | {Trigger.TIMED_OUT: Phase.LAND}
_SEEING = _UNDER_WAY | dict.fromkeys(triggers_of(Action.HOLD) | {Trigger.HOLD}, Phase.HOLD)
_ON_LINES = _SEEING | dict.fromkeys(triggers_of(Action.RELOCATE), Phase.RELOCATE)
_GIVEN_UP = dict.fromkeys((Trigger.STOP, Trigger.LAND_HERE, Trigger.STEP_FAILED), Phase.ABORTED)

_BEGINS: Mapping[Phase, Mapping[Trigger, Phase]] = {
    Phase.PREFLIGHT: _GIVEN_UP | {Trigger.FOUND_FLYING: Phase.RECOVER, Trigger.READY: Phase.ARMING},
    Phase.RECOVER: _SAFETY | {Trigger.UNATTENDED: Phase.LAND},
    Phase.ARMING: _GIVEN_UP
    | {
        Trigger.GROUND_LOST: Phase.ABORTED,
        Trigger.AISLE_OPEN: Phase.ABORTED,
        Trigger.TIMED_OUT: Phase.ABORTED,
        Trigger.START_EXPIRED: Phase.PREFLIGHT,
        Trigger.PAUSE: Phase.PREFLIGHT,
        Trigger.ARMED: Phase.TAKE_OFF,
    },
    Phase.TAKE_OFF: _UNDER_WAY
    | dict.fromkeys(
        (
            Trigger.HEIGHT_WRONG,
            Trigger.CLOCK_UNSURE,
            Trigger.CAMERA_FROZEN,
            Trigger.CAMERA_BLIND,
            Trigger.FRAMES_STALE,
            Trigger.LINES_LOST_LONG,
            Trigger.NO_LINES,
        ),
        Phase.LAND,
    )
    | {Trigger.AT_HEIGHT: Phase.ACQUIRE},
    Phase.ACQUIRE: _ON_LINES | {Trigger.ACQUIRED: Phase.TURN},
    Phase.FOLLOW: _ON_LINES | {Trigger.ARRIVED: Phase.HOVER},
    Phase.HOVER: _ON_LINES
    | {
        Trigger.SCAN_DUE: Phase.CLIMB,
        Trigger.AWAITS_MORE: Phase.HOLD,
        Trigger.DWELLED: Phase.TURN,
        Trigger.ROUTE_DONE: Phase.LAND,
    },
    Phase.CLIMB: _ON_LINES | {Trigger.AT_VIEW: Phase.SCAN, Trigger.VIEW_MISSED: Phase.CLIMB},
    Phase.SCAN: _ON_LINES
    | {Trigger.VIEW_DONE: Phase.CLIMB, Trigger.DWELLED: Phase.TURN, Trigger.ROUTE_DONE: Phase.LAND},
    Phase.TURN: _ON_LINES | {Trigger.TURNED: Phase.FOLLOW},
    Phase.HOLD: _UNDER_WAY
    | {
        Trigger.HAZARD_LASTS: Phase.LAND,
        Trigger.LINES_LOST_LONG: Phase.LAND,
        Trigger.LINES_FOUND: Phase.ACQUIRE,
    },
    Phase.RELOCATE: _SEEING
    | {
        Trigger.POSITION_UNKNOWN: Phase.LAND,
        Trigger.CUT_OFF: Phase.LAND,
        Trigger.POSITION_SURE: Phase.ACQUIRE,
    },
    Phase.LAND: {
        Trigger.PILOT_TOOK: Phase.PILOT,
        Trigger.FAILSAFE_TOOK: Phase.PILOT,
        Trigger.VANISHED: Phase.ABORTED,
        Trigger.STOP: Phase.LAND,
        Trigger.TIMED_OUT: Phase.LAND,
    },
    Phase.SWAP: _GIVEN_UP | {Trigger.TIMED_OUT: Phase.ABORTED, Trigger.READY: Phase.ARMING},
    Phase.DONE: {},
    Phase.ABORTED: {},
    Phase.PILOT: {},
}
"""Which phase a trigger begins, whatever the intent; `_begins` has what depends on that."""

_FOR_VISITS = frozenset(
    {Trigger.READY, Trigger.SCAN_DUE, Trigger.VIEW_DONE, Trigger.VIEW_MISSED, Trigger.AWAITS_MORE}
)
"""What leads on only where the plan is flown: nothing starts unordered, is scanned or waits on the way
back."""

_OVER_PAD: Mapping[tuple[Trigger, Intent], tuple[Phase, Cause]] = {
    (Trigger.DOWN_TO_SWAP, Intent.RETURN): (Phase.SWAP, Cause.TRIGGER),
    (Trigger.DOWN_TO_SWAP, Intent.HOME): (Phase.SWAP, Cause.TRIGGER),
    (Trigger.DOWN_AS_TOLD, Intent.VISIT): (Phase.PREFLIGHT, Cause.TRIGGER),
    (Trigger.NOT_COUNTED, Intent.VISIT): (Phase.ABORTED, Cause.TRIGGER),
    (Trigger.NOT_COUNTED, Intent.RETURN): (Phase.ABORTED, Cause.TRIGGER),
    (Trigger.DISARMED, Intent.VISIT): (Phase.DONE, Cause.LANDED),
    (Trigger.DISARMED, Intent.RETURN): (Phase.DONE, Cause.LANDED),
}
"""How a landing ends on its pad; every other one that ends is an abort for what led to it."""

_ANY = {intent: intent for intent in Intent}
_TURNS: Mapping[Trigger, tuple[Collection[Phase], Mapping[Intent, Intent]]] = {
    Trigger.PLAN: ((Phase.PREFLIGHT,), {Intent.WAIT: Intent.WAIT}),
    Trigger.START: (WAITING, {Intent.WAIT: Intent.VISIT, Intent.VISIT: Intent.VISIT}),
    Trigger.PAUSE: (FLYING, _ANY),
    Trigger.RESUME: (FLYING, _ANY),
    Trigger.GOTO: (FLYING, {Intent.VISIT: Intent.VISIT}),
    Trigger.GO_HOME: (FLYING, dict.fromkeys(_ON_WAY, Intent.HOME)),
    Trigger.HOME_IN_NEED: ((*FLYING, Phase.LAND), {Intent.VISIT: Intent.HOME}),
    Trigger.BACK_TO_SWAP: (FLYING, {Intent.VISIT: Intent.RETURN}),
    Trigger.BACK_TO_END: (FLYING, {Intent.VISIT: Intent.HOME}),
    # down where it is, not across the floor at landing height
    Trigger.POSITION_CORRECTED: ((Phase.LAND,), dict.fromkeys(_ON_WAY, Intent.END)),
    Trigger.LAND_HERE: ((Phase.LAND,), _ANY),
}
"""In which phases a trigger is taken without beginning another, and what it makes of the intent."""

_WITHDRAWS = frozenset({Trigger.PAUSE, Trigger.START_EXPIRED})
"""What takes a start back as long as it waits."""

COMMANDS: Mapping[CommandKind, Trigger] = {
    CommandKind.START: Trigger.START,
    CommandKind.PAUSE: Trigger.PAUSE,
    CommandKind.RESUME: Trigger.RESUME,
    CommandKind.GOTO: Trigger.GOTO,
    CommandKind.HOME: Trigger.GO_HOME,
    CommandKind.LAND: Trigger.LAND_HERE,
    CommandKind.STOP: Trigger.STOP,
    CommandKind.PLAN: Trigger.PLAN,
}


def _begins(state: State, trigger: Trigger) -> Outcome | None:
    """The phase that a trigger begins, with its intent."""
    if state.phase is Phase.LAND and (trigger, state.intent) in _OVER_PAD:
        phase, cause = _OVER_PAD[trigger, state.intent]
    elif state.phase is Phase.LAND and trigger is Trigger.DISARMED:
        phase, cause = Phase.ABORTED, Cause.KEPT
    elif state.phase is Phase.LAND and trigger is Trigger.TIMED_OUT and state.stopped:
        phase, cause = Phase.ABORTED, Cause.TRIGGER
    elif trigger not in _BEGINS[state.phase] or (trigger in _FOR_VISITS and state.intent is not Intent.VISIT):
        return STAYS
    else:
        phase, cause = _BEGINS[state.phase][trigger], Cause.TRIGGER
    return Outcome(State(phase, _intent_of(state, phase, trigger)), True, cause)


def _intent_of(state: State, phase: Phase, trigger: Trigger) -> Intent:
    """What a phase is for that a trigger begins."""
    if phase in OVER:
        return Intent.END
    if phase in WAITING:
        return Intent.WAIT
    if phase is Phase.RECOVER:
        return Intent.ADOPTED
    if phase is Phase.LAND and (trigger is Trigger.STOP or state.phase is Phase.LAND):
        return Intent.ADOPTED_STOP if state.adopted else Intent.STOP
    if phase is Phase.LAND and trigger is not Trigger.ROUTE_DONE:
        return Intent.ADOPTED if state.adopted else Intent.END
    return state.intent


def _outcome(state: State, trigger: Trigger) -> Outcome | None:
    if trigger in _WITHDRAWS and state.waiting and state.intent is Intent.VISIT:
        return Outcome(State(state.phase, Intent.WAIT), False, Cause.KEPT)
    phases, intents = _TURNS.get(trigger, ((), {}))
    if state.phase in phases and state.intent in intents:
        cause = Cause.TRIGGER if trigger is Trigger.POSITION_CORRECTED else Cause.KEPT
        return Outcome(State(state.phase, intents[state.intent]), False, cause)
    return _begins(state, trigger)


TABLE: Mapping[State, Mapping[Trigger, Outcome | None]] = {
    state: {trigger: _outcome(state, trigger) for trigger in Trigger} for state in STATES
}
"""What each trigger makes of each state; complete."""


_URGENCY = {trigger: place for place, trigger in enumerate(Trigger)}
"""The most urgent first, as they are listed."""


def next_state(state: State, triggers: Collection[Trigger]) -> tuple[State, Trigger | None]:
    """The state that follows, and the most urgent trigger of those that begin a phase (None: none does)."""
    row = TABLE[state]
    for trigger in sorted(triggers, key=_URGENCY.__getitem__):
        outcome = row[trigger]
        if outcome is not None and outcome.begins:
            return outcome.state, trigger
    return state, None


@cache
def taken_in(state: State) -> frozenset[Trigger]:
    """The triggers that mean anything in a state."""
    return frozenset(trigger for trigger, outcome in TABLE[state].items() if outcome is not None)


@cache
def possible_commands(state: State) -> frozenset[CommandKind]:
    """What an operator may order now; everything else has no effect and is refused."""
    return frozenset(kind for kind, trigger in COMMANDS.items() if TABLE[state][trigger] is not None)
