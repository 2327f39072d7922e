"""Frames that come late and out of order, flown whole: none is flown by, and every other keeps its time."""

from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path

from typer.testing import CliRunner

from flightd.cli.main import app
from flightd.core.types import Event, LineSet
from flightd.replay.log import read_log
from tests.rigs.small_camera import at_once, small_camera_file

FPS = 30.0
JITTER_S = 0.003
"""Of the simulated camera's delivery."""


def test_frames_behind_newer_ones_are_refused_and_move_no_other(tmp_path: Path) -> None:
    small, out = small_camera_file(tmp_path, fps=FPS), tmp_path / "out"
    options = ["--scenario", "frames_disordered", "--scenario", str(small), "--out", str(out), "--json"]
    result = CliRunner().invoke(app, ["sim", *options, "--set", 'mission.nodes=["A2"]', *at_once()])
    summary = json.loads((out / "summary.json").read_text())
    assert result.exit_code == 0, result.output
    assert summary["mission"] == "completed"
    log = read_log(out / "flight.mcap")
    assert any("out of order" in event.text for event in log.messages(Event) if event.name == "failure")
    stamps = [lines.stamp_ns * 1e-9 for lines in log.messages(LineSet)]
    gaps = [after - before for before, after in pairwise(stamps)]
    assert min(gaps) > 0.0
    off = [abs(gap * FPS - round(gap * FPS)) / FPS for gap in gaps]
    assert max(off) < JITTER_S, "each is exposed a whole number of frames after the one before"
