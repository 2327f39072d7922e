"""What `flightd sim` prints of one flight, by flights that only pretend."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from flightd.app.daemon import FlightResult
from flightd.app.simulation import summary as summaries
from flightd.app.simulation.simulation import Simulation
from flightd.core.types import Phase
from flightd.sim.judge.flight_score import FlightScore
from tests.command import Command

MS = {"p50": 80.0, "p99": 95.0}


class Judged:
    """A good flight of a minute and a half."""

    verdict, faults = "good", ()
    stock: dict[str, Any] = {}  # noqa: RUF012 - nobody writes to it
    sensors: dict[str, Any] = {}  # noqa: RUF012
    score = FlightScore("completed", "", 1, 1, 0, 0.01, 0.02, 0.03, 0.04, 90.0, 1, 1.0, 0.0, 0.0)


@pytest.fixture
def printed(flightd: Command, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Any:
    """What is printed of such a flight, in single spaces."""
    result = FlightResult(Phase.DONE, "", (), 1, 10, 0, MS, {"p50": 12.0, "p99": 14.0})

    def fly(_: Simulation) -> FlightResult:
        return result

    monkeypatch.setenv("COLUMNS", "200")
    monkeypatch.setattr("flightd.app.simulation.launch.fly", fly)
    monkeypatch.setattr(summaries, "judge_flight", lambda _: Judged)
    monkeypatch.setattr("flightd.replay.report.page.write_report", lambda *_: None)

    def run(*arguments: str) -> str:
        code, out, err = flightd("sim", "--out", tmp_path, *arguments)
        assert code == 0, err
        return re.sub(r"[\s│]+", " ", out)

    return run


def test_the_whole_command_is_told_beside_the_flight_alone(printed: Any) -> None:
    out = printed()
    assert re.search(r"flight time 90 s, flown in 0 s \(\d+\.\d x\)", out)
    assert re.search(r"whole command \d+ s \(\d+\.\d x\) with its start, verdict and report", out)


def test_a_latency_that_was_not_measured_is_told_as_such(printed: Any) -> None:
    out = printed()
    assert "exposure to setpoint 80 ms, p99 95 ms (modelled: in lockstep a detection takes 8 ms;" in out
    assert "without the camera's delay" not in out
    assert "80 ms, p99 95 ms (by a clock 4 times as fast)" in printed("--speed", "4")


def test_in_real_time_the_latency_is_told_without_the_cameras_delay_too(printed: Any) -> None:
    out = printed("--speed", "1")
    assert "exposure to setpoint 80 ms, p99 95 ms without the camera's delay 12 ms, p99 14 ms" in out
