"""What swings about its place, and does nothing worse, is held longer than by any other hazard."""

from __future__ import annotations

from dataclasses import replace

from flightd.core.types import Phase
from flightd.mission.guidance import ALL_WELL
from flightd.mission.machine import Intent, State
from tests.unit.mission.driven import Flight
from tests.unit.mission.states import fresh


def held_with(seconds: float, **warnings: object) -> Flight:
    flight = fresh(State(Phase.FOLLOW, Intent.VISIT))
    flight.set(warnings=replace(ALL_WELL, **warnings))  # type: ignore[arg-type]
    flight.run(seconds, follow=False)
    return flight


def test_swings_alone_are_waited_out_for_twelve_seconds() -> None:
    assert held_with(11.5, swings=True).phase is Phase.HOLD
    flight = held_with(12.5, swings=True)
    assert (flight.phase, flight.mission.reason) == (Phase.LAND, "held for too long")


def test_swings_with_anything_else_end_as_soon_as_that() -> None:
    assert held_with(1.5, swings=True, frozen_s=9.0).phase is Phase.LAND
