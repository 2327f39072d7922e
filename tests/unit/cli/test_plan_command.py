"""`flightd plan`: what a flight would be, of what is chosen on the command line."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from flightd.cli.main import app
from flightd.core.errors import InputError

CONFIGS = Path(__file__).parents[3] / "configs"
RUNNER = CliRunner()


@pytest.fixture
def config(tmp_path: Path) -> Path:
    """A flight over two aisles with racks of two levels, their nodes in no good order."""
    path = tmp_path / "flight.toml"
    path.write_text(
        f'[mission]\nsite = "{CONFIGS / "site-racks-small.toml"}"\nnodes = ["A1", "B1", "A3", "B3", "A2"]\n'
        '[front_camera]\nurl = "device:/dev/video2"\nwidth_px = 1920\nheight_px = 1080\n'
        "fx_px = 1500.0\nfy_px = 1500.0\n"
    )
    return path


def planned(config: Path, *options: str) -> dict[str, Any]:
    result = RUNNER.invoke(app, ["plan", "--config", str(config), *options, "--json"])
    assert result.exit_code == 0, result.output + repr(result.exception)
    document: dict[str, Any] = json.loads(result.stdout)
    return document


def test_levels_and_the_best_order_are_asked_for_of_the_configured_nodes_too(config: Path) -> None:
    configured, one = planned(config), planned(config, "--level", "1")
    assert one["levels"] == [1]
    assert one["nodes"] == configured["nodes"]
    assert one["places"] == configured["places"] / 2
    best = planned(config, "--best")
    assert sorted(best["nodes"]) == sorted(configured["nodes"])
    assert best["way_m"] < configured["way_m"]
    result = RUNNER.invoke(app, ["plan", "--config", str(config), "--level", "7"])
    assert isinstance(result.exception, InputError)
    assert str(result.exception) == "nothing is counted on level 7 at any of these nodes"
