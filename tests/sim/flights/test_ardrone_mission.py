"""A short mission with the AR.Drone: its own loops, its own H.264 stream, four sockets, virtual time."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.rigs.patience import COMMAND_S
from tests.rigs.small_camera import at_once

ROOT = Path(__file__).parents[3]


def flown(folder: Path) -> dict[str, Any]:
    options = ["--json", "--out", str(folder), "--seed", "5", "--set", 'mission.nodes=["A2"]', *at_once()]
    done = subprocess.run(
        [sys.executable, "-m", "flightd", "sim", "--vehicle", "ardrone", *options],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=COMMAND_S,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    summary: dict[str, Any] = json.loads(done.stdout)
    return summary


@pytest.mark.slow
def test_the_ardrone_flies_the_mission(tmp_path: Path) -> None:
    first = flown(tmp_path)
    assert (first["mission"], first["nodes_visited"], first["nodes_miscounted"]) == ("completed", 1, 0)
    assert first["vehicle"] == "ardrone"
    assert first["cross_track_rms_m"] <= 0.10
    assert first["landed_error_m"] <= 0.20
    assert first["frames_dropped"] == 0
