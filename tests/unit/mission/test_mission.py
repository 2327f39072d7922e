"""The mission by time: what it does when things are lost, late, low or ordered at the wrong moment."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from flightd.config.battery import BatteryConfig
from flightd.config.hazards import LossAction
from flightd.config.scan import ScanConfig
from flightd.core.types import (
    HEALTHY,
    CommandKind,
    Demand,
    LandedState,
    Phase,
)
from flightd.mission.flight.relocation import Relocator
from flightd.mission.guidance import ALL_WELL, Guide, Warnings
from flightd.mission.machine import Intent, State
from flightd.mission.scan.scanner import Scanner
from tests.unit.mission import shelves
from tests.unit.mission.configured import configured
from tests.unit.mission.driven import SITE, TICK_NS, Flight


def test_a_flight_where_all_is_well_visits_everything() -> None:
    flight = Flight()
    flight.to(Phase.LAND, 600)
    flight.set(landed=LandedState.ON_GROUND)
    flight.run(0.1)
    assert flight.guidance is not None
    assert flight.guidance.demand is Demand.DISARM
    flight.set(armed=False)
    flight.run(0.1)
    assert flight.phase is Phase.DONE
    assert flight.mission.visited == list(SITE.serpentine_route())


def test_a_correction_over_the_pad_is_the_reason_for_the_end_that_it_makes() -> None:
    flight = Flight()
    flight.to(Phase.LAND, 600)
    pose = flight.inputs.pose
    assert pose is not None
    flight.set(pose=replace(pose, x_m=pose.x_m + 2.0))
    flight.run(0.1, follow=False)
    assert flight.phase is Phase.LAND
    assert flight.mission.reason == "the position was corrected while landing"
    flight.set(landed=LandedState.ON_GROUND, armed=False)
    flight.run(0.1, follow=False)
    assert flight.mission.state == State(Phase.ABORTED, Intent.END)
    assert flight.mission.reason == "the position was corrected while landing"


@pytest.mark.parametrize("orders", [("stop", "land"), ("land", "stop")])
def test_a_stop_stands_whatever_else_is_ordered_at_the_same_tick(orders: tuple[str, str]) -> None:
    flight = Flight()
    flight.to(Phase.FOLLOW)
    for order in orders:
        flight.order(CommandKind(order))
    flight.run(0.02)
    assert flight.mission.state == State(Phase.LAND, Intent.STOP)
    assert flight.guidance is not None
    assert flight.guidance.at_once


def test_a_stop_as_it_comes_to_stand_on_the_pad_ends_the_mission() -> None:
    flight = Flight()
    flight.to(Phase.LAND, 600)
    flight.order(CommandKind.STOP)
    flight.set(landed=LandedState.ON_GROUND, armed=False)
    flight.run(0.1, follow=False)
    assert (flight.phase, flight.mission.reason) == (Phase.ABORTED, "stop ordered")


def test_a_pause_lasts_no_longer_than_a_full_battery() -> None:
    """Whatever the vehicle says of its charge."""
    flight = Flight(configured(BatteryConfig(flight_s=200.0), dwell_s=1.0))
    flight.to(Phase.FOLLOW)
    flight.order(CommandKind.PAUSE)
    flight.run(199.0)
    assert flight.phase is Phase.HOLD
    flight.run(2.0)
    assert (flight.phase, flight.mission.reason) == (Phase.LAND, "the phase took too long")


def test_on_the_ground_only_a_hazard_that_decides_something_is_told() -> None:
    flight = Flight(configured(autostart=False))
    flight.set(localised=False, x_age_s=60.0, y_age_s=60.0)
    flight.run(2.0)
    assert not [event for event in flight.mission.drain_events() if event.name == "hazard"]
    flight.set(localised=True, x_age_s=0.0, y_age_s=0.0)
    flight.order(CommandKind.START)
    flight.to(Phase.FOLLOW)
    flight.order(CommandKind.LAND)
    flight.to(Phase.LAND)
    flight.set(landed=LandedState.ON_GROUND, armed=False)
    flight.run(0.1)
    assert flight.phase is Phase.ABORTED
    flight.mission.drain_events()
    flight.set(localised=False, x_age_s=60.0, y_age_s=60.0, ground_silent_s=60.0)
    flight.run(2.0)
    assert not [event for event in flight.mission.drain_events() if event.name == "hazard"]


def test_a_position_lost_between_two_flights_does_not_shift_the_second_one() -> None:
    relocator = Relocator(configured().mission, math.inf, ())
    flight = Flight()
    flight.to(Phase.FOLLOW)
    sure = flight.inputs
    assert sure.pose is not None
    for tick, pose in enumerate((sure.pose, None, replace(sure.pose, x_m=sure.pose.x_m + 7.0))):
        relocator.step(replace(sure, now_ns=tick * TICK_NS, pose=pose), Phase.TAKE_OFF, 1.0)
        assert not relocator.jumped


def test_a_lost_link_is_no_pilot_and_ends_in_a_landing() -> None:
    flight = Flight()
    flight.to(Phase.FOLLOW)
    flight.set(in_control=False, telemetry_age_s=1.0)
    flight.run(1.0)
    assert flight.phase is not Phase.PILOT
    flight.set(telemetry_age_s=3.5)
    flight.run(0.1)
    assert flight.phase is Phase.LAND
    flight.run(5.0)
    assert flight.phase is Phase.LAND
    flight.set(telemetry_age_s=0.0)
    flight.run(0.1)
    assert flight.mission.phase.value == "pilot", "heard again, and somebody has taken it"


def test_without_a_height_nothing_climbs_and_soon_it_lands() -> None:
    flight = Flight()
    flight.to(Phase.TAKE_OFF)
    flight.set(height_m=math.nan)
    flight.run(1.0)
    assert flight.guidance is not None
    assert flight.guidance.reference.climb_mps == 0.0
    assert math.isfinite(flight.guidance.reference.height_m)
    flight.run(3.0)
    assert flight.phase is Phase.LAND
    assert flight.mission.reason == "height lost"


def test_it_does_not_arm_for_flight_without_a_height() -> None:
    flight = Flight()
    flight.to(Phase.ARMING)
    flight.set(height_m=math.nan)
    flight.run(30.0)
    assert flight.phase.value == "preflight"


def test_stale_telemetry_stops_the_climb() -> None:
    flight = Flight()
    flight.to(Phase.TAKE_OFF)
    flight.run(0.5)
    flight.set(telemetry_age_s=0.5)
    flight.run(0.2)
    assert flight.guidance is not None
    assert (flight.guidance.guide, flight.guidance.reference.climb_mps) == (Guide.LEVEL, 0.0)


@pytest.mark.parametrize(("battery", "words"), [(math.nan, "no battery level"), (0.2, "20%")])
def test_it_does_not_start_on_a_battery_it_cannot_trust(battery: float, words: str) -> None:
    flight = Flight()
    flight.set(battery_frac=battery)
    flight.run(1.0)
    assert flight.phase is Phase.PREFLIGHT
    assert words in flight.mission.reason


def test_one_dropout_after_a_long_pause_does_not_land() -> None:
    flight = Flight()
    flight.to(Phase.FOLLOW)
    flight.order(CommandKind.PAUSE)
    flight.run(20.0)
    assert flight.phase is Phase.HOLD
    flight.set(x_age_s=0.4, y_age_s=0.4)
    flight.run(0.1)
    flight.set(x_age_s=0.0, y_age_s=0.0)
    flight.order(CommandKind.RESUME)
    flight.run(2.0)
    assert flight.phase in {Phase.ACQUIRE, Phase.TURN, Phase.FOLLOW, Phase.HOVER}


def test_lines_that_only_flicker_end_in_a_landing() -> None:
    flight = Flight()
    flight.to(Phase.FOLLOW)
    for _ in range(12):
        flight.set(x_age_s=9.0, y_age_s=9.0)
        flight.run(0.6)
        flight.set(x_age_s=0.0, y_age_s=0.0)
        flight.run(0.4)
        if flight.phase is Phase.LAND:
            break
    assert flight.phase is Phase.LAND


def test_a_view_lost_at_height_is_borne_as_long_as_any_however_long_the_climb_saw_no_line() -> None:
    flight = Flight(configured(climb_mps=0.2))
    flight.set(x_age_s=60.0, y_age_s=60.0, by_pad=True)
    flight.to(Phase.TAKE_OFF)
    flight.run(60.0, lambda: flight.inputs.height_m > 1.35)
    flight.set(x_age_s=0.0, y_age_s=0.0, by_pad=False)  # but not for long enough to count as found
    flight.to(Phase.ACQUIRE)
    flight.set(x_age_s=0.5, y_age_s=0.5)
    flight.run(1.0)
    assert flight.phase is Phase.HOLD
    flight.set(x_age_s=0.0, y_age_s=0.0)
    flight.to(Phase.FOLLOW)


def test_on_a_leg_other_lines_do_not_stand_in_for_the_one_followed() -> None:
    flight = Flight()
    flight.to(Phase.FOLLOW)
    flight.run(2.0, lambda: flight.mission.goal.node == "A2")
    flight.to(Phase.FOLLOW)
    flight.set(y_age_s=1.0)
    flight.run(0.1)
    assert flight.phase is Phase.HOLD


@pytest.mark.parametrize("lost", ["aisle_open", "record_lost"])
def test_what_is_answered_by_a_hold_holds(lost: str) -> None:
    """It held and went on by turns, tick by tick, with an event for each."""
    flight = Flight(configured(dwell_s=1.0).with_values(hazards={lost: LossAction.HOLD}))
    flight.to(Phase.FOLLOW)
    flight.mission.drain_events()
    changes: dict[str, dict[str, object]] = {
        "aisle_open": {"aisle_closed": False},
        "record_lost": {"warnings": replace(ALL_WELL, health=replace(HEALTHY, recorder_error="disk full"))},
    }
    flight.set(**changes[lost])
    flight.run(5.0)
    begun = [event for event in flight.mission.drain_events() if event.name == "phase"]
    assert len(begun) == 1
    assert flight.phase is Phase.HOLD
    flight.set(aisle_closed=True, warnings=ALL_WELL)
    flight.to(Phase.FOLLOW)


def test_a_take_off_whose_pictures_stop_lands() -> None:
    """A busy computer's gap is no reason for that."""
    flight = Flight()
    flight.to(Phase.TAKE_OFF)
    flight.run(0.5)
    flight.set(warnings=replace(ALL_WELL, frame_age_s=0.6))
    flight.run(0.1)
    assert flight.phase.value == "take_off"
    flight.set(warnings=replace(ALL_WELL, frame_age_s=1.1))
    flight.to(Phase.LAND, within_s=0.1)


@pytest.mark.parametrize(
    ("height_m", "frozen_s", "blank_s", "lands"),
    [
        (0.6, 1.1, 0.0, True),
        (0.6, 0.9, 0.0, False),
        (0.3, 9.0, 0.0, False),
        (0.6, 9.0, 9.0, True),
        (0.6, 0.0, 1.1, True),
        (0.6, 0.0, 0.9, False),
        (0.3, 9.0, 9.0, False),
    ],
)
def test_a_take_off_whose_picture_shows_nothing_new_lands(
    height_m: float, frozen_s: float, blank_s: float, lands: bool
) -> None:
    """It climbed on without steering.  Near the pad a picture is allowed to be the same, or black."""
    flight = Flight()
    flight.to(Phase.TAKE_OFF)
    flight.run(3.0, lambda: flight.inputs.height_m > height_m)
    flight.set(warnings=replace(ALL_WELL, frozen_s=frozen_s, blank_s=blank_s))
    flight.run(0.1)
    assert flight.phase is (Phase.LAND if lands else Phase.TAKE_OFF)


@pytest.mark.parametrize(
    "old",
    [replace(ALL_WELL, frozen_s=0.3), replace(ALL_WELL, blank_s=0.3), replace(ALL_WELL, frame_age_s=0.3)],
    ids=["frozen", "blank", "stale"],
)
def test_a_take_off_climbs_no_further_by_old_pictures(old: Warnings) -> None:
    flight = Flight(configured(height_m=4.2))
    flight.to(Phase.TAKE_OFF)
    flight.run(5.0, lambda: flight.inputs.height_m > 0.9)
    flight.set(x_age_s=0.3, y_age_s=0.3, warnings=old)
    flight.run(0.5)
    assert flight.phase is Phase.TAKE_OFF
    assert flight.inputs.height_m < 0.95
    flight.set(x_age_s=0.0, y_age_s=0.0, warnings=ALL_WELL)
    flight.to(Phase.ACQUIRE)


@pytest.mark.parametrize(
    ("from_m", "age_s", "by_pad", "lands"),
    [(1.1, 9.0, False, True), (1.1, 0.2, False, False), (1.1, 9.0, True, False), (0.5, 9.0, False, False)],
)
def test_a_take_off_that_lost_the_lines_it_saw_lands(
    from_m: float, age_s: float, by_pad: bool, lands: bool
) -> None:
    """It climbed on to its flying height, however high.  Near the floor they come and go."""
    flight = Flight(configured(height_m=4.2))
    flight.to(Phase.TAKE_OFF)
    flight.run(5.0, lambda: flight.inputs.height_m > from_m)
    flight.set(x_age_s=age_s, y_age_s=age_s, by_pad=by_pad)
    flight.run(0.9)
    assert flight.phase is Phase.TAKE_OFF
    assert not lands or flight.inputs.height_m < from_m + 0.5
    flight.run(0.8 if lands else 0.02)
    assert flight.phase is (Phase.LAND if lands else Phase.TAKE_OFF)


def test_a_long_leg_is_given_its_time() -> None:
    """Ten times as long as the slack that every phase has."""
    flight = Flight(configured(dwell_s=0.0, speed_mps=0.1, accel_mps2=0.5, expert={"phase_slack_s": 3.0}))
    flight.to(Phase.LAND, 1200)
    assert flight.mission.reason == "route done"


@pytest.mark.parametrize("kind", [CommandKind.STOP, CommandKind.LAND])
def test_an_order_to_end_before_the_start_never_arms(kind: CommandKind) -> None:
    flight = Flight(configured(autostart=False))
    flight.run(0.2)
    flight.order(kind)
    flight.order(CommandKind.START)
    demands = set()
    for _ in range(50):
        flight.run(0.02)
        assert flight.guidance is not None
        demands.add(flight.guidance.demand)
    assert flight.phase is Phase.ABORTED
    assert Demand.FLY not in demands


def test_low_battery_flies_home_even_when_paused_and_without_dwelling() -> None:
    flight = Flight(configured(dwell_s=500.0))
    flight.to(Phase.FOLLOW)
    flight.order(CommandKind.PAUSE)
    flight.run(2.0)
    flight.set(battery_frac=0.15)
    flight.order(CommandKind.GOTO, "A3")
    flight.to(Phase.LAND, 120)
    assert flight.mission.reason == "route done"
    assert flight.mission.goal.node == SITE.home.node


@pytest.mark.parametrize("lost", ["ground", "aisle"])
def test_a_hold_for_what_was_lost_ends_when_the_battery_needs_the_way_home(lost: str) -> None:
    """It held until the battery was critical, and came down there."""
    losses = {"ground": {"lost_action": LossAction.HOLD}, "hazards": {"aisle_open": LossAction.HOLD}}
    flight = Flight(configured(dwell_s=1.0).with_values(**losses))
    flight.to(Phase.FOLLOW)
    flight.set(ground_silent_s=60.0 if lost == "ground" else 0.0, aisle_closed=lost == "ground")
    flight.run(20.0)
    assert flight.phase is Phase.HOLD
    flight.set(battery_frac=0.18)
    flight.to(Phase.LAND, 120)
    assert (flight.mission.reason, flight.mission.goal.node) == ("route done", SITE.home.node)


def test_on_an_ordered_way_home_too_no_hold_outlasts_what_the_way_needs() -> None:
    """A pause that comes after that stands: somebody wants it so."""
    flight = Flight()
    flight.to(Phase.FOLLOW)
    flight.order(CommandKind.HOME)
    flight.order(CommandKind.PAUSE)
    flight.run(20.0)
    assert flight.mission.state == State(Phase.HOLD, Intent.HOME)
    flight.set(battery_frac=0.18)
    flight.to(Phase.FOLLOW, 20)
    flight.order(CommandKind.PAUSE)
    flight.run(20.0)
    assert flight.phase is Phase.HOLD
    flight.order(CommandKind.RESUME)
    flight.to(Phase.LAND, 120)
    assert flight.mission.goal.node == SITE.home.node


def test_a_charge_that_is_not_known_ends_a_hold() -> None:
    losses = {"ground": {"lost_action": LossAction.HOLD}, "hazards": {"battery_unknown": LossAction.HOME}}
    flight = Flight(configured(dwell_s=1.0).with_values(**losses))
    flight.to(Phase.FOLLOW)
    flight.set(ground_silent_s=60.0)
    flight.run(5.0)
    assert flight.phase is Phase.HOLD
    flight.set(battery_frac=math.nan)
    flight.to(Phase.LAND, 120)
    assert flight.mission.goal.node == SITE.home.node


def test_a_pause_with_an_unknown_charge_ends_before_the_battery() -> None:
    """It could last as long as a full battery does, whatever was left of this one."""
    losses = {"hazards": {"battery_unknown": LossAction.HOME}}
    flight = Flight(configured(BatteryConfig(flight_s=150.0)).with_values(**losses))
    flight.to(Phase.FOLLOW)
    flight.set(battery_frac=math.nan)
    flight.run(0.1)
    assert flight.mission.state.intent is Intent.HOME
    flight.order(CommandKind.PAUSE)
    flight.run(100.0)
    assert flight.phase is Phase.HOLD
    flight.to(Phase.LAND, 20.0)
    assert flight.mission.reason == "battery critical"


def test_home_is_refused_on_the_floor() -> None:
    flight = Flight(configured(autostart=False))
    flight.run(0.1)
    flight.order(CommandKind.HOME)
    flight.order(CommandKind.START)
    flight.to(Phase.FOLLOW)
    assert any("home refused" in event.text for event in flight.mission.drain_events())


def test_a_moment_of_doubt_as_a_view_ends_does_not_hold_the_scan_for_ever() -> None:
    scanner = Scanner(shelves.SITE, shelves.SIGHT, ScanConfig(max_height_m=4.0, view_s=2.0, retakes=0))
    flight = Flight(configured(expert={"view_height_m": 0.15}), shelves.SITE, scanner)
    flight.to(Phase.SCAN)
    first = scanner.view
    flight.run(1.9)
    flight.integrity = 0.9
    flight.run(0.2)
    flight.integrity = 1.0
    assert flight.phase is Phase.SCAN
    flight.to(Phase.CLIMB, 1.0)
    assert scanner.view is not first


def test_a_pause_in_a_hold_that_a_hazard_began_is_told() -> None:
    flight = Flight()
    flight.to(Phase.FOLLOW)
    flight.set(warnings=replace(ALL_WELL, frozen_s=9.0))
    flight.run(0.1, follow=False)
    assert (flight.phase, flight.mission.reason) == (Phase.HOLD, "camera frozen")
    flight.order(CommandKind.PAUSE)
    flight.run(0.02, follow=False)
    assert flight.mission.reason == "camera frozen; paused besides, until resume"
    flight.order(CommandKind.RESUME)
    flight.run(0.02, follow=False)
    assert flight.mission.reason == "camera frozen"


def test_a_turn_that_is_broken_off_comes_to_rest() -> None:
    flight = Flight()
    turns = (Phase.TURN, Phase.FOLLOW)
    flight.run(120.0, lambda: flight.phase in turns and abs(yaw_rate_of(flight)) > 0.3)
    assert abs(yaw_rate_of(flight)) > 0.3
    flight.order(CommandKind.PAUSE)
    flight.run(2.0)
    assert flight.phase is Phase.HOLD
    assert yaw_rate_of(flight) == pytest.approx(0.0, abs=1e-3)


def yaw_rate_of(flight: Flight) -> float:
    return 0.0 if flight.guidance is None else flight.guidance.reference.yaw_rate_radps
