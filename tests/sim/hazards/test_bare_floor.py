"""Floor without a line: not taken off from far, and left level where the range finder fails over it, too."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from flightd.app.simulation.judgement import judge_flight
from flightd.app.simulation.launch import fly
from flightd.app.simulation.prepare import SimOptions, prepare
from flightd.app.simulation.sweep_routes import ALONG
from flightd.config.schema import load_config
from flightd.core.topics import Topic
from flightd.core.types import Phase
from flightd.replay.log import read_log
from flightd.sim.judge.verdict import SAFETY_KINDS
from flightd.sim.scenario.scenario import Scenario
from flightd.site.site import PadSign
from flightd.site.site_file import load_site
from tests.rigs.small_camera import with_small_camera
from tests.sim.ideal.ideal_flight import IdealFlight

CONFIGS = Path(__file__).parents[3] / "configs"
CONFIG = load_config(CONFIGS / "sim.toml")
SITE = load_site(CONFIGS / "site-demo.toml")
UNMARKED = replace(SITE, pads=tuple(replace(pad, sign=PadSign.LINE_END) for pad in SITE.pads))
"""Over its pad's mat a drone would climb on."""


@pytest.mark.parametrize("seed", range(1, 4))
def test_a_take_off_that_sees_no_line_ends_low_and_near_its_pad(seed: int) -> None:
    flight = IdealFlight(UNMARKED, CONFIG, visits=("A2",), seed=seed)
    flight.faults.bare = True
    flown = flight.fly(30.0)
    assert (flown.phase, flown.reason) == (Phase.ABORTED, "no line seen in the take-off")
    assert max(k.height_m for _, k in flown.truth) < 1.4
    assert flown.truth[-1][1].height_m < 0.2
    assert max(math.hypot(k.x_m, k.y_m) for _, k in flown.truth) < 1.0


def test_a_low_take_off_ends_in_time_too() -> None:
    low = CONFIG.model_copy(update={"mission": CONFIG.mission.model_copy(update={"height_m": 0.9})})
    flight = IdealFlight(UNMARKED, low, visits=("A2",), seed=1)
    flight.faults.bare = True
    flown = flight.fly(30.0)
    assert flown.reason == "no line seen in the take-off"
    assert max(k.height_m for _, k in flown.truth) < 0.95


def test_features_carry_a_drone_whose_range_finder_fails_where_no_line_is(tmp_path: Path) -> None:
    """What looked like a line there once told the height by its width, and with it the motion."""
    faults = [
        {"kind": "bare_floor", "at_node": "A4", "half_m": 1.08},
        {"kind": "height_quality", "at_s": 19.99, "duration_s": 14.04},
    ]
    scenario = with_small_camera(Scenario.model_validate({"fault": faults}))
    simulation = prepare(
        SimOptions(seed=60797), scenario, tmp_path, lambda _: None, sweep_route=ALONG.setting
    )
    fly(simulation)
    judgement = judge_flight(simulation)
    assert not [fault for fault in judgement.faults if fault.kind in SAFETY_KINDS]
    assert judgement.score.reason in {"height lost", "lines lost for too long"}
    log = read_log(tmp_path / "truth.mcap", {Topic.TRUTH, Topic.FAULT})
    begun_ns = next(entry.stamp_ns for entry in log.entries if entry.topic == Topic.FAULT)
    truth: list[Any] = [
        entry.message for entry in log.entries if entry.topic == Topic.TRUTH and entry.stamp_ns > begun_ns
    ]
    assert max(abs(k["y_m"]) for k in truth) < 0.5
