"""Flights whose vehicle lives in another process and on another clock: in real time, over sockets."""

from __future__ import annotations

import asyncio
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from flightd.adapters.vehicle.mavlink.ardupilot import ArduPilotVehicle
from flightd.adapters.vehicle.mavlink.px4 import Px4Vehicle
from flightd.runtime.clock import LoopClock
from flightd.sim.external.external_simulator import ExternalVehicle
from flightd.sim.external.external_truth import Placement
from tests.rigs.event_loops import real
from tests.rigs.real_time_flight import ROOT, flown, is_sound
from tests.rigs.vehicles import Rig


@contextmanager
def simulator(kind: str, speed: float = 1.0) -> Iterator[list[str]]:
    """Another simulator, so many times as fast as the clock; the options that fly in it."""
    command = [sys.executable, "-m", "tests.rigs.simulator_process", kind, "--speed", str(speed)]
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


@pytest.mark.realtime
@pytest.mark.parametrize("kind", ["ardupilot", "px4"])
def test_a_mission_is_flown_in_another_simulator_wherever_its_vehicle_stands(
    kind: str, tmp_path: Path
) -> None:
    with simulator(kind) as options:
        summary = flown(tmp_path, *options)
    assert is_sound(summary), summary


@pytest.mark.realtime
@pytest.mark.parametrize(("kind", "speed"), [("ardupilot", 2.0), ("px4", 3.0)])
def test_a_simulator_that_runs_at_another_speed_is_flown_in_its_own_time(
    kind: str, speed: float, caplog: pytest.LogCaptureFixture
) -> None:
    """Adapter and truth link on a clock of the same speed; without pictures, which only cost time."""

    async def main(vehicle_url: str, truth_url: str) -> None:
        clock = LoopClock()
        make = Px4Vehicle if kind == "px4" else ArduPilotVehicle
        vehicle, world = make(vehicle_url, clock), ExternalVehicle(truth_url, clock, Placement(0, 0, 0))
        tasks = [asyncio.create_task(part.run()) for part in (world, vehicle)]
        await world.open()
        rig = Rig(vehicle, world, lambda: None, lambda apart: None)
        await rig.take_off(1.5)
        vehicle.attitudes()
        start_m, start_s = world.truth().height_m, asyncio.get_running_loop().time()
        await rig.stream(8.0, climb_mps=0.3)
        passed_s = asyncio.get_running_loop().time() - start_s
        samples = vehicle.attitudes()
        assert world.truth().height_m - start_m == pytest.approx(0.3 * passed_s, rel=0.2)
        assert len(samples) == pytest.approx(50 * passed_s, rel=0.15)
        assert abs(samples[-1].yaw_rad - samples[0].yaw_rad) < 0.1
        assert (samples[-1].stamp_ns - samples[0].stamp_ns) * 1e-9 == pytest.approx(passed_s, rel=0.1)
        for task in tasks:
            task.cancel()
        await asyncio.wait(tasks)

    with simulator(kind, speed) as options:
        addresses = options[3], options[5]
        real(main(*addresses), speed)
    assert not [record for record in caplog.records if "times as fast" in record.message]


@pytest.mark.realtime
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
