"""Flights whose vehicle lives in another process and on another clock: in real time, over sockets."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
SHORT = 'mission.nodes=["A1", "A2"]'


def flown(folder: Path, *options: str) -> dict[str, Any]:
    command = [
        sys.executable,
        "-m",
        "flightd",
        "sim",
        "--json",
        "--set",
        SHORT,
        "--out",
        str(folder),
        *options,
    ]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=280, check=False)
    assert done.returncode == 0, done.stderr
    summary: dict[str, Any] = json.loads(done.stdout)
    return summary


def is_sound(summary: dict[str, Any]) -> bool:
    """Looser than in lockstep: here the machine's load is part of the flight."""
    return bool(
        summary["mission"] == "completed"
        and (summary["nodes_visited"], summary["nodes_miscounted"]) == (2, 0)
        and summary["cross_track_rms_m"] <= 0.10
        and summary["hover_error_p95_m"] <= 0.20
        and summary["landed_error_m"] <= 0.20
    )


@contextmanager
def simulator(kind: str) -> Iterator[list[str]]:
    """Another simulator; the options that fly in it."""
    command = [sys.executable, "-m", "tests.sim.sitl_stand_in", kind]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, cwd=ROOT, stdin=pipe, stdout=pipe, text=True) as process:
        assert process.stdout is not None
        vehicle, truth = process.stdout.readline().split()
        try:
            yield [
                *("--vehicle", kind),
                *("--vehicle-url", f"tcp:127.0.0.1:{vehicle}"),
                *("--truth-url", f"tcp:127.0.0.1:{truth}"),
            ]
        finally:
            process.kill()


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["ardupilot", "px4"])
def test_a_mission_is_flown_in_another_simulator_wherever_its_vehicle_stands(
    kind: str, tmp_path: Path
) -> None:
    with simulator(kind) as options:
        summary = flown(tmp_path, *options)
    assert is_sound(summary), summary


@pytest.mark.slow
def test_a_mission_is_flown_through_mavsdk_in_real_time_without_being_told_to(tmp_path: Path) -> None:
    summary = flown(tmp_path, "--vehicle", "mavsdk")
    assert is_sound(summary), summary
    assert summary["vehicle"] == "mavsdk"
    assert summary["wall_time_s"] >= summary["flight_time_s"]


def test_a_simulator_that_does_not_answer_is_one_line(tmp_path: Path) -> None:
    nowhere = ["--truth-url", "tcp:127.0.0.1:9", "--vehicle-url", "tcp:127.0.0.1:9", "--speed", "20"]
    command = [sys.executable, "-m", "flightd", "sim", "--json", "--out", str(tmp_path), *nowhere]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 2, done.stderr
    lines = [line for line in done.stderr.splitlines() if line.startswith("flightd:")]
    assert len(lines) == 1
    assert "start it" in lines[0]
    assert "Traceback" not in done.stderr
    assert done.stdout == ""
