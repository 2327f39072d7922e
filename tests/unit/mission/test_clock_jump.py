"""A clock that jumped is told from a stray datagram: by two senseless times, soon after one another."""

from __future__ import annotations

import pytest

from flightd.core.types import Phase
from flightd.mission.machine import Intent, State
from flightd.mission.triggers import Trigger
from tests.unit.mission.driven import Flight
from tests.unit.mission.states import fresh


def following() -> Flight:
    return fresh(State(Phase.FOLLOW, Intent.VISIT))


def found_by(flight: Flight, *apart_s: float, at_once: int = 1) -> int | None:
    """By how many of the senseless times that come so long after one another it was found, the last one
    waited on; None by none.  `at_once` are refused between two ticks."""
    assert flight.inputs.vehicle is not None
    count = flight.inputs.vehicle.stamps_refused
    for number, wait_s in enumerate((*apart_s, 2.0), start=1):
        flight.set(stamps_refused=count + number * at_once)
        flight.run(wait_s, until=lambda: flight.phase is Phase.HOLD)
        if flight.phase is Phase.HOLD:
            assert flight.mission.reason == Trigger.CLOCK_JUMP.value
            return number
    return None


def test_one_senseless_time_is_a_stray_datagram() -> None:
    assert found_by(following()) is None


@pytest.mark.parametrize("apart_s", [0.02, 0.1, 0.9])
def test_two_are_a_clock_that_jumped(apart_s: float) -> None:
    assert found_by(following(), apart_s) == 2


def test_two_between_two_ticks_are_one_too() -> None:
    assert found_by(following(), at_once=2) == 1


def test_strays_that_come_more_than_a_second_apart_stay_strays() -> None:
    assert found_by(following(), 1.1, 1.1, 1.1) is None


def test_what_was_refused_before_counts_for_nothing() -> None:
    flight = following()
    assert found_by(flight, 1.1) is None
    assert found_by(flight) is None
    assert found_by(flight, 0.1) == 2
