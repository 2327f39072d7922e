"""The simulated front camera as a peer: its pictures reach a daemon's camera, with the right calibration."""

import asyncio
import os
import re
import time
from collections.abc import Callable, Coroutine
from dataclasses import replace
from functools import partial
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from flightd.adapters.camera.shared_memory import SharedCamera
from flightd.app.simulation.simulation import Simulation, truth_of
from flightd.app.simulation.simulator_config import simulator_config
from flightd.config.schema import Config
from flightd.core.errors import RunError
from flightd.core.types import Image
from flightd.runtime.clock import LoopClock
from flightd.runtime.frame_ring import FrameRing, FrameTicket
from flightd.runtime.free_ports import free_port
from flightd.runtime.within import Within
from flightd.sim.plant.kinematics import Kinematics
from flightd.sim.racks.appearance import RackAppearance
from flightd.sim.racks.front_camera import FrontCamera, front_lens
from flightd.sim.racks.renderer import FrontRenderer
from flightd.sim.scenario.scenario import FrontCameraScenario, Scenario
from flightd.sim.sensors.camera import CameraPeer, PictureMaker
from flightd.sim.sensors.optics import USUALLY, Taking
from flightd.site.site_file import load_site
from tests.rigs.event_loops import real, virtual
from tests.rigs.held_time import held

CONFIGS = Path(__file__).parents[3] / "configs"
SMALL = CONFIGS / "site-racks-small.toml"


def hovering(stamp_ns: int) -> Kinematics:
    return Kinematics(stamp_ns, 1.3, 0.0, 1.6, 0.0, 0.0, 0.0, 0.0, 0.0, -1.5708, 0.0, 0.0, 0.0)


CAMERA = FrontCamera(lens=front_lens(320, 200, 250.0), fps=5.0, capture_delay_s=0.08, jitter_s=0.0)
MAKE = partial(FrontRenderer, load_site(SMALL), CAMERA, RackAppearance(), 1)


def taken(
    for_s: float,
    expose: tuple[float, ...] = (),
    make: Callable[[], PictureMaker] = MAKE,
    camera: FrontCamera = CAMERA,
    run: Callable[[Coroutine[Any, Any, None]], None] = virtual,
    pictures: int = 0,
) -> list[tuple[FrameTicket, int, Image]]:
    """What a daemon's camera hears of the simulated one: each picture's ticket, arrival and pixels.  Each of
    the exposures is asked for in turn, for an equal part of the time; after that it ends with so many
    `pictures`, however long the renderer's process takes to start."""
    found: list[tuple[FrameTicket, int, Image]] = []

    async def main() -> None:
        clock, port, enough = LoopClock(), free_port(), asyncio.Event()
        if not pictures:
            enough.set()

        def take(ticket: FrameTicket) -> None:
            ring = FrameRing.attach(ticket.ring, ticket.slots, ticket.width_px, ticket.height_px)
            found.append((ticket, clock.now_ns(), ring.pixels(ticket.slot).copy()))
            if len(found) >= pictures:
                enough.set()

        address = f"udp://127.0.0.1:{port}"
        listener = SharedCamera(address, (320, 200), 0.08, clock, take, pytest.fail)
        peer = CameraPeer(camera, make, "front camera 1", ("127.0.0.1", port), hovering, clock, hold=held)
        listening = asyncio.ensure_future(listener.run())
        await asyncio.sleep(0)
        running = asyncio.ensure_future(peer.run())
        for part in expose or (1.0,):
            listener.expose(part, 1.0)
            await asyncio.sleep(for_s / max(len(expose), 1))
        async with Within(120.0):
            await enough.wait()
        for task in (running, listening):
            task.cancel()
        await asyncio.wait([running, listening])
        assert run is not virtual or peer.late == 0

    run(main())
    return found


def test_pictures_arrive_at_their_rate_after_their_delay_as_they_were_rendered() -> None:
    pictures = taken(1.5)
    assert 5 <= len(pictures) <= 8
    for ticket, arrival_ns, _ in pictures:
        assert arrival_ns - ticket.stamp_ns == pytest.approx(80e6, abs=5e6)
    ticket, _, picture = pictures[-1]
    # the exposure's time only enters by the lamps' flicker
    expected = MAKE().render(hovering(0), ticket.seq)
    assert np.abs(picture.astype(int) - expected).mean() < 3.0


def test_the_camera_takes_the_exposure_it_is_asked_for_and_says_so_with_each_picture() -> None:
    pictures = taken(6.0, (1.0, 0.4, 1.0))
    told = [ticket.exposure for ticket, *_ in pictures]
    assert [part for part, _ in groupby(told)] == [1.0, 0.4, 1.0]
    assert told.count(0.4) >= 6
    usual = np.mean([picture.mean() for ticket, _, picture in pictures if ticket.exposure == 1.0])
    dark = np.mean([picture.mean() for ticket, _, picture in pictures if ticket.exposure == 0.4])
    assert dark / usual == pytest.approx(0.4, abs=0.08)


class Broken:
    """Draws two pictures."""

    def render(
        self, kinematics: Kinematics, seq: int, out: Image | None = None, how: Taking = USUALLY
    ) -> Image:
        if seq == 2:
            raise ValueError("a picture\nof nothing")
        assert out is not None
        return out


class Dying:
    """Its process dies before there is any picture."""

    def __init__(self) -> None:
        os._exit(3)

    def render(
        self, kinematics: Kinematics, seq: int, out: Image | None = None, how: Taking = USUALLY
    ) -> Image:
        raise AssertionError


@pytest.mark.parametrize(
    ("make", "problem"),
    [
        (Broken, r"picture 2: ValueError: a picture of nothing \(test_front_camera\.py:\d+\)"),
        (Dying, "picture 0: the process died"),
    ],
)
def test_a_renderer_that_fails_ends_its_camera(make: Callable[[], PictureMaker], problem: str) -> None:
    async def main() -> None:
        address = "127.0.0.1", free_port()
        peer = CameraPeer(CAMERA, make, "seed", address, hovering, LoopClock(), hold=held)
        async with Within(60.0):
            await peer.run()

    with pytest.raises(ExceptionGroup) as ended:
        virtual(main())
    (cause,) = ended.value.exceptions
    assert isinstance(cause, RunError)
    assert re.fullmatch(f"the simulated camera cannot draw {problem}", str(cause))


class Slow:
    """Takes half as long again over a picture as the camera has for one."""

    def render(
        self, kinematics: Kinematics, seq: int, out: Image | None = None, how: Taking = USUALLY
    ) -> Image:
        until_s = time.monotonic() + 1.5 / CAMERA.fps
        while time.monotonic() < until_s:
            pass
        assert out is not None
        return out


@pytest.mark.realtime(cores=0.5)
def test_a_renderer_that_cannot_keep_up_costs_pictures_and_does_not_let_them_queue() -> None:
    numbers = [ticket.seq for ticket, *_ in taken(0.0, make=Slow, run=real, pictures=11)]
    assert numbers[-1] - numbers[0] >= 1.2 * (len(numbers) - 1) > 0


@pytest.mark.realtime(cores=0.5)
def test_a_camera_without_any_delay_takes_pictures() -> None:
    at_once = replace(CAMERA, capture_delay_s=0.0)
    make = partial(FrontRenderer, load_site(SMALL), at_once, RackAppearance(), 1)
    assert len(taken(0.0, make=make, camera=at_once, run=real, pictures=2)) >= 2


def configured(site: Path, *settings: str, scenario: Scenario = Scenario()) -> Config:  # noqa: B008
    return simulator_config(None, str(site), scenario, settings)[0]


def test_the_daemon_is_given_the_simulated_cameras_calibration() -> None:
    scenario = Scenario(front_camera=FrontCameraScenario(width_px=1600, focal_px=1200.0, exposure_s=0.004))
    front = configured(SMALL, scenario=scenario).front_camera
    camera = scenario.front_camera.camera()
    assert front.lens() == camera.lens
    assert (front.fps, front.exposure_s, front.latency_s) == (4.0, 0.004, camera.capture_delay_s)


def test_there_is_a_front_camera_where_there_are_racks_or_one_is_asked_for() -> None:
    bare = CONFIGS / "site-large.toml"
    assert configured(SMALL).front_camera.is_fitted
    assert not configured(bare).front_camera.is_fitted
    assert configured(bare, "front_camera.url=udp://127.0.0.1:5601").front_camera.is_fitted
    assert not configured(SMALL, "vehicle.kind=ardrone").front_camera.is_fitted


def test_the_truth_of_a_simulation_is_that_of_its_scenario_and_seed(tmp_path: Path) -> None:
    config, site = configured(SMALL), load_site(SMALL)
    here, there = (truth_of(Simulation(config, site, Scenario(), seed, None, tmp_path)) for seed in (1, 2))
    assert here.keys() == site.locations.keys()
    assert here != there
    bare = load_site(CONFIGS / "site-large.toml")
    assert truth_of(Simulation(config, bare, Scenario(), 1, None, tmp_path)) == {}
