"""Without a view: when it sinks, how fast, and when it has to land."""

from __future__ import annotations

import math
from dataclasses import replace

from hypothesis import given
from hypothesis import strategies as st

from flightd.mission.guidance import ALL_WELL, MissionInputs
from flightd.mission.safety.view_monitor import FloorViewMonitor
from tests.unit.mission.configured import configured

PARAMS = configured()
EXPERT = PARAMS.mission.expert


def inputs(x_age_s: float, y_age_s: float, frame_age_s: float = 0.0) -> MissionInputs:
    return MissionInputs(
        now_ns=10**9,
        dt_s=0.02,
        pose=None,
        localised=True,
        height_m=1.6,
        frames_arrive=True,
        x_age_s=x_age_s,
        y_age_s=y_age_s,
        telemetry_age_s=0.0,
        vehicle=None,
        warnings=replace(ALL_WELL, frame_age_s=frame_age_s),
    )


def test_a_camera_that_shows_nothing_makes_it_sink_and_pictures_without_lines_do_not() -> None:
    monitor = FloorViewMonitor(PARAMS)
    monitor.step(inputs(0.5, 0.5, frame_age_s=0.5), leg_along_x=True)
    assert monitor.is_blind
    assert monitor.sink_mps(1.6) > 0.0
    assert monitor.sink_mps(PARAMS.hazards.expert.blind_m) == 0.0
    monitor.step(inputs(0.5, 0.5), leg_along_x=True)
    assert not monitor.is_blind


def over(monitor: FloorViewMonitor, seconds: float, leg_along_x: bool, telemetry_age_s: float = 0.0) -> bool:
    """Whether it has to land after seeing only lines that cross the x axis for so long."""
    for tick in range(round(seconds / 0.02)):
        at = replace(inputs(0.0, tick * 0.02), now_ns=tick * 20_000_000, telemetry_age_s=telemetry_age_s)
        monitor.step(at, leg_along_x)
    return monitor.too_long


def test_on_a_leg_only_the_line_that_is_followed_keeps_it_in_the_air() -> None:
    seconds = PARAMS.hazards.expert.search_land_s + 0.2
    assert over(FloorViewMonitor(PARAMS), seconds, leg_along_x=True)
    assert not over(FloorViewMonitor(PARAMS), seconds, leg_along_x=False)


def test_lost_telemetry_is_not_taken_for_a_lost_view() -> None:
    assert not over(FloorViewMonitor(PARAMS), 2.5, leg_along_x=True, telemetry_age_s=1.0)


@given(st.floats(0.0, 20.0), st.floats(0.0, 20.0))
def test_a_blind_descent_never_stops_and_is_gentle_at_the_floor(a_m: float, b_m: float) -> None:
    monitor = FloorViewMonitor(PARAMS)
    low, high = sorted((a_m, b_m))
    assert EXPERT.touch_blind_mps <= monitor.rate_mps(low) <= monitor.rate_mps(high) <= EXPERT.blind_mps
    assert monitor.rate_mps(0.1) == EXPERT.touch_blind_mps
    assert monitor.rate_mps(math.nan) == PARAMS.mission.land_mps
