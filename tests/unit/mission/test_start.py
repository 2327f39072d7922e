"""A start: refused with the reason unless ready, counted down, taken back, and never kept for later."""

from __future__ import annotations

import pytest

from flightd.core.refusal import RecordedRefusal
from flightd.core.types import Command, CommandKind, Demand, LandedState, Phase
from flightd.tracking.battery_charge import Charge
from tests.unit.mission.configured import configured
from tests.unit.mission.driven import Flight


def waiting(start_countdown_s: float = 3.0) -> Flight:
    flight = Flight(configured(autostart=False, start_countdown_s=start_countdown_s))
    flight.run(0.1, follow=False)
    flight.mission.drain_events()
    return flight


def said(flight: Flight) -> list[str]:
    return [event.text for event in flight.mission.drain_events() if event.name in {"command", "start"}]


def test_a_start_at_a_low_battery_is_refused_and_not_kept_until_it_is_full() -> None:
    flight = waiting()
    flight.set(battery_frac=0.1)
    flight.run(0.1, follow=False)
    assert CommandKind.START not in flight.mission.possible_commands
    flight.order(CommandKind.START)
    assert said(flight) == ["start", "start refused: battery at 10%, 30% needed to start"]
    flight.set(battery_frac=1.0)
    flight.run(600.0, follow=False)
    assert flight.phase is Phase.PREFLIGHT
    assert flight.guidance is not None
    assert flight.guidance.demand is Demand.STANDBY


def test_before_anything_was_heard_it_is_refused() -> None:
    flight = Flight(configured(autostart=False))
    flight.order(CommandKind.START)
    assert said(flight)[-1] == "start refused: no telemetry from the vehicle"


def test_it_arms_after_a_count_down_that_is_told() -> None:
    flight = waiting()
    flight.order(CommandKind.START)
    reasons = []
    for _ in range(200):
        flight.run(0.02, follow=False)
        if flight.phase is not Phase.PREFLIGHT:
            break
        reasons.append(flight.mission.reason)
    assert len(reasons) == pytest.approx(150, abs=2)
    assert list(dict.fromkeys(reasons)) == [
        f"arms in {left} s; pause takes the start back" for left in (3, 2, 1)
    ]
    assert said(flight) == ["start", "arms in 3 s; pause takes the start back"]
    assert flight.phase is Phase.ARMING


@pytest.mark.parametrize("kind", [CommandKind.PAUSE, CommandKind.STOP])
def test_any_operator_takes_it_back_meanwhile(kind: CommandKind) -> None:
    flight = waiting()
    flight.order(CommandKind.START)
    flight.run(2.0, follow=False)
    flight.order(kind)
    flight.run(10.0, follow=False)
    assert flight.phase is (Phase.PREFLIGHT if kind is CommandKind.PAUSE else Phase.ABORTED)
    if kind is CommandKind.PAUSE:
        assert said(flight)[-1] == "taken back"
        flight.order(CommandKind.START)
        flight.to(Phase.ARMING, 3.1)
        flight.to(Phase.FOLLOW)  # the pause does not come back in flight


def test_what_it_waits_for_voids_it_within_five_seconds() -> None:
    flight = waiting()
    flight.order(CommandKind.START)
    flight.run(1.0, follow=False)
    flight.set(battery_frac=0.1)
    flight.run(7.2, follow=False)
    assert said(flight)[-1] == "the start command is void: battery at 10%, 30% needed to start"
    flight.set(battery_frac=1.0)
    flight.run(60.0, follow=False)
    assert flight.phase is Phase.PREFLIGHT


def test_an_arming_that_is_refused_for_five_seconds_voids_it() -> None:
    flight = waiting(start_countdown_s=0.0)
    flight.order(CommandKind.START)
    flight.run(0.1, follow=False)
    assert flight.mission.state.phase is Phase.ARMING
    flight.set(refusal=RecordedRefusal("arming: failed (PreArm: gyros)"))
    flight.run(5.2, follow=False)
    assert flight.phase is Phase.PREFLIGHT
    told = [event.text for event in flight.mission.drain_events() if event.name == "phase"]
    assert told[-1] == "arming -> preflight: the start command is void: arming: failed (PreArm: gyros)"
    flight.run(600.0, follow=False)
    assert flight.phase is Phase.PREFLIGHT


def test_an_arming_that_comes_after_all_is_taken_back() -> None:
    flight = waiting(start_countdown_s=0.0)
    flight.order(CommandKind.START)
    flight.run(5.4, follow=False)
    assert flight.phase is Phase.PREFLIGHT
    demands = [flight.demand]
    flight.set(armed=True)
    flight.run(0.04, follow=False)
    assert flight.phase is Phase.PREFLIGHT
    demands.append(flight.demand)
    flight.run(20.0, follow=False)
    demands.append(flight.demand)
    assert demands == [Demand.DISARM, Demand.DISARM, Demand.STANDBY], "whoever arms it later means it"


def starting_by_itself() -> Flight:
    """It lacked charge for a while, and has it now."""
    flight = Flight(configured(autostart=True, autostart_countdown_s=3.0))
    flight.set(battery_frac=0.1)
    flight.run(30.0, follow=False)
    assert flight.phase is Phase.PREFLIGHT
    flight.set(battery_frac=1.0)
    flight.run(1.1, follow=False)
    return flight


def test_one_that_starts_by_itself_counts_down_once_it_has_what_it_lacked() -> None:
    flight = starting_by_itself()
    assert "arms in 2 s" in flight.mission.reason
    assert said(flight)[-1] == "arms in 3 s; pause takes the start back"
    flight.run(1.9, follow=False)
    assert flight.phase is Phase.PREFLIGHT
    flight.run(0.2, follow=False)
    assert flight.phase.value == "arming"


def test_a_start_by_itself_that_an_operator_takes_back_is_his_from_then_on() -> None:
    flight = starting_by_itself()
    flight.order(CommandKind.PAUSE)
    flight.run(60.0, follow=False)
    assert (flight.phase, flight.mission.reason) == (Phase.PREFLIGHT, "waiting for the start command")
    flight.order(CommandKind.START)
    flight.run(3.2, follow=False)
    assert flight.phase is Phase.ARMING


@pytest.mark.parametrize("open_s", [0.5, 6.0, 60.0])
def test_a_start_by_itself_is_counted_down_anew_after_what_comes_between(open_s: float) -> None:
    """Whoever closes an aisle behind himself is not armed at."""
    flight = starting_by_itself()
    flight.set(aisle_closed=False)
    flight.run(open_s, follow=False)
    flight.set(aisle_closed=True)
    flight.run(2.9, follow=False)
    assert flight.phase is Phase.PREFLIGHT
    flight.run(0.2, follow=False)
    assert flight.phase.value == "arming"


@pytest.mark.parametrize("armed", [False, True])
def test_a_start_is_taken_back_while_the_vehicle_arms(armed: bool) -> None:
    """Also at the very tick on which it has armed."""
    flight = starting_by_itself()
    flight.run(3.2, follow=False)
    assert flight.phase.value == "arming"
    flight.order(CommandKind.PAUSE)
    flight.set(armed=armed)
    flight.run(0.1, follow=False)
    assert flight.phase.value == "preflight"
    assert "taken back" in said(flight)
    flight.run(5.0, follow=False)
    assert flight.phase.value == "preflight"
    assert flight.demand is Demand.DISARM
    flight.set(armed=False)
    flight.run(60.0, follow=False)
    assert (flight.phase, flight.mission.reason) == (Phase.PREFLIGHT, "waiting for the start command")


def test_what_comes_and_goes_does_not_flood_the_events() -> None:
    flight = starting_by_itself()
    said(flight)
    for _ in range(100):
        flight.set(frames_arrive=False)
        flight.run(0.04, follow=False)
        flight.set(frames_arrive=True)
        flight.run(0.04, follow=False)
    assert len(said(flight)) <= 1
    assert flight.phase is Phase.PREFLIGHT


@pytest.mark.parametrize("open_s", [0.1, 4.0])
def test_an_open_aisle_ends_an_ordered_start(open_s: float) -> None:
    flight = waiting()
    flight.order(CommandKind.START)
    flight.run(1.0, follow=False)
    flight.set(aisle_closed=False)
    flight.run(open_s, follow=False)
    flight.set(aisle_closed=True)
    flight.run(30.0, follow=False)
    assert (flight.phase, flight.mission.reason) == (Phase.PREFLIGHT, "waiting for the start command")
    assert said(flight)[-1] == "the start command is void: the aisle is not closed"


def test_who_orders_a_start_that_comes_by_itself_is_told_what_it_waits_for() -> None:
    flight = starting_by_itself()
    flight.set(battery_frac=0.1)
    flight.run(0.1, follow=False)
    flight.order(CommandKind.START)
    assert said(flight)[-1] == "starts already: battery at 10%, 30% needed to start"


def test_a_vehicle_that_does_not_arm_by_itself_is_given_up_for_good() -> None:
    flight = starting_by_itself()
    flight.run(70.0, follow=False)  # armed by nobody
    assert flight.phase is Phase.ABORTED


@pytest.mark.parametrize("kind", [CommandKind.STOP, CommandKind.LAND])
def test_a_stop_as_it_is_found_flying_lands_it_and_disarms_nothing(kind: CommandKind) -> None:
    flight = Flight(configured(autostart=False))
    flight.set(armed=True, landed=LandedState.IN_AIR, height_m=1.5, in_control=True)
    flight.mission.command(Command("1", kind), flight.now_ns)
    demands = set()
    for _ in range(100):
        flight.run(0.02, follow=False)
        assert flight.guidance is not None
        demands.add(flight.guidance.demand)
    assert flight.phase is Phase.LAND
    assert Demand.DISARM not in demands


def test_a_mission_that_ended_before_its_vehicle_was_heard_disarms_nothing_in_the_air() -> None:
    flight = Flight(configured(autostart=False))
    flight.set(telemetry_age_s=9.0)
    flight.run(0.1, follow=False)
    flight.order(CommandKind.STOP)
    flight.run(0.1, follow=False)
    assert flight.phase is Phase.ABORTED
    flight.set(telemetry_age_s=0.0, armed=True, landed=LandedState.IN_AIR, height_m=1.5)
    flight.run(0.1, follow=False)
    assert flight.guidance is not None
    assert flight.guidance.demand is Demand.LAND


def test_without_the_number_of_cells_nothing_starts() -> None:
    flight = waiting()
    flight.set(battery_stamp_ns=flight.now_ns)
    flight.run(0.1, follow=False)
    flight.order(CommandKind.START)
    assert said(flight)[-1].startswith("start refused: how many cells the battery has is not known")
    flight.set(judged_charge=Charge(1.0, cell_v=4.1))
    flight.run(0.1, follow=False)
    assert CommandKind.START in flight.mission.possible_commands


def test_a_start_by_itself_that_does_not_arm_is_counted_down_anew_and_given_up_after_a_minute() -> None:
    flight = starting_by_itself()
    flight.run(2.1, follow=False)
    phases, began_s = [flight.phase], flight.now_ns * 1e-9
    while flight.phase is not Phase.ABORTED:
        flight.run(0.02, follow=False)
        phases += [flight.phase] if flight.phase is not phases[-1] else []
        assert flight.now_ns * 1e-9 - began_s < 70.0
    assert flight.now_ns * 1e-9 - began_s > 55.0
    assert phases == [Phase.ARMING, Phase.PREFLIGHT] * 7 + [Phase.ARMING, Phase.ABORTED]
    assert said(flight).count("arms in 3 s; pause takes the start back") >= 4, (
        "told every ten seconds at most"
    )


def test_one_that_arms_late_is_not_armed_between_two_count_downs() -> None:
    flight = starting_by_itself()
    flight.run(2.1 + 5.2, follow=False)
    assert flight.phase is Phase.PREFLIGHT
    assert flight.demand is Demand.DISARM


def test_what_comes_up_while_it_arms_voids_the_start() -> None:
    flight = waiting(start_countdown_s=0.0)
    flight.order(CommandKind.START)
    flight.run(0.1, follow=False)
    assert flight.mission.state.phase is Phase.ARMING
    flight.set(battery_frac=0.1)
    flight.run(0.7, follow=False)
    assert flight.phase is Phase.PREFLIGHT
    assert said(flight)[-1] == "the start command is void: battery at 10%, 30% needed to start"


def test_nothing_takes_off_from_a_tick_on_which_something_speaks_against_it() -> None:
    flight = waiting(start_countdown_s=0.0)
    flight.order(CommandKind.START)
    flight.run(0.1, follow=False)
    flight.set(battery_frac=0.1, armed=True)
    flight.run(0.3, follow=False)
    assert flight.phase is Phase.ARMING
    flight.run(0.5, follow=False)
    assert (flight.phase, flight.demand) == (Phase.PREFLIGHT, Demand.DISARM)
