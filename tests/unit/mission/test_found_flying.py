"""The daemon starts while its vehicle flies: it never arms or moves by itself."""

from __future__ import annotations

import math

import pytest

from flightd.core.types import Command, CommandKind, Demand, LandedState, Phase
from flightd.mission.guidance import Guide
from tests.unit.mission.configured import configured
from tests.unit.mission.driven import Flight

PARAMS = configured(dwell_s=1.0, recover_s=3.0, autostart=True)


def found_flying(**changes: object) -> Flight:
    flight = Flight(PARAMS)
    flight.set(
        **{"armed": True, "landed": LandedState.IN_AIR, "height_m": 1.5, "in_control": False, **changes}
    )
    return flight


def told(flight: Flight) -> tuple[Demand, Guide]:
    assert flight.guidance is not None
    return flight.guidance.demand, flight.guidance.guide


def test_found_flying_it_stays_level_where_it_is_and_asks_only_to_keep_the_vehicle() -> None:
    flight = found_flying()
    flight.run(1.0, follow=False)
    assert flight.phase is Phase.RECOVER
    flight.set(in_control=True)
    demands = set()
    for _ in range(50):
        flight.run(0.02, follow=False)
        guidance = flight.guidance
        assert guidance is not None
        assert guidance.guide is Guide.LEVEL
        assert guidance.reference.climb_mps == 0.0
        assert guidance.reference.height_m == pytest.approx(1.5)
        demands.add(guidance.demand)
    assert demands == {Demand.KEEP}
    (event,) = [event for event in flight.mission.drain_events() if event.name == "restart"]
    assert "GUIDED_NOGPS" in event.text


def test_when_nobody_takes_over_the_vehicle_lands_by_itself_and_is_disarmed() -> None:
    flight = found_flying(in_control=True)
    flight.run(4.0, follow=False)
    assert flight.phase is Phase.LAND
    assert "nobody took over" in flight.mission.reason
    assert told(flight) == (Demand.LAND, Guide.LEVEL), "where it is is not known"
    flight.set(landed=LandedState.ON_GROUND, height_m=0.1)
    flight.run(0.1, follow=False)
    assert told(flight)[0] is Demand.DISARM
    flight.set(armed=False)
    flight.run(0.1, follow=False)
    assert flight.mission.phase is Phase.ABORTED


@pytest.mark.parametrize("order", [CommandKind.LAND, CommandKind.STOP])
def test_an_operator_may_land_it_sooner(order: CommandKind) -> None:
    flight = found_flying(in_control=True)
    flight.run(0.5, follow=False)
    flight.mission.command(Command("x", order), flight.now_ns)
    flight.run(0.1, follow=False)
    assert flight.phase is Phase.LAND


@pytest.mark.parametrize("order", [CommandKind.HOME, CommandKind.RESUME, CommandKind.START])
def test_no_other_order_sets_it_in_motion(order: CommandKind) -> None:
    flight = found_flying(in_control=True)
    flight.run(0.5, follow=False)
    flight.mission.command(Command("x", order), flight.now_ns)
    flight.run(1.0, follow=False)
    assert flight.phase is Phase.RECOVER
    assert flight.guidance is not None
    assert flight.guidance.guide is Guide.LEVEL


def test_a_vehicle_that_does_not_obey_is_the_pilots() -> None:
    flight = found_flying(mode="ALT_HOLD")
    flight.run(3.0, follow=False)
    assert flight.phase is Phase.PILOT
    assert flight.guidance is not None
    assert (flight.guidance.guide, flight.guidance.demand) == (Guide.NONE, Demand.HANDS_OFF)


@pytest.mark.parametrize("changes", [{"battery_frac": 0.05}, {"telemetry_age_s": 5.0}])
def test_hazards_land_it_at_once(changes: dict[str, object]) -> None:
    flight = found_flying(in_control=True)
    flight.run(0.5, follow=False)
    flight.set(**changes)
    flight.run(0.1, follow=False)
    assert flight.phase is Phase.LAND


def test_without_a_height_it_does_not_climb_or_sink() -> None:
    flight = found_flying(in_control=True, height_m=math.nan)
    flight.run(0.5, follow=False)
    assert flight.phase is Phase.RECOVER
    assert flight.guidance is not None
    assert flight.guidance.reference.climb_mps == 0.0
    flight.set(height_m=2.0)
    flight.run(0.1, follow=False)
    assert flight.guidance.reference.height_m == pytest.approx(2.0), "no way back to a height of the past"


def test_one_that_takes_off_while_we_wait_is_somebody_elses() -> None:
    flight = Flight(configured(autostart=False))
    flight.run(1.0)
    flight.set(armed=True, landed=LandedState.IN_AIR, height_m=1.5, in_control=False, mode="ALT_HOLD")
    flight.run(5.0, follow=False)
    assert flight.phase is Phase.PREFLIGHT
    assert flight.guidance is not None
    assert flight.guidance.demand is Demand.STANDBY


@pytest.mark.parametrize(
    ("landed", "height_m", "phase"),
    [
        (LandedState.ON_GROUND, 0.1, Phase.PREFLIGHT),
        (LandedState.UNKNOWN, 0.1, Phase.PREFLIGHT),
        (LandedState.UNKNOWN, math.nan, Phase.PREFLIGHT),
        (LandedState.UNKNOWN, 1.2, Phase.RECOVER),
    ],
)
def test_armed_on_the_floor_is_no_flight(landed: LandedState, height_m: float, phase: Phase) -> None:
    flight = found_flying(landed=landed, height_m=height_m)
    flight.run(0.5, follow=False)
    assert flight.phase is phase
