"""Random walks of a whole mission: whatever comes, in whatever order, some things always hold.

FLIGHTD_WALKS says how many walks are tried (80 where it is not set)."""

from __future__ import annotations

import copy
import math
import os
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any, TypeAlias

from hypothesis import given, settings
from hypothesis import strategies as st

from flightd.config.hazards import LossAction
from flightd.core.types import CommandKind, Demand, LandedState, Phase
from flightd.mission.guidance import ALL_WELL
from flightd.mission.machine import COMMANDS, STATES, TABLE, Cause, Intent, State
from flightd.mission.safety.hazard_table import HAZARDS
from flightd.mission.triggers import Trigger
from tests.unit.mission.driven import Flight
from tests.unit.mission.states import PARAMS, STIMULI, flight_of, fresh, losing

WALKS = int(os.environ.get("FLIGHTD_WALKS", "80"))

ORDERED = frozenset(COMMANDS.values())
"""What comes as an order, beside what is sensed."""
HAZARDOUS = {row.trigger for row in HAZARDS if row.trigger is not None} - ORDERED | {Trigger.VANISHED}
OTHERWISE: Mapping[str, Mapping[str, Any]] = {
    "well": {},
    "disarmed": {"armed": False, "landed": LandedState.ON_GROUND},
    "standing": {"landed": LandedState.ON_GROUND},
    "no cross line": {"y_age_s": 9.0},
    "not localised": {"x_age_s": 9.0, "y_age_s": 9.0, "localised": False},
    "in doubt": {},
    "elsewhere": {},
}
"""What is sensed and no hazard, or not as `STIMULI` has it."""
SENSED: Mapping[str, Callable[[Flight], None]] = {
    **{
        trigger.value: STIMULI[trigger].act
        for trigger in HAZARDOUS
        if trigger is not Trigger.POSITION_DOUBTED
    },
    **{name: partial(Flight.set, **changes) for name, changes in OTHERWISE.items()},
}
USUAL = {
    "in_control": True, "in_failsafe": False, "landed": LandedState.IN_AIR, "telemetry_age_s": 0.0,
    "height_m": 1.5, "climb_mps": 0.0, "x_age_s": 0.0, "y_age_s": 0.0, "localised": True,
    "ground_silent_s": 0.0, "battery_frac": 0.95, "warnings": ALL_WELL, "aisle_closed": True, "failed": False,
    "dt_s": 0.02, "clock_error_s": 0.0,
}  # fmt: skip

SPELLS = st.lists(
    st.tuples(
        st.sets(st.sampled_from(sorted(SENSED)), max_size=3),
        st.sets(st.sampled_from(sorted(CommandKind)), max_size=2),
        st.sampled_from((0.02, 0.1, 0.4, 1.5, 4.0)),
        st.booleans(),
    ),
    min_size=3,
    max_size=10,
)
"""What is sensed and ordered, for how long, and whether the drone goes where it is led."""
Spells: TypeAlias = list[tuple[set[str], set[CommandKind], float, bool]]
LOST = st.sampled_from(LossAction)


class Walk:
    """One flight of which everything that must hold is asked at each tick."""

    def __init__(self, flight: Flight) -> None:
        self.flight = flight
        flight.mission.drain_events()  # of the way to where the walk begins
        self.since_s = 0.0
        state = flight.mission.state
        self.started = state.intent is not Intent.WAIT and not state.adopted

    def spell(self, sensed: set[str], orders: set[CommandKind], seconds: float, follow: bool) -> None:
        """Sense these for a while; the orders come first."""
        flight = self.flight
        usual = dict(USUAL)
        if follow and flight.inputs.vehicle is not None and not math.isnan(flight.inputs.height_m):
            usual.pop("height_m")
        flight.integrity = 0.5 if "in doubt" in sensed else 1.0
        flight.set(**usual)
        flight.heartbeat_s = 0.0
        for name in sorted(sensed):
            SENSED[name](flight)
        if "elsewhere" in sensed and flight.inputs.pose is not None:
            flight.set(pose=replace(flight.inputs.pose, x_m=flight.inputs.pose.x_m + 3.0))
        for order in sorted(orders):
            nodes = ("A3", "A2") if order is CommandKind.PLAN else ()
            flight.order(order, "A3" if order is CommandKind.GOTO else "", nodes)
            self.started |= order is CommandKind.START
        stopped = CommandKind.STOP in orders and not flight.mission.state.over
        for tick in range(round(seconds / 0.02)):
            self.tick(follow, stopped and tick == 0)

    def tick(self, follow: bool, stopped: bool) -> None:
        flight, before = self.flight, self.flight.mission.state
        flight.run(0.02, follow=follow)
        after = flight.mission.state
        begun = [event.text for event in flight.mission.drain_events() if event.name == "phase"]
        self.since_s = 0.0 if begun else self.since_s + 0.02
        self.is_explained(before, after, begun)
        if stopped:
            assert after.stopped or after.over
        self.pilot_wins(before, after)
        if after.phase is Phase.ARMING or (flight.guidance and flight.guidance.demand is Demand.FLY):
            assert self.started or before.adopted, "nothing is armed that was not ordered to start"
        if after.waiting:
            self.started = after.intent is Intent.VISIT
        if after.airborne and after.phase is not Phase.LAND:
            assert self.since_s < 70.0, "time leads out of it"

    def is_explained(self, before: State, after: State, begun: list[str]) -> None:
        """Nothing happens that the table does not say."""
        turned = _turned(before)
        if not begun:
            assert after in turned
            return
        words = begun[-1].split(": ", 1)[1]
        ends = {
            outcome.state
            for state in turned
            for trigger, outcome in TABLE[state].items()
            if outcome is not None
            and outcome.begins
            and (outcome.cause is not Cause.TRIGGER or words.startswith((trigger.value, "no picture")))
        }
        assert any(after in _turned(end) for end in ends)

    def pilot_wins(self, before: State, after: State) -> None:
        s = self.flight.inputs
        heard = s.telemetry_age_s + self.flight.heartbeat_s < PARAMS.mission.telemetry_hold_s
        if heard and before.airborne and before.phase is not Phase.RECOVER and s.vehicle is not None:
            assert not s.vehicle.armed or s.vehicle.in_control or after.phase is Phase.PILOT

    def can_land(self) -> None:
        """From here an order lands it, and a pilot takes it."""
        if not self.flight.mission.airborne:
            return
        shared = {id(self.flight.site): self.flight.site}
        landing = copy.deepcopy(self.flight, shared)
        landing.set(armed=True, in_control=True)
        landing.order(CommandKind.STOP)
        landing.run(0.02, follow=False)
        assert landing.phase is Phase.LAND
        landing.heartbeat_s = 0.0
        landing.set(in_control=False, telemetry_age_s=0.0)
        landing.run(0.02, follow=False)
        assert landing.phase.value == "pilot"


def _turned(state: State) -> set[State]:
    """What becomes of a state without another phase."""
    found, todo = {state}, [state]
    while todo:
        for outcome in TABLE[todo.pop()].values():
            if outcome is not None and not outcome.begins and outcome.state not in found:
                found.add(outcome.state)
                todo.append(outcome.state)
    return found


def flown(spells: Spells, flight: Flight) -> None:
    walk = Walk(flight)
    for sensed, orders, seconds, follow in spells:
        walk.spell(sensed, orders, seconds, follow)
        walk.can_land()


@settings(max_examples=WALKS)
@given(SPELLS, st.sampled_from([state for state in STATES if not state.over]))
def test_whatever_comes_a_mission_in_any_state_stays_safe(spells: Spells, state: State) -> None:
    flown(spells, fresh(state))


@settings(max_examples=WALKS // 4)
@given(SPELLS, LOST, LOST, st.booleans())
def test_whatever_is_done_when_links_are_lost_stays_safe(
    spells: Spells, ground: LossAction, record: LossAction, scans: bool
) -> None:
    flight = flight_of(losing(ground, record), scans)
    flight.order(CommandKind.START)
    flight.run(4.0)
    flown(spells, flight)
