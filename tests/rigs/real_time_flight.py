"""A short flight of `flightd sim` in real time, by the small camera: more can be drawn on a busy machine."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

from tests.rigs.patience import COMMAND_S
from tests.rigs.small_camera import at_once, small_camera_file

ROOT = Path(__file__).parents[2]
SHORT = ("--set", 'mission.nodes=["A2"]', *at_once())


def flown(folder: Path, *options: str, **camera: float) -> dict[str, Any]:
    """The summary; what the flight leaves is in the folder.  `camera` are keys of the small camera."""
    command = [
        sys.executable,
        "-m",
        "flightd",
        "sim",
        "--json",
        *SHORT,
        "--scenario",
        str(small_camera_file(folder, **camera)),
        "--out",
        str(folder),
        *options,
    ]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=COMMAND_S, check=False)
    assert done.returncode == 0, done.stderr
    summary: dict[str, Any] = json.loads(done.stdout)
    return summary


def is_sound(summary: dict[str, Any]) -> bool:
    """Looser than in lockstep: here the machine's load is part of the flight."""
    return bool(
        summary["mission"] == "completed"
        and (summary["nodes_visited"], summary["nodes_miscounted"]) == (1, 0)
        and summary["cross_track_rms_m"] <= 0.10
        and summary["hover_error_p95_m"] <= 0.20
        and summary["landed_error_m"] <= 0.20
    )
