"""A goal about which gusts swing the drone is reached in the end, or given up; it never ends a flight."""

from __future__ import annotations

import math
from collections.abc import Callable

from flightd.core.types import Phase
from flightd.mission.machine import Intent, State
from tests.unit.mission.driven import Flight, at_rest
from tests.unit.mission.states import fresh

_SLACK_S = 3.0
"""What `states` gives a phase beyond its own time."""


def swings(seconds: float) -> tuple[float, float]:
    """0.17 m to either side, one and a half seconds to and fro."""
    return 0.17 * math.sin(2.0 * math.pi * seconds / 1.5), 0.0


def too_high(_seconds: float) -> tuple[float, float]:
    """A metre above wherever it is led."""
    return 0.0, 1.0


def beside(_seconds: float) -> tuple[float, float]:
    return 0.2, 0.0


def off(state: State, off_m: Callable[[float], tuple[float, float]]) -> Flight:
    """A flight in a state that is never quite where it is led from then on."""
    flight = fresh(state)
    flight.off_m = off_m
    return flight


def test_a_node_about_which_it_swings_is_reached_in_the_end() -> None:
    flight = off(State(Phase.FOLLOW, Intent.VISIT), swings)
    flight.to(Phase.HOVER)
    flight.to(Phase.FOLLOW)
    flight.to(Phase.HOVER)
    assert len(flight.mission.visited) == 1


def test_a_view_that_is_not_reached_is_given_up_for_the_next() -> None:
    flight = off(State(Phase.CLIMB, Intent.VISIT), too_high)
    flight.to(Phase.TURN)
    missed = [event.text for event in flight.mission.drain_events() if event.name == "view_missed"]
    assert len(missed) == 2  # the second gives up the others
    assert all(text.endswith("places from A1: not reached in time") for text in missed)
    assert tuple(flight.mission.visited) == ("A1",)


def test_beside_its_goal_it_is_not_there_before_its_time_is_up() -> None:
    """It rests a fifth of a metre short of the node."""
    times_ns = []
    for off_m in (at_rest, beside):
        flight = off(State(Phase.FOLLOW, Intent.VISIT), off_m)
        flight.to(Phase.HOVER)
        times_ns.append(flight.now_ns)
    assert times_ns[1] - times_ns[0] > 0.3e9 * _SLACK_S
