"""For how long hazards that hold are waited out, and what counts as one anew."""

from __future__ import annotations

from dataclasses import replace

from flightd.core.types import Phase
from flightd.mission.guidance import ALL_WELL
from flightd.mission.machine import Intent, State
from flightd.mission.safety.hazard_monitor import Counted
from tests.unit.mission.configured import configured
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


def test_what_comes_after_long_swings_is_given_its_own_time() -> None:
    flight = held_with(8.0, swings=True)
    flight.set(warnings=replace(ALL_WELL, swings=True, frozen_s=9.0))
    flight.run(0.5, follow=False)
    assert flight.phase is Phase.HOLD
    flight.run(1.0, follow=False)
    assert (flight.phase, flight.mission.reason) == (Phase.LAND, "held for too long")


def test_what_is_counted_anew_is_news_from_the_first() -> None:
    """A delay that leapt in the flight before, and leaps in this one."""
    counted = Counted()
    told = [counted.step(count, second * 1_000_000_000) for second, count in enumerate((0, 1, 1, 1, 0, 0, 1))]
    assert told == [False, True, True, False, False, False, True]


def test_what_holds_is_held_for_as_long_as_is_configured_though_swings_are_not() -> None:
    flight = fresh(State(Phase.FOLLOW, Intent.VISIT), configured(lines_land_s=30.0))
    flight.set(warnings=replace(ALL_WELL, frozen_s=9.0))
    flight.run(14.0, follow=False)
    assert flight.phase is Phase.HOLD
