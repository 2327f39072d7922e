"""Beside, over and below keep-outs, flown whole in gusts and judged by the truth."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Final

import pytest

from flightd.app.simulation.judgement import judge_flight
from flightd.app.simulation.launch import fly
from flightd.app.simulation.prepare import SimOptions, prepare
from flightd.sim.scenario.scenario import Scenario
from tests.rigs.brisk import QUICK
from tests.rigs.small_camera import AT_ONCE, with_small_camera

SITE: Final = """
[site]
name = "between machines"
ceiling_m = 6.0

[[aisle]]
id = "A"
x_m = 0.0
y_m = 0.0
spacing_m = [1.2, 1.2]
shelves = []

[[pad]]
id = "home"
node = "A1"

[[keep_out]]                     # a machine beside the line, as near as one may stand
x0_m = 0.7
y0_m = 0.65
x1_m = 2.6
y1_m = 2.0

[[keep_out]]                     # a conveyor below it
x0_m = 0.9
y0_m = -1.0
x1_m = 1.2
y1_m = 1.0
to_m = 1.0

[[keep_out]]                     # a beam over it
x0_m = 1.3
y0_m = -1.0
x1_m = 1.5
y1_m = 1.0
from_m = 2.2
"""
GUST: Final = """
[[fault]]
kind = "wind"
at_x_m = 1.3
at_y_m = 0.0
mean_y_mps = 2.8                 # towards the machine
duration_s = 1.0

[expect]
hazard = "corridor_left"
found_s = 2.5
ends = "completed"
"""


@pytest.mark.slow
def test_a_gust_towards_a_keep_out_is_found_while_the_body_is_outside(tmp_path: Path) -> None:
    """Nothing is hit on the way: the machine, the conveyor below, the beam above."""
    (site := tmp_path / "site.toml").write_text(SITE)
    scenario = with_small_camera(Scenario.model_validate(tomllib.loads(GUST)))
    haste = [f"mission.{key}={value}" for key, value in QUICK.items()]
    options = SimOptions(seed=4, warehouse=str(site), settings=[*AT_ONCE, *haste, 'mission.nodes=["A3"]'])
    simulation = prepare(options, scenario, tmp_path / "out", lambda _: None)
    fly(simulation)
    judgement = judge_flight(simulation)
    assert judgement.hazard is not None
    assert not judgement.faults, judgement
    assert judgement.score.min_clearance_m is not None
    assert judgement.score.min_clearance_m < 0.3, "it was off its line"
