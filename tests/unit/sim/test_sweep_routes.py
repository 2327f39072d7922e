"""The routes that hazards are flown on."""

from __future__ import annotations

from pathlib import Path

import pytest

from flightd.app.simulation.prepare import SimOptions, prepare
from flightd.app.simulation.scenario_sweep import hazard_scenarios
from flightd.app.simulation.sweep_routes import ACROSS, ALONG, ROUTES, SweepRoute, route_of
from flightd.sim.scenario.scenario import Scenario
from flightd.sim.scenario.scenario_files import load_scenario, shipped_scenarios


def test_of_consecutive_seeds_as_many_fly_along_as_across() -> None:
    gone = load_scenario(shipped_scenarios()["camera_gone"])
    flown = [route_of(seed, gone) for seed in range(1, 21)]
    assert [flown.count(route) for route in ROUTES] == [10, 10]


@pytest.mark.parametrize("name", ["map_wrong", "lines_lost"])
def test_what_is_made_for_the_aisle_is_flown_along_it(name: str) -> None:
    assert route_of(2, load_scenario(shipped_scenarios()[name])) == ALONG


@pytest.mark.parametrize("route", ROUTES, ids=lambda route: route.name)
def test_every_shipped_scenario_can_be_flown_on_it(route: SweepRoute, tmp_path: Path) -> None:
    for name in hazard_scenarios():
        laid = route.laid(load_scenario(shipped_scenarios()[name]))
        simulation = prepare(SimOptions(), laid, tmp_path / name, lambda _: None, sweep_route=route.setting)
        assert simulation.config.mission.nodes == route.nodes


def test_across_a_fault_of_a_place_begins_between_the_racks_ends_and_wind_blows_across() -> None:
    wind = {"kind": "wind", "at_x_m": 2.3, "at_y_m": 0.0, "mean_x_mps": 0.5, "mean_y_mps": 3.5}
    told = Scenario.model_validate({"fault": [wind, {"kind": "camera_gone", "at_s": 3.0}]})
    moved, timed = ACROSS.laid(told).fault
    assert (moved.at_x_m, moved.at_y_m) == ACROSS.place_m
    assert moved.model_dump(include={"mean_x_mps", "mean_y_mps"}) == {"mean_x_mps": -3.5, "mean_y_mps": 0.5}
    assert timed == told.fault[1]
    assert ALONG.laid(told).fault == told.fault
