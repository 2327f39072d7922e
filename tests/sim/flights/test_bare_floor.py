"""A node without any paint around it is flown to, and from, by what the floor shows besides."""

from __future__ import annotations

import json
from pathlib import Path

from typer.testing import CliRunner

from flightd.cli.main import app
from tests.rigs.small_camera import at_once, small_camera_file

BARE = """
[[fault]]
kind = "bare_floor"
at_node = "A4"
half_m = 1.6
"""


def test_three_metres_without_paint_are_flown_over(tmp_path: Path) -> None:
    extra, out = tmp_path / "bare.toml", tmp_path / "out"
    extra.write_text(BARE)
    small = str(small_camera_file(tmp_path))
    options = ["--scenario", str(extra), "--scenario", small, "--out", str(out), "--json", "--seed", "5103"]
    result = CliRunner().invoke(app, ["sim", *options, "--set", 'mission.nodes=["A2","A4"]', *at_once()])
    summary = json.loads((out / "summary.json").read_text())
    assert summary["mission"] == "completed", summary
    assert result.exit_code == 0, result.output
