"""One simulated flight for all tests of a run that only read what a flight leaves: the first to ask flies."""

from __future__ import annotations

import fcntl
import json
import subprocess
import sys
from pathlib import Path
from typing import Final

from tests.rigs.small_camera import at_once, small_camera_file

NODES: Final = ("A2", "A3")
SEED: Final = 203
_LONGEST_S: Final = 280


def fly_once(shared: Path) -> Path:
    """The folder of the flight's files, below `shared`, which all processes of the run have in common."""
    flown = shared / "recorded-flight"
    with (shared / "recorded-flight.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not flown.exists():
            unfinished = shared / "recorded-flight.unfinished"
            # sensors are fitted to a log by its lines as they are, which a rolling shutter bends
            _fly(unfinished, small_camera_file(shared, readout_s=0.0))
            unfinished.rename(flown)
    return flown


def _fly(out: Path, scenario: Path) -> None:
    route = f"mission.nodes={','.join(NODES)}"
    options = ["--seed", str(SEED), "--set", route, "--scenario", str(scenario), "--out", str(out), "--json"]
    command = [sys.executable, "-m", "flightd", "sim", *options, *at_once()]
    done = subprocess.run(command, capture_output=True, text=True, timeout=_LONGEST_S, check=False)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout) == json.loads((out / "summary.json").read_text())
