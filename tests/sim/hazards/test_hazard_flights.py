"""Hazards flown whole, camera, adapter and autopilot, and judged by the truth: the short form of
`flightd sim --scenario all`, which flies every row of the table with as many seeds as one has time for."""

from __future__ import annotations

from pathlib import Path

import pytest

from flightd.app.simulation.judgement import judge_flight
from flightd.app.simulation.launch import fly
from flightd.app.simulation.prepare import SimOptions, prepare
from flightd.app.simulation.sweep_routes import ACROSS, ALONG, SweepRoute
from flightd.sim.scenario.scenario_files import load_scenario, shipped_scenarios
from tests.rigs.small_camera import AT_ONCE, with_small_camera

ARDUPILOT = ("height_lost", "camera_gone")
PX4 = ("height_stuck", "climb_lost", "ceiling_left")
"""What asks for a landing, by each autopilot's own way of it, and is over soon."""
BETWEEN_ENDS = ("camera_gone",)
"""As above, where the ends of racks leave the body 0.3 m."""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("vehicle", "hazard", "route"),
    [
        *(("ardupilot", name, ALONG) for name in ARDUPILOT),
        *(("px4", name, ALONG) for name in PX4),
        *(("ardupilot", name, ACROSS) for name in BETWEEN_ENDS),
    ],
    ids=lambda told: told.name if isinstance(told, SweepRoute) else None,
)
def test_it_is_found_and_ends_as_the_table_says(
    vehicle: str, hazard: str, route: SweepRoute, tmp_path: Path
) -> None:
    scenario = route.laid(load_scenario(shipped_scenarios()[hazard]))
    options = SimOptions(seed=1 + len(hazard), vehicle=vehicle, settings=AT_ONCE)
    simulation = prepare(
        options,
        with_small_camera(scenario),
        tmp_path,
        lambda _: None,
        sweep_route=route.setting,
    )
    fly(simulation)
    verdict = judge_flight(simulation).hazard
    assert verdict is not None
    assert not verdict.faults, verdict
