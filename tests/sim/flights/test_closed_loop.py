"""Camera to setpoint and back: short missions through pictures, processes and sockets."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from flightd.app.build import detector_pool
from flightd.app.detection.detector_pool import DetectorPool
from flightd.app.simulation import launch as simulate
from flightd.app.simulation.simulation import Simulation
from flightd.app.simulation.simulator_config import simulator_config
from flightd.core.snapshot import Snapshot
from flightd.core.types import Phase
from flightd.sim.scenario.scenario import Scenario
from tests.command import Command
from tests.rigs.patience import COMMAND_S
from tests.rigs.recorded_flight import fly_once
from tests.rigs.small_camera import AT_ONCE, with_small_camera

ROOT = Path(__file__).parents[3]
WALL = {"wall_time_s"}


def process(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "flightd", *arguments]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=COMMAND_S, check=False)


def test_the_same_seed_flies_the_same_flight(recorded_flight: Path, tmp_path: Path) -> None:
    first, second = (
        json.loads((folder / "summary.json").read_text()) for folder in (recorded_flight, fly_once(tmp_path))
    )
    assert {k: v for k, v in first.items() if k not in WALL} == {
        k: v for k, v in second.items() if k not in WALL
    }
    assert first["mission"] == "completed"
    assert (first["nodes_visited"], first["nodes_miscounted"]) == (2, 0)
    assert first["cross_track_rms_m"] <= 0.05
    assert first["hover_error_p95_m"] <= 0.10
    assert first["landed_error_m"] <= 0.15
    assert first["frames_dropped"] == 0
    for name in ("flight.mcap", "truth.mcap", "report.html", "inventory.csv"):
        assert (recorded_flight / name).stat().st_size > 0


@pytest.mark.parametrize(
    ("options", "word"),
    [
        (["--config", "no-such.toml"], "no-such.toml"),
        (["--warehouse", "no-such-site.toml"], "no-such-site.toml"),
        (["--warehouse", "random:x"], "random:SEED"),
        (["--speed", "fast"], "--speed"),
        (["--speed", "-1"], "--speed"),
        (["--set", "mission.hight_m=2"], "mission.hight_m"),
        (["--set", "mission.height_m=200"], "mission.height_m"),
        (["--set", "nonsense"], "--set nonsense"),
        (["--set", "vision.profile=mauve"], "mauve"),
        (["--scenario", "no-such-scenario.toml"], "no-such-scenario.toml"),
        (["--out", "/proc/nowhere"], "/proc/nowhere"),
        (["--vehicle", "zeppelin"], "vehicle.kind"),
        (["--vehicle", "mavsdk", "--speed", "max"], "leave --speed out"),
        (["--vehicle", "mavsdk", "--speed", "3"], "--speed 1"),
        (["--camera", "stream:vhs"], "stream:h264"),
        (["--camera", "stream:mjpeg", "--speed", "max"], "leave --speed out"),
    ],
)
def test_wrong_input_is_one_line_that_names_it(
    flightd: Command, options: list[str], word: str, tmp_path: Path
) -> None:
    done = flightd("sim", *(options if "--out" in options else [*options, "--out", str(tmp_path)]))
    assert done.returncode == 2, done.stderr
    lines = done.stderr.strip().splitlines()
    assert len(lines) == 1, done.stderr
    assert word in lines[0]


def test_a_node_that_the_site_lacks_is_one_line(tmp_path: Path) -> None:
    done = process("sim", "--out", str(tmp_path), "--set", 'mission.nodes=["Z9"]')
    assert done.returncode == 2
    (line,) = done.stderr.strip().splitlines()
    assert "Z9" in line


def test_a_taken_camera_port_is_one_line(tmp_path: Path) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        port = taken.getsockname()[1]
        config = tmp_path / "flightd.toml"
        site = ROOT / "configs" / "site-demo.toml"
        config.write_text(
            f'[mission]\nsite = "{site}"\nautostart = true\n[camera]\nurl = "udp://127.0.0.1:{port}"\n'
        )
        done = process("run", "--config", str(config))
    assert done.returncode == 2
    errors = [line for line in done.stderr.splitlines() if line.startswith("flightd:")]
    assert len(errors) == 1
    assert str(port) in errors[0]
    assert "Traceback" not in done.stderr


def short_flight(folder: Path, speed: float, observer: Any) -> Simulation:
    scenario = with_small_camera(Scenario())
    settings = 'mission.nodes=["A1", "A2"]', *AT_ONCE, "vision.workers=2"
    config, site = simulator_config(None, None, scenario, settings)
    return Simulation(config, site, scenario, 2, speed, folder, observer)


@pytest.mark.realtime
def test_detectors_killed_in_flight_are_replaced_and_the_mission_completes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In real time, over UDP, with the world in a process of its own."""
    pools: list[DetectorPool] = []
    make = detector_pool

    def watched(*args: Any) -> DetectorPool:
        pools.append(make(*args))
        return pools[-1]

    def kill_once(status: Snapshot) -> None:
        if status.phase is Phase.FOLLOW and status.goal == "A2" and not pools[0].replaced:
            for pid in pools[0].pids:
                os.kill(pid, signal.SIGKILL)

    monkeypatch.setattr("flightd.app.simulation.launch.detector_pool", watched)
    result = simulate.fly(short_flight(tmp_path, 1.0, kill_once))
    assert pools[0].replaced >= 2
    assert result.phase is Phase.DONE
    assert result.visited == ("A1", "A2")
