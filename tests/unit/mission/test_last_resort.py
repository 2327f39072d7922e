"""What is flown when the mission cannot be stepped: by the vehicle's word alone."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from flightd.core.shared_pose import SharedPose
from flightd.core.tick import TickInput, TickOutput
from flightd.core.types import (
    AttitudeSetpoint,
    Command,
    CommandKind,
    Demand,
    GridPose,
    LandedState,
    Phase,
    VehicleState,
)
from flightd.mission.event_log import EventLog
from flightd.mission.guidance import Guide, MissionInputs, Warnings
from flightd.mission.plan.flight_plan import make_plan
from flightd.mission.plan.itinerary import Itinerary
from flightd.mission.safety.last_resort import LastResort, Sinking, sinking_by_sight
from tests.unit.mission.configured import configured
from tests.unit.mission.driven import POLICY, SITE
from tests.unit.mission.test_readiness import VEHICLE

NOW_NS = 10**9
LONG_AGO = replace(VEHICLE.attitude, stamp_ns=NOW_NS - 4 * 10**9)
LOST_NS = NOW_NS - 4 * 10**9
FLYING = replace(VEHICLE, armed=True, in_control=True, landed=LandedState.IN_AIR, height_m=1.5)


SURE = (1e-4, 1e-4)
SHARED = SharedPose(1, VEHICLE.attitude, 0.0, 3.0, 0.0, 0.5, 0.0, 1.5, SURE, SURE, 1e-4, 1.0)
FOLLOWS = TickOutput(None, Demand.FLY, Phase.FOLLOW, "", "A2", 1, 2, None, None)


def given_up() -> LastResort:
    resort = LastResort(configured().mission)
    for text in ("first", "second"):
        resort.caught(NOW_NS, ValueError(text))
    return resort


def answers(vehicle: VehicleState | None, before: Phase = Phase.FOLLOW) -> tuple[Phase, Demand, bool]:
    resort = LastResort(configured().mission)
    answer = resort.step(NOW_NS, vehicle, before)
    if answer.setpoint is not None:
        assert (answer.setpoint.roll_rad, answer.setpoint.pitch_rad) == (0.0, 0.0)
        assert answer.setpoint.climb_mps < 0.0
    return answer.phase, answer.demand, answer.setpoint is not None


@pytest.mark.parametrize(
    ("vehicle", "before", "expected"),
    [
        (FLYING, Phase.FOLLOW, (Phase.LAND, Demand.LAND, True)),
        (replace(FLYING, landed=LandedState.ON_GROUND), Phase.LAND, (Phase.LAND, Demand.DISARM, True)),
        (replace(FLYING, in_control=False), Phase.FOLLOW, (Phase.PILOT, Demand.HANDS_OFF, False)),
        (FLYING, Phase.PILOT, (Phase.PILOT, Demand.HANDS_OFF, False)),
        # nothing is heard any more, not even in which mode it is: landed unheard
        (replace(FLYING, in_control=False, attitude=LONG_AGO), Phase.LAND, (Phase.LAND, Demand.LAND, True)),
        # heartbeats alone fail to come: the mode is of the past, and no pilot's
        (
            replace(FLYING, in_control=False, heartbeat_ns=LOST_NS, unheard=True),
            Phase.LAND,
            (Phase.LAND, Demand.LAND, True),
        ),
        (replace(FLYING, in_control=False), Phase.RECOVER, (Phase.RECOVER, Demand.KEEP, True)),
        (replace(FLYING, heartbeat_ns=0), Phase.FOLLOW, (Phase.LAND, Demand.LAND, True)),
        (VEHICLE, Phase.PREFLIGHT, (Phase.ABORTED, Demand.DISARM, False)),
        (None, Phase.PREFLIGHT, (Phase.ABORTED, Demand.DISARM, False)),
        (FLYING, Phase.ABORTED, (Phase.ABORTED, Demand.LAND, False)),
    ],
)
def test_it_lands_what_flies_and_leaves_the_rest(
    vehicle: VehicleState | None, before: Phase, expected: tuple[Phase, Demand, bool]
) -> None:
    assert answers(vehicle, before) == expected


def test_silence_is_no_pilot_however_long_it_is_waited_through() -> None:
    """Attitudes come, heartbeats have just been missing for so long that the mode is not known any more."""
    resort = LastResort(configured(telemetry_hold_s=2.0).mission)
    silent = replace(FLYING, in_control=False, heartbeat_ns=NOW_NS - 3_100_000_000, unheard=True)
    assert resort.step(NOW_NS, silent, Phase.LAND).demand is Demand.LAND


def test_a_vehicle_that_tells_nothing_any_more_is_landed_where_it_flew_when_it_last_did() -> None:
    """It was asked to disarm."""
    resort = LastResort(configured().mission)
    resort.seen = FLYING
    assert resort.step(NOW_NS, None, Phase.FOLLOW).demand is Demand.LAND
    assert resort.step(NOW_NS + 10 * 10**9, None, Phase.LAND).demand is Demand.LAND
    last = resort.step(NOW_NS + 70 * 10**9, None, Phase.LAND)
    assert (last.phase, last.demand) == (Phase.ABORTED, Demand.LAND)
    standing = LastResort(configured().mission)
    standing.seen = VEHICLE
    assert standing.step(NOW_NS, None, Phase.PREFLIGHT).demand is Demand.DISARM


def test_the_mission_is_given_up_at_its_second_failure() -> None:
    resort, flying = LastResort(configured().mission), TickInput(NOW_NS, vehicle=FLYING)
    last = TickOutput(None, Demand.FLY, Phase.FOLLOW, "", "A2", 1, 2, None, None)
    resort.caught(NOW_NS, ValueError("first"))
    last = resort.answer(flying, last, tuple, lambda: ((), ()), lambda: None)
    assert (last.phase, last.demand, resort.given_up) == (Phase.FOLLOW, Demand.FLY, False)
    resort.caught(NOW_NS, ValueError("second"))
    last = resort.answer(flying, last, tuple, lambda: ((), ()), lambda: None)
    assert (last.phase, last.demand, resort.given_up) == (Phase.LAND, Demand.LAND, True)
    assert [event.name for event in last.events] == ["step_failed", "hazard", "phase"]


def test_without_the_mission_it_sinks_by_sight_once_and_never_again_after_that_has_failed() -> None:
    resort, flying = given_up(), TickInput(NOW_NS, vehicle=FLYING)
    leaning = AttitudeSetpoint(NOW_NS, 0.05, climb_mps=-0.3)

    def broken() -> Sinking:
        raise ValueError("this, too")

    def answered(by_sight: Callable[[], Sinking | None], now_ns: int = NOW_NS) -> TickOutput:
        return resort.answer(replace(flying, now_ns=now_ns), FOLLOWS, tuple, lambda: ((), ()), by_sight)

    sinking = answered(lambda: Sinking(leaning, SHARED))
    assert (sinking.setpoint, sinking.demand, sinking.shared) == (leaning, Demand.KEEP, SHARED)
    for by_sight in (broken, lambda: Sinking(leaning)):
        level = answered(by_sight)
        assert (level.demand, level.setpoint and level.setpoint.roll_rad) == (Demand.LAND, 0.0)


@pytest.mark.parametrize("kind", [CommandKind.STOP, CommandKind.LAND, CommandKind.PAUSE])
def test_an_order_to_come_down_is_not_put_off(kind: CommandKind) -> None:
    resort = given_up()
    ordered = TickInput(NOW_NS, vehicle=FLYING, commands=(Command("order", kind),))
    leaning = AttitudeSetpoint(NOW_NS, 0.05)
    answer = resort.answer(ordered, FOLLOWS, tuple, lambda: ((), ()), lambda: Sinking(leaning))
    assert (answer.demand is Demand.LAND) is (kind is not CommandKind.PAUSE)
    assert resort.sinks_by_sight is (kind is CommandKind.PAUSE)


def test_a_landing_that_was_asked_for_and_one_found_flying_are_left_to_the_autopilot() -> None:
    flying, leaning = TickInput(NOW_NS, vehicle=FLYING), AttitudeSetpoint(NOW_NS, 0.05)
    adopted = given_up()
    adopted.found_flying()
    for resort, last in ((given_up(), replace(FOLLOWS, demand=Demand.LAND)), (adopted, FOLLOWS)):
        answer = resort.answer(flying, last, tuple, lambda: ((), ()), lambda: Sinking(leaning))
        assert (answer.demand, answer.setpoint and answer.setpoint.roll_rad) == (Demand.LAND, 0.0)


def test_sinking_by_sight_ends_by_time() -> None:
    resort, last = given_up(), FOLLOWS
    demands = []
    for now_s in (1, 20, 22):
        now_ns = now_s * 10**9
        heard = replace(VEHICLE.attitude, stamp_ns=now_ns)
        vehicle = replace(FLYING, attitude=heard, heartbeat_ns=now_ns)
        leaning = AttitudeSetpoint(now_ns, 0.05)
        tick = TickInput(now_ns, vehicle=vehicle)
        demands.append(resort.answer(tick, last, tuple, lambda: ((), ()), lambda: Sinking(leaning)).demand)  # noqa: B023
    assert demands == [Demand.KEEP, Demand.KEEP, Demand.LAND]


@pytest.mark.parametrize(
    "less",
    [
        {"pose": None},
        {"vehicle": None},
        {"vehicle": VEHICLE},
        {"vehicle": replace(FLYING, in_control=False)},
        {"vehicle": replace(FLYING, landed=LandedState.ON_GROUND)},
        {"vehicle": replace(FLYING, hovers_unsteered=True)},
        {"x_age_s": 0.5, "y_age_s": 0.5},
        {"telemetry_age_s": 0.3},
        {"height_m": 0.3},
        {"height_m": math.nan},
        {"warnings": Warnings(height_stuck=True)},
        {"warnings": Warnings(climb_wrong=True)},
        {"warnings": Warnings(height_doubted=True, height_error_m=1.2)},
    ],
    ids=str,
)
def test_it_sinks_by_sight_only_where_sight_attitude_height_and_vehicle_tell_enough(
    less: dict[str, Any],
) -> None:
    at_b = GridPose(0, "A2", 0, 0, 0.0, 3.0, 0.1, 0.4, 0, 1.5, (0.0,) * 9, 1.0)
    known = MissionInputs(
        now_ns=NOW_NS,
        dt_s=0.02,
        pose=at_b,
        localised=True,
        height_m=1.5,
        frames_arrive=True,
        x_age_s=0.1,
        y_age_s=0.1,
        telemetry_age_s=0.05,
        vehicle=FLYING,
    )
    guidance = sinking_by_sight(known, 0.35)
    assert guidance is not None
    assert (guidance.guide, guidance.reference.climb_mps) == (Guide.BRAKE, -0.35)
    assert sinking_by_sight(replace(known, **less), 0.35) is None


def test_what_is_no_longer_known_is_told_to_nobody() -> None:
    resort = LastResort(configured().mission)
    at_a2 = GridPose(0, "A2", 0, 0, 0.0, 3.0, 0.1, 0.4, 0, 1.5, (0.0,) * 9, 1.0)
    last = TickOutput(None, Demand.FLY, Phase.FOLLOW, "", "A2", 1, 2, at_a2, None, shared=SHARED)
    resort.caught(NOW_NS, ValueError("first"))
    answer = resort.answer(TickInput(NOW_NS, vehicle=FLYING), last, tuple, lambda: ((), ()), lambda: None)
    assert (answer.pose, answer.tracks, answer.shared) == (None, None, None)


def test_a_node_behind_a_barrier_leads_nowhere() -> None:
    home, aisle = SITE.home.node, SITE.aisles[0].id
    a, b = SITE.aisle_nodes(aisle)[-2:]
    shut = tuple((b.id, other) for other in SITE.neighbours(b.id))
    closed = replace(SITE, blocked=shut)
    plan = make_plan(closed, [a.id], home, home, POLICY)
    itinerary = Itinerary(closed, plan, POLICY, EventLog())
    at_b = GridPose(0, b.id, 0, 0, 0.0, b.x_m, b.y_m, 0, 0, 1.5, (0.0,) * 9, 1.0)
    assert not itinerary.leads_on_from(at_b)
    assert itinerary.leads_on_from(replace(at_b, node=a.id))
