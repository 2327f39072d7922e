"""What keeps a flight on the ground."""

from __future__ import annotations

from dataclasses import replace

from flightd.config.hazards import LossAction
from flightd.core.types import HEALTHY, Attitude, LandedState, VehicleState
from flightd.mission.guidance import ALL_WELL, MissionInputs
from flightd.mission.reasons import Plain, in_words
from flightd.mission.safety.readiness import obstacles
from tests.unit.mission.configured import configured

PARAMS = configured()
VEHICLE = VehicleState(
    attitude=Attitude(10**9, 0.0, 0.0, 0.0),
    height_m=0.1,
    height_stamp_ns=10**9,
    climb_mps=0.0,
    mode="STABILIZE",
    in_control=False,
    armed=False,
    landed=LandedState.ON_GROUND,
    battery_frac=1.0,
    battery_v=12.6,
    heartbeat_ns=10**9,
)
READY = MissionInputs(
    now_ns=10**9,
    dt_s=0.02,
    pose=None,
    localised=False,
    height_m=0.1,
    frames_arrive=True,
    x_age_s=0.0,
    y_age_s=0.0,
    telemetry_age_s=0.0,
    vehicle=VEHICLE,
)


def test_a_log_that_cannot_be_written_keeps_it_on_the_ground_unless_flights_need_none() -> None:
    full = replace(ALL_WELL, health=replace(HEALTHY, recorder_error="disk full"))
    unwritten = replace(READY, warnings=full)
    for action in LossAction:
        found = obstacles(
            unwritten, PARAMS.with_values(hazards={"record_lost": action}), ground_silent=False, arming=False
        )
        kept = [] if action is LossAction.CONTINUE else ["the flight log cannot be written"]
        assert list(map(in_words, found)) == kept


def test_late_pictures_keep_it_on_the_ground() -> None:
    assert obstacles(READY, PARAMS, ground_silent=False, arming=False) == ()
    late = replace(READY, warnings=replace(ALL_WELL, frame_age_s=PARAMS.hazards.latency_s + 0.05))
    (reason,) = obstacles(late, PARAMS, ground_silent=False, arming=False)
    assert reason is not None
    assert "pictures are more than 250 ms old" in in_words(reason)


def test_a_range_finder_that_measures_from_high_up_only_keeps_it_on_the_ground() -> None:
    """Below its minimum it reads that: a take-off would climb by a height that does not follow."""
    high = replace(READY, height_m=0.6)
    (reason,) = obstacles(high, PARAMS, ground_silent=False, arming=False)
    assert reason is Plain.HIGH_FLOOR
    assert obstacles(replace(READY, height_m=0.35), PARAMS, ground_silent=False, arming=False) == ()


def test_cells_other_than_the_vehicle_tells_keep_it_on_the_ground() -> None:
    """Every low voltage would be wrong."""
    for configured_cells, told, good in ((4, 3, False), (3, 3, True), (None, 3, True), (3, 0, True)):
        vehicle = replace(VEHICLE, battery_cells=told)
        config = PARAMS.with_values(battery={"cells": configured_cells})
        found = obstacles(replace(READY, vehicle=vehicle), config, ground_silent=False, arming=False)
        assert found == (() if good else (Plain.OTHER_CELLS,))
