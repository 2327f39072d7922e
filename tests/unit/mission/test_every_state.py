"""Every trigger in every state, through a mission that is fed by hand: the table is what happens."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from flightd.core.types import CommandKind, LandedState, Phase
from flightd.mission.machine import COMMANDS, STATES, TABLE, Cause, Intent, State
from flightd.mission.triggers import Trigger
from tests.unit.mission.driven import Flight
from tests.unit.mission.states import PARAMS, STIMULI, Stimulus, fresh

_AT_NODE = (Phase.HOVER, Phase.CLIMB, Phase.SCAN)
_BACK = (Intent.RETURN, Intent.HOME)
_SLOW = (
    Trigger.CLIMB_LOST,
    Trigger.HEIGHT_LOST,
    Trigger.CLOCK_UNSURE,
    Trigger.TIMED_OUT,
    Trigger.POSITION_DOUBTED,
)
SHADOWED = {
    # on the way back nothing is done at a node: it goes on before anything that takes time
    *((State(phase, intent), trigger) for phase in _AT_NODE for intent in _BACK for trigger in _SLOW),
    # a view is given up before its time is over
    (State(Phase.CLIMB, Intent.VISIT), Trigger.TIMED_OUT),
    # the search for the position has a limit of its own, which is shorter
    *((State(Phase.RELOCATE, intent), Trigger.TIMED_OUT) for intent in (Intent.VISIT, *_BACK)),
    # no shelf is scanned at the last stop, which is the pad's
    *((State(Phase.SCAN, intent), Trigger.ROUTE_DONE) for intent in (Intent.VISIT, *_BACK)),
    # there is another stop, another view; the states of a landing were reached through these
    *((State(Phase.HOVER, intent), Trigger.ROUTE_DONE) for intent in (Intent.VISIT, *_BACK)),
    (State(Phase.SCAN, Intent.VISIT), Trigger.DWELLED),
    # the end of a way is another stop
    (State(Phase.HOVER, Intent.VISIT), Trigger.AWAITS_MORE),
    # a start is taken only of a vehicle that was seen to stand
    (State(Phase.PREFLIGHT, Intent.VISIT), Trigger.FOUND_FLYING),
}
"""What another trigger comes before in these flights."""
_ON_PAD = {
    (State(Phase.LAND, Intent.RETURN), Trigger.NOT_COUNTED),
    (State(Phase.LAND, Intent.RETURN), Trigger.DISARMED),
    (State(Phase.LAND, Intent.HOME), Trigger.DOWN_TO_SWAP),
    (State(Phase.LAND, Intent.VISIT), Trigger.DOWN_AS_TOLD),
}
"""Landings that depend on what was done before: each has its own test below, or in `test_pad_as_told`."""
_ORDERS = {trigger: kind for kind, trigger in COMMANDS.items()}


def ids(state: State) -> str:
    return f"{state.phase}-{state.intent.name.lower()}"


def flight_for(state: State, trigger: Trigger) -> Flight:
    """A flight in a state, configured so that the trigger may happen to it."""
    stimulus = STIMULI[trigger]
    again = state.intent is Intent.RETURN or state.phase is Phase.SWAP  # which takes another battery
    params = PARAMS if again and not stimulus.params.battery.swap else stimulus.params
    return fresh(state, params, state.phase in stimulus.scanning and not state.adopted)


def what_follows(flight: Flight, stimulus: Stimulus) -> tuple[State, str]:
    """The first state that follows a stimulus, and the reason given; the same and none if nothing does."""
    before = flight.mission.state
    flight.mission.drain_events()
    for tick in range(round(stimulus.within_s / 0.02)):
        if tick == 0 or stimulus.hold:
            stimulus.act(flight)
        if flight.mission.state == before:
            flight.run(0.02, follow=stimulus.follow)
        begun = [event.text for event in flight.mission.drain_events() if event.name == "phase"]
        if begun or flight.mission.state != before:
            return flight.mission.state, begun[0].split(": ", 1)[1] if begun else ""
    return before, ""


def follows_from_another(state: State, after: State, reason: str, trigger: Trigger) -> bool:
    """A change is that of a trigger that the stimulus has as well, by the table's row for it."""
    return any(
        outcome is not None
        and outcome.state == after
        and (not outcome.begins or outcome.cause is not Cause.TRIGGER or reason.startswith(other.value))
        for other, outcome in TABLE[state].items()
        if other is not trigger
    )


def is_as_the_table_says(state: State, trigger: Trigger) -> bool:
    flight, outcome = flight_for(state, trigger), TABLE[state][trigger]
    if outcome is not None and not outcome.begins and trigger in _ORDERS:
        STIMULI[trigger].act(flight)
        refused = [event for event in flight.mission.drain_events() if "refused" in event.text]
        return flight.mission.state == outcome.state and not refused
    after, reason = what_follows(flight, STIMULI[trigger])
    if outcome is None:
        return after == state or follows_from_another(state, after, reason, trigger)
    if trigger is Trigger.NOT_COUNTED:
        return after == outcome.state and reason.startswith("no picture of a shelf")
    named = outcome.begins and outcome.cause is Cause.TRIGGER
    return after == outcome.state and (not named or reason == trigger.value)


@pytest.mark.parametrize("state", STATES, ids=ids)
def test_what_happens_is_what_the_table_says(state: State) -> None:
    wrong = [
        trigger
        for trigger in Trigger
        if (state, trigger) not in SHADOWED | _ON_PAD and not is_as_the_table_says(state, trigger)
    ]
    assert not wrong


@pytest.mark.parametrize("state", STATES, ids=ids)
@pytest.mark.parametrize("kind", list(CommandKind))
def test_a_command_that_is_not_possible_is_refused_and_changes_nothing(
    state: State, kind: CommandKind
) -> None:
    flight = fresh(state)
    if state.waiting and state.intent is Intent.WAIT:  # a start is refused before it is ready
        flight.set(battery_frac=0.95)
        flight.run(0.02, follow=False)
    flight.mission.drain_events()
    flight.order(kind, "A3" if kind is CommandKind.GOTO else "")
    refused = any("refused" in event.text for event in flight.mission.drain_events())
    assert refused is (TABLE[state][COMMANDS[kind]] is None)
    assert flight.mission.state == state or not refused


def down(flight: Flight) -> str:
    """It stands on the pad that it was led to and disarms; the state then."""
    flight.land()
    return ids(flight.mission.state)


def test_ordered_home_on_the_way_to_a_fresh_battery_it_still_goes_on_with_it() -> None:
    flight = fresh(State(Phase.LAND, Intent.RETURN))
    assert down(flight) == "swap-wait"
    flight = fresh(State(Phase.FOLLOW, Intent.VISIT))
    flight.to(Phase.HOVER)
    flight.to(Phase.FOLLOW)
    flight.set(battery_frac=0.15)
    flight.run(0.02)
    flight.order(CommandKind.HOME)
    assert ids(flight.mission.state) == "follow-home"
    assert down(flight) == "swap-wait"


def test_a_battery_on_which_nothing_was_visited_is_the_last() -> None:
    flight = fresh(State(Phase.TAKE_OFF, Intent.RETURN))
    assert down(flight) == "done-end"
    assert flight.mission.reason == "landed on the pad"


def test_nothing_counted_on_the_last_battery_is_no_completed_mission() -> None:
    flight = fresh(State(Phase.CLIMB, Intent.RETURN))
    assert not flight.mission.visited
    flight.set(battery_frac=0.15)
    assert down(flight) == "aborted-end"
    assert flight.mission.reason.startswith("no picture of a shelf")


def landing_corrected(by_m: float) -> Flight:
    """All nodes are visited; over the pad the position turns out to be `by_m` further along."""
    flight = fresh(State(Phase.LAND, Intent.VISIT))
    pad = flight.mission.goal
    flight.set(pad_m=(pad.x_m, pad.y_m))
    flight.run(0.1)
    pose = flight.inputs.pose
    assert pose is not None
    flight.set(pose=replace(pose, x_m=pose.x_m + by_m))
    flight.run(0.02, follow=False)
    flight.set(landed=LandedState.ON_GROUND, armed=False)
    flight.run(0.02, follow=False)
    return flight


def test_a_correction_that_leaves_it_over_its_pad_does_not_end_the_mission_otherwise() -> None:
    flight = landing_corrected(0.45)
    assert ids(flight.mission.state) == "done-end"
    assert flight.mission.reason == "landed on the pad"


def test_a_correction_away_from_the_pad_is_what_the_mission_ends_for() -> None:
    """It ended as "aborted: route done"."""
    flight = landing_corrected(3.0)
    assert ids(flight.mission.state) == "aborted-end"
    assert flight.mission.reason == Trigger.POSITION_CORRECTED.value


def test_a_mission_that_ends_early_on_its_pad_says_why_it_came_home() -> None:
    """It ended as "aborted: route done"."""
    flight = fresh(State(Phase.LAND, Intent.HOME))
    assert down(flight) == "aborted-end"
    assert flight.mission.reason == Trigger.GO_HOME.value


def test_a_vehicle_that_is_silent_as_a_whole_has_not_lost_its_climb_rate_alone() -> None:
    flight = fresh(State(Phase.FOLLOW, Intent.VISIT))
    flight.set(climb_mps=math.nan, telemetry_age_s=0.2)
    flight.run(0.8, follow=False)
    assert flight.phase is Phase.HOLD
