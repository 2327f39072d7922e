"""Faults that stay, flown whole: how far the drone drifts until it is down."""

from __future__ import annotations

import math
import signal
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from flightd.app.simulation.judgement import judge_flight
from flightd.app.simulation.launch import FlightInterruptedError, fly
from flightd.app.simulation.prepare import SimOptions, prepare
from flightd.app.simulation.sweep_routes import ALONG
from flightd.core.errors import RunError
from flightd.core.snapshot import Snapshot
from flightd.core.topics import Topic
from flightd.core.types import Phase
from flightd.replay.log import read_log
from flightd.sim.judge.verdict import SAFETY_KINDS
from flightd.sim.scenario.scenario import Scenario
from tests.rigs.small_camera import AT_ONCE, with_small_camera

_WATCHED_NS = 10_000_000_000


def ending_after_a_landing() -> Callable[[Snapshot], None]:
    """Ends a flight ten seconds after it began to land: a silent one is waited for on the floor."""
    landing_ns: list[int] = []

    def observe(status: Snapshot) -> None:
        if status.phase is Phase.LAND:
            landing_ns.append(status.stamp_ns)
            if status.stamp_ns - landing_ns[0] > _WATCHED_NS:
                signal.raise_signal(signal.SIGTERM)

    return observe


def flown_since(
    folder: Path, fault: dict[str, object], observer: Callable[[Snapshot], None] = lambda _: None
) -> list[dict[str, float]]:
    """The true motion from two seconds after a fault on the leg along y = 0 began; nothing is unsafe."""
    scenario = with_small_camera(Scenario.model_validate({"fault": [{"at_x_m": 2.3, "at_y_m": 0.0} | fault]}))
    simulation = prepare(
        SimOptions(seed=11, settings=AT_ONCE), scenario, folder, lambda _: None, sweep_route=ALONG.setting
    )
    try:
        fly(replace(simulation, observer=observer))
    except FlightInterruptedError:
        pass
    except RunError as err:
        pytest.fail(str(err))
    assert not [fault for fault in judge_flight(simulation).faults if fault.kind in SAFETY_KINDS]
    log = read_log(folder / "truth.mcap", {Topic.TRUTH, Topic.FAULT})
    begun_ns = next(entry.stamp_ns for entry in log.entries if entry.topic == Topic.FAULT)
    truth: list[Any] = [entry.message for entry in log.entries if entry.topic == Topic.TRUTH]
    assert truth[-1]["height_m"] < 0.15
    return [k for k in truth if k["stamp_ns"] > begun_ns + 2_000_000_000]


def test_one_that_is_never_heard_again_comes_down_where_it_came_to_rest(tmp_path: Path) -> None:
    truth = flown_since(tmp_path, {"kind": "telemetry_silent"}, ending_after_a_landing())
    first, last = truth[0], truth[-1]
    assert math.hypot(last["x_m"] - first["x_m"], last["y_m"] - first["y_m"]) < 0.4


@pytest.mark.parametrize("turn_deg", [-25.0, 20.0])
def test_a_knocked_camera_does_not_lead_it_off_the_line(tmp_path: Path, turn_deg: float) -> None:
    truth = flown_since(tmp_path, {"kind": "camera_turned", "turn_deg": turn_deg})
    assert max(abs(k["y_m"]) for k in truth) < 0.6, "half the way to a rack"
