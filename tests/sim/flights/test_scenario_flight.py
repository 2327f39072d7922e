"""`flightd sim --scenario`: faults injected in a flight through the command, found by the daemon."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from flightd.cli.main import app
from flightd.core.topics import Topic
from flightd.core.types import Event
from flightd.replay.log import read_log
from tests.rigs.small_camera import at_once, small_camera_file

FAULTS = """
[[fault]]
kind = "camera_black"
at_s = 3.0

[[fault]]
kind = "battery"
charge = 0.5
at_s = 1.0
"""


def test_two_faults_in_one_flight_are_done_found_and_answered(tmp_path: Path) -> None:
    extra = tmp_path / "extra.toml"
    extra.write_text(FAULTS)
    out = tmp_path / "out"
    small = str(small_camera_file(tmp_path))
    options = ["--scenario", str(extra), "--scenario", small, "--out", str(out), "--json"]
    result = CliRunner().invoke(app, ["sim", *options, "--set", 'mission.nodes=["A2"]', *at_once()])
    assert result.exit_code != 0  # a flight that had to land is no completed mission
    summary = json.loads((out / "summary.json").read_text())
    assert summary["mission"] == "aborted"
    notes: list[Any] = [entry.message for entry in read_log(out / "truth.mcap", {Topic.FAULT}).entries]
    assert [(note["kind"], note["began"]) for note in notes] == [("battery", True), ("camera_black", True)]
    began_ns = notes[1]["stamp_ns"]
    told = [event for event in read_log(out / "flight.mcap").messages(Event) if event.name == "hazard"]
    found = next(event for event in told if event.text.startswith("camera black"))
    assert 0.0 < (found.stamp_ns - began_ns) * 1e-9 < 0.6


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["--scenario", "stop", "--speed", "max"], "need the clock"),
        (["--scenario", "nothing"], "no such scenario"),
        (["--scenario", "height_lost", "--vehicle", "ardrone"], "only the simulated MAVLink"),
    ],
)
def test_what_cannot_be_flown_is_one_clear_line(tmp_path: Path, options: list[str], told: str) -> None:
    result = CliRunner().invoke(app, ["sim", *options, "--out", str(tmp_path)])
    assert result.exception is not None
    assert told in str(result.exception) + result.output
