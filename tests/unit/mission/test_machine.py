"""The table itself: complete, safe from every state, and what it says of commands."""

from __future__ import annotations

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flightd.core.types import CommandKind, Phase
from flightd.mission.machine import (
    BEGIN,
    FLYING,
    STATES,
    TABLE,
    Cause,
    Intent,
    State,
    next_state,
    possible_commands,
)
from flightd.mission.safety.hazard_table import Action, triggers_of
from flightd.mission.triggers import Trigger
from tests.rigs.possible_commands import possible_in

AIRBORNE = [state for state in STATES if state.airborne]
UNREACHABLE = {
    Phase.PREFLIGHT: set(Intent) - {Intent.WAIT, Intent.VISIT},
    Phase.SWAP: set(Intent) - {Intent.WAIT, Intent.VISIT},
    Phase.ARMING: set(Intent) - {Intent.VISIT},
    Phase.RECOVER: set(Intent) - {Intent.ADOPTED},
    **dict.fromkeys(FLYING, set(Intent) - {Intent.VISIT, Intent.RETURN, Intent.HOME}),
    Phase.LAND: {Intent.WAIT},
    **dict.fromkeys((Phase.DONE, Phase.ABORTED, Phase.PILOT), set(Intent) - {Intent.END}),
}
"""What a phase is never flown for."""


def ids(state: State) -> str:
    return f"{state.phase}-{state.intent.name.lower()}"


def following(state: State) -> set[State]:
    """The states that a single trigger leads to."""
    return {outcome.state for outcome in TABLE[state].values() if outcome is not None}


def reach(start: State) -> set[State]:
    """All states that lie ahead of `start`, with itself."""
    found, todo = {start}, [start]
    while todo:
        new = following(todo.pop()) - found
        found |= new
        todo += new
    return found


def test_every_state_answers_every_trigger() -> None:
    assert set(TABLE) == set(STATES)
    assert all(set(row) == set(Trigger) for row in TABLE.values())


def test_every_state_is_reached_and_no_other_can_be_made() -> None:
    assert reach(BEGIN) == set(STATES)
    for phase, intent in itertools.product(Phase, Intent):
        if intent in UNREACHABLE[phase]:
            with pytest.raises(ValueError, match="no phase"):
                State(phase, intent)
        else:
            assert State(phase, intent) in TABLE


@pytest.mark.parametrize("state", AIRBORNE, ids=ids)
def test_in_the_air_there_is_always_a_way_to_land_or_to_the_pilot(state: State) -> None:
    assert {Phase.LAND, Phase.PILOT} & {after.phase for after in following(state)}
    lost = triggers_of(Action.LAND, Action.STOP) | {Trigger.GROUND_LOST, Trigger.RECORD_LOST}
    for trigger in (*lost, Trigger.LAND_HERE):
        after, _ = next_state(state, {trigger})
        assert after.phase is Phase.LAND
        assert after == state or not after.on_pad, "a landing in need is not one on the pad"


@given(st.sampled_from(AIRBORNE), st.frozensets(st.sampled_from(Trigger)))
def test_the_pilot_wins_over_everything_else_in_the_air(state: State, others: frozenset[Trigger]) -> None:
    assert next_state(state, others | {Trigger.PILOT_TOOK})[0].phase is Phase.PILOT


@given(st.sampled_from(STATES), st.frozensets(st.sampled_from(Trigger)))
def test_a_stop_wins_over_everything_but_the_pilot(state: State, others: frozenset[Trigger]) -> None:
    after, _ = next_state(state, others | {Trigger.STOP})
    assert after.stopped or after.over


@given(st.sampled_from(STATES), st.frozensets(st.sampled_from(Trigger)))
def test_nothing_arms_that_was_not_ordered_to_start(state: State, happened: frozenset[Trigger]) -> None:
    after, trigger = next_state(state, happened)
    if after.phase is Phase.ARMING and state.phase is not Phase.ARMING:
        assert trigger is Trigger.READY
        assert state.waiting
        assert state.intent is Intent.VISIT
    for trigger, outcome in TABLE[state].items():
        if outcome is not None and outcome.state.waiting and outcome.state.intent is Intent.VISIT:
            assert trigger is Trigger.START


@pytest.mark.parametrize("state", AIRBORNE, ids=ids)
def test_time_alone_leads_out_of_every_airborne_state(state: State) -> None:
    """To a landing; from there to one by the autopilot itself, unsteered; from there to the end."""
    after, _ = next_state(state, {Trigger.TIMED_OUT, Trigger.UNATTENDED})
    if state.phase is not Phase.LAND:
        assert after.phase is Phase.LAND
    elif state.stopped:
        assert after.phase is Phase.ABORTED
    else:
        assert after.phase is Phase.LAND
        assert after.stopped
        assert after.adopted is state.adopted


@pytest.mark.parametrize("state", [state for state in STATES if state.over], ids=ids)
def test_the_end_is_final(state: State) -> None:
    assert following(state) == set()


@pytest.mark.parametrize("state", AIRBORNE, ids=ids)
def test_a_way_that_ends_early_never_turns_into_a_completed_mission(state: State) -> None:
    if state.intent not in {Intent.VISIT, Intent.RETURN}:
        before_swap = reach_without_swap(state)
        assert Phase.DONE not in {after.phase for after in before_swap}


def reach_without_swap(start: State) -> set[State]:
    found, todo = {start}, [start]
    while todo:
        state = todo.pop()
        new = {after for after in following(state) if after.phase is not Phase.SWAP} - found
        found |= new
        todo += new
    return found


@pytest.mark.parametrize("phase", FLYING)
def test_lost_lines_hold_before_any_progress(phase: Phase) -> None:
    progress = {Trigger.ARRIVED, Trigger.DWELLED, Trigger.TURNED, Trigger.ACQUIRED, Trigger.VIEW_DONE}
    if phase not in {Phase.TAKE_OFF, Phase.HOLD}:
        after, _ = next_state(State(phase, Intent.VISIT), progress | {Trigger.LINES_LOST})
        assert after == State(Phase.HOLD, Intent.VISIT)


@pytest.mark.parametrize("state", STATES, ids=ids)
def test_an_intent_is_lost_only_to_a_stronger_one(state: State) -> None:
    for outcome in TABLE[state].values():
        if outcome is not None and not outcome.begins:
            assert outcome.state.phase is state.phase
            assert outcome.cause is Cause.KEPT or outcome.state.intent is Intent.END
        if outcome is not None and outcome.state.phase in FLYING and state.phase in FLYING:
            turned = (state.intent, outcome.state.intent)
            assert turned[0] is turned[1] or turned in {
                (Intent.VISIT, Intent.RETURN),
                (Intent.VISIT, Intent.HOME),
                (Intent.RETURN, Intent.HOME),
            }


def test_commands_are_possible_where_they_mean_something() -> None:
    for phase in Phase:
        over = phase in {Phase.DONE, Phase.ABORTED, Phase.PILOT}
        assert ({CommandKind.LAND, CommandKind.STOP} <= possible_in(phase)) is not over
        assert (CommandKind.START in possible_in(phase)) is (phase in {Phase.PREFLIGHT, Phase.SWAP})
        on_way = {CommandKind.PAUSE, CommandKind.RESUME, CommandKind.GOTO, CommandKind.HOME}
        waits = {CommandKind.PAUSE} if phase in {Phase.PREFLIGHT, Phase.SWAP, Phase.ARMING} else set()
        assert possible_in(phase) & on_way == (on_way if phase in FLYING else waits)
    assert CommandKind.GOTO not in possible_commands(State(Phase.FOLLOW, Intent.HOME))
