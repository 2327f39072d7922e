"""What is drawn of a drone reaches the peers that are it: clock, radio and camera."""

from __future__ import annotations

import asyncio
import inspect
import math
import statistics
from pathlib import Path
from typing import Any

import pytest

from flightd.app.absent_parts import NO_RECORDER
from flightd.app.simulation.ports import WorldPorts
from flightd.app.simulation.prepare import SimOptions, prepare
from flightd.app.simulation.simulation import Simulation, world_spec
from flightd.runtime.clock import LoopClock
from flightd.sim.autopilot.autopilot import AutopilotPeer
from flightd.sim.scenario.scenario import Scenario
from flightd.sim.sensors.camera import CameraPeer
from flightd.sim.sensors.optics import SimCamera
from flightd.sim.world import World
from tests.rigs.event_loops import virtual

SEED = 3
S = 1_000_000_000


@pytest.fixture
def cameras(monkeypatch: pytest.MonkeyPatch) -> list[dict[str, Any]]:
    """What each real camera of the world is made of, by its parameters' names."""
    made: list[dict[str, Any]] = []

    def make(*args: Any, **kwargs: Any) -> CameraPeer:
        made.append(inspect.signature(CameraPeer).bind(*args, **kwargs).arguments)
        return CameraPeer(*args, **kwargs)

    monkeypatch.setattr("flightd.sim.world.CameraPeer", make)
    return made


def rough(tmp_path: Path, vehicle: str, world: str = "rough") -> Simulation:
    options = SimOptions(world=world, seed=SEED, vehicle=vehicle)
    return prepare(options, Scenario(), tmp_path, lambda _: None)


def world_of(simulation: Simulation) -> World:
    return World(world_spec(simulation, WorldPorts((0,), 1, 2)), LoopClock(), NO_RECORDER)


@pytest.mark.parametrize("vehicle", ["ardupilot", "px4"])
def test_the_autopilot_has_the_drawn_clock_and_radio(tmp_path: Path, vehicle: str) -> None:
    async def main() -> None:
        simulation = rough(tmp_path, vehicle)
        drawn, peer = simulation.unknowns, world_of(simulation).vehicle
        assert isinstance(peer, AutopilotPeer)
        line = peer.link.down.params, peer.link.up.params
        assert line == drawn.radio(simulation.scenario.vehicle.radio())
        assert [way.delay_s for way in line] == pytest.approx(drawn.path_s)
        assert all(way.jitter_s == drawn.path_jitter_s for way in line)
        now_ns = LoopClock().now_ns()
        first_ns = peer.boot_clock_ns(now_ns)
        ran_ns = peer.boot_clock_ns(now_ns + 100 * S) - first_ns
        assert ran_ns - 100 * S == pytest.approx(drawn.clock_ppm * 1e-6 * 100 * S, abs=1000)
        peer.airframe.height_m = 1.6
        peer.boot_clock_ns(now_ns + 100 * S)
        leapt_ns = peer.boot_clock_ns(now_ns + 200 * S) - first_ns - 2 * ran_ns
        assert leapt_ns == pytest.approx(drawn.clock_leap.by_s * 1e9, abs=1000)
        assert abs(drawn.clock_leap.by_s) > 0.01

    virtual(main())


def test_the_camera_is_drawn_shaken_and_leaps(tmp_path: Path, cameras: list[dict[str, Any]]) -> None:
    async def main() -> None:
        simulation = rough(tmp_path, "ardupilot")
        drawn, world = simulation.unknowns, world_of(simulation)
        down = cameras[0]
        configured = simulation.scenario.camera.camera()
        assert isinstance(down["camera"], SimCamera)
        assert down["camera"].capture_delay_s == configured.capture_delay_s + drawn.camera_delay_s
        assert down["camera"].jitter_s == configured.jitter_s + drawn.camera_jitter_s
        assert down["leap"] == drawn.camera_leap
        assert abs(drawn.camera_leap.by_s) > 0.01
        assert down["camera"].vibration == drawn.vibration
        assert drawn.vibration.rms_rad > 0.0
        now_ns = LoopClock().now_ns()
        assert down["truth_at"](now_ns) == world.vehicle.truth_at(now_ns), "it vibrates within the frame"

    virtual(main())


def test_the_usual_camera_is_turned_anew_for_each_frame(
    tmp_path: Path, cameras: list[dict[str, Any]]
) -> None:
    async def main() -> None:
        simulation = rough(tmp_path, "ardupilot", "usual")
        world, down = world_of(simulation), cameras[0]
        shaken = list[float]()
        for _ in range(300):
            await asyncio.sleep(0.033)
            now_ns = LoopClock().now_ns()
            seen, true = down["truth_at"](now_ns), world.vehicle.truth_at(now_ns)
            shaken.append(seen.roll_rad - true.roll_rad)
        rms_rad = math.sqrt(statistics.fmean(one * one for one in shaken))
        assert rms_rad == pytest.approx(simulation.unknowns.shake_rad, rel=0.3)

    virtual(main())
