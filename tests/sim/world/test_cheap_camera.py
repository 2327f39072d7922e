"""A cheap camera's pictures: too bright or dark for a while, and with bands of the mains' light."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from flightd.adapters.camera.shared_memory import SharedCamera
from flightd.app.simulation.ports import WorldPorts
from flightd.app.simulation.prepare import SimOptions, prepare
from flightd.app.simulation.simulation import world_spec
from flightd.config.paths import shipped
from flightd.core.types import Image
from flightd.runtime.clock import LoopClock
from flightd.runtime.frame_ring import FrameRing, FrameTicket
from flightd.runtime.free_ports import free_port
from flightd.sim.appearance import CLEAN
from flightd.sim.floor.renderer import Renderer
from flightd.sim.plant.kinematics import Kinematics
from flightd.sim.scenario.scenario import Scenario
from flightd.sim.sensors.auto_exposure import TARGET, metered
from flightd.sim.sensors.camera import CameraPeer
from flightd.sim.sensors.cheap_camera import FAITHFUL, CheapCamera, CheapParams
from flightd.sim.sensors.optics import USUALLY, SimCamera, Taking, wide_lens
from flightd.sim.unknowns import WorldKind, unknowns_of
from flightd.sim.world import WorldSpec
from flightd.site.site_file import load_site
from tests.rigs.event_loops import virtual
from tests.rigs.held_time import held

DEMO = load_site(shipped("site-demo.toml"))
CAMERA = SimCamera(lens=wide_lens(320, 180), readout_s=0.025)
REST = Kinematics(0, *[0.0] * 12)


class Grey:
    """Pictures of one grey, which may change."""

    level = 100.0

    def render(
        self, kinematics: Kinematics, seq: int, out: Image | None = None, how: Taking = USUALLY
    ) -> Image:
        picture = out if out is not None else np.empty((180, 320, 3), np.uint8)
        picture[:] = round(min(self.level * how.exposure * how.gain, 255.0))
        return picture


def cheap(params: CheapParams, camera: SimCamera = CAMERA) -> tuple[CheapCamera, Grey]:
    scene = Grey()
    return CheapCamera(lambda: scene, camera, params, 5), scene


def at(seq: int) -> Kinematics:
    return replace(REST, stamp_ns=round(seq * 1e9 / 30.0))


def row_light(picture: Image) -> NDArray[np.float64]:
    rows: NDArray[np.float64] = picture.astype(float).mean(axis=(1, 2))
    rows /= rows.mean()
    return rows


def test_a_dark_patch_makes_pictures_too_dark_and_what_follows_too_bright_for_a_while() -> None:
    camera, scene = cheap(CheapParams(lag_s=0.5))
    settled = [camera.render(at(seq), seq).copy() for seq in range(5)][-1]
    assert metered(settled) == pytest.approx(TARGET, abs=0.02)
    scene.level = 75.0
    dark = [metered(camera.render(at(seq), seq)) for seq in range(5, 95)]
    assert dark[0] < 0.6 * TARGET
    assert dark[14] < 0.85 * TARGET
    assert dark[-1] == pytest.approx(TARGET, abs=0.02)
    scene.level = 100.0
    assert metered(camera.render(at(95), 95)) > 1.5 * TARGET


def test_a_picture_has_as_many_bands_as_beats_in_its_read_out() -> None:
    camera, _ = cheap(CheapParams(flicker=0.15), replace(CAMERA, exposure_s=0.0005))
    light = row_light(camera.render(at(0), 0)) - 1.0
    wave = np.exp(2j * np.pi * np.outer(np.arange(0.5, 6.0, 0.25), np.arange(180) / 180))
    assert np.arange(0.5, 6.0, 0.25)[np.abs(wave @ light).argmax()] == pytest.approx(2.5, abs=0.25)
    assert np.ptp(light) == pytest.approx(0.3, abs=0.03)


def test_bands_wander_from_picture_to_picture() -> None:
    camera, _ = cheap(CheapParams(flicker=0.15))
    first, second = (row_light(camera.render(at(seq), seq)) for seq in range(2))
    assert np.abs(first - second).max() > 0.1


@pytest.mark.parametrize(("exposure_s", "part"), [(0.010, 1.0), (0.004, 2.5)])
def test_an_exposure_of_a_whole_beat_shows_no_bands(exposure_s: float, part: float) -> None:
    camera, _ = cheap(CheapParams(flicker=0.15), replace(CAMERA, exposure_s=exposure_s))
    assert np.ptp(row_light(camera.render(at(0), 0, None, Taking(part)))) < 0.01


def test_what_is_burnt_out_shows_no_bands() -> None:
    camera, scene = cheap(CheapParams(flicker=0.15))
    scene.level = 400.0
    assert camera.render(at(0), 0).min() >= 254


def test_an_exposure_that_is_asked_for_rests_the_automatic() -> None:
    camera, scene = cheap(CheapParams(lag_s=0.1))
    scene.level = 60.0
    for seq in range(30):
        usual = camera.render(at(seq), seq).copy()
    assert usual.mean() > 80.0
    for seq in range(30, 60):
        assert camera.render(at(seq), seq, None, Taking(0.5, 1.0)).mean() == pytest.approx(30.0)
    assert np.array_equal(camera.render(at(60), 60), usual)


def test_the_daemon_is_obeyed_over_the_wire() -> None:
    levels: list[tuple[float, float]] = []

    async def main() -> None:
        clock, port = LoopClock(), free_port()

        def take(ticket: FrameTicket) -> None:
            ring = FrameRing.attach(ticket.ring, ticket.slots, ticket.width_px, ticket.height_px)
            levels.append((ticket.exposure, float(ring.pixels(ticket.slot).mean())))

        listener = SharedCamera(f"udp://127.0.0.1:{port}", (320, 180), 0.06, clock, take, pytest.fail)

        def truth_at(stamp_ns: int) -> Kinematics:
            return replace(REST, stamp_ns=stamp_ns)

        address = "127.0.0.1", port
        make = partial(CheapCamera, Grey, CAMERA, CheapParams(lag_s=0.1), 5)
        peer = CameraPeer(CAMERA, make, "seed", address, truth_at, clock, hold=held)
        tasks = [asyncio.ensure_future(listener.run()), asyncio.ensure_future(peer.run())]
        await asyncio.sleep(1.0)
        listener.expose(0.5, 1.0)
        await asyncio.sleep(1.0)
        for task in tasks:
            task.cancel()
        await asyncio.wait(tasks)

    virtual(main())
    assert {part for part, _ in levels} == {1.0, 0.5}
    by_hand = {level for part, level in levels if part == 0.5}
    assert by_hand == {50.0}
    assert [level for part, level in levels if part == 1.0][-1] > 130.0


def test_the_same_seed_takes_the_same_pictures_and_another_does_not() -> None:
    def taken(seed: int) -> list[Image]:
        camera = CheapCamera(Grey, CAMERA, CheapParams(0.5, 0.1), seed)
        return [camera.render(at(seq), seq).copy() for seq in range(4)]

    assert all(map(np.array_equal, taken(3), taken(3)))
    assert not np.array_equal(taken(3)[0], taken(4)[0])


def flown(world: str, tmp_path: Path, **floor: str) -> WorldSpec:
    scenario = Scenario.model_validate({"floor": floor})
    simulation = prepare(SimOptions(world=world, seed=3), scenario, tmp_path, lambda _: None)
    return world_spec(simulation, WorldPorts((1,), 2, 3))


def test_the_ideal_worlds_camera_is_a_faithful_one(tmp_path: Path) -> None:
    assert flown("ideal", tmp_path).cheap == FAITHFUL
    for kind in (WorldKind.USUAL, WorldKind.ROUGH):
        drawn = unknowns_of(kind, 3)
        assert flown(kind, tmp_path).cheap == CheapParams(drawn.exposure_lag_s, drawn.flicker) != FAITHFUL


def test_a_floor_whose_look_a_scenario_tells_is_seen_as_it_is(tmp_path: Path) -> None:
    assert flown("rough", tmp_path, appearance="dim").cheap == FAITHFUL


def test_around_a_real_renderer_it_changes_light_and_nothing_else() -> None:
    plain = Renderer(DEMO, CAMERA, CLEAN)
    camera = CheapCamera(partial(Renderer, DEMO, CAMERA, CLEAN), CAMERA, CheapParams(0.1, 0.1), 5)
    pose = replace(at(0), x_m=2.7, height_m=1.2)
    out = np.empty((180, 320, 3), np.uint8)
    assert camera.render(pose, 0, out) is out
    seen = out.astype(float) / np.maximum(plain.render(pose, 0), 1)
    assert np.abs(seen / seen.mean(axis=1, keepdims=True) - 1.0).max() < 0.15
    assert 0.85 < seen.mean() < 1.15
