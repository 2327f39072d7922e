"""What motors shake of the camera: fast, wavy within a frame, slow where it meets the frame rate."""

from __future__ import annotations

import asyncio
import math
import random
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from flightd.adapters.camera.shared_memory import SharedCamera
from flightd.app.simulation.ports import WorldPorts
from flightd.app.simulation.prepare import SimOptions, prepare
from flightd.app.simulation.simulation import world_spec
from flightd.config.paths import shipped
from flightd.core.geometry import Matrix
from flightd.core.types import Image
from flightd.runtime.clock import LoopClock
from flightd.runtime.frame_ring import FrameRing, FrameTicket
from flightd.runtime.free_ports import free_port
from flightd.sim.appearance import CLEAN
from flightd.sim.dataset.floor_labels import FloorSight
from flightd.sim.floor.paint_damage import UNDAMAGED
from flightd.sim.floor.renderer import Renderer
from flightd.sim.plant.airframe import Airframe
from flightd.sim.plant.kinematics import Kinematics
from flightd.sim.scenario.scenario import Scenario
from flightd.sim.sensors.camera_effects import blur_vibrating
from flightd.sim.sensors.cheap_camera import FAITHFUL
from flightd.sim.sensors.instruments import SensorParams, Sensors
from flightd.sim.sensors.optics import SimCamera
from flightd.sim.sensors.vibration import STILL, Tone, Vibration, drawn_tones
from flightd.sim.unknowns import NOTHING, SPREADS, Unknowns, WorldKind, unknowns_of
from flightd.sim.world import down_camera
from flightd.site.site_file import load_site
from tests.rigs.event_loops import virtual
from tests.rigs.held_time import held

DEMO = load_site(shipped("site-demo.toml"))
RMS_RAD = math.radians(0.5)
ABOVE = Kinematics(1_000_000_000, 5.5, 0.0, 1.4, *[0.0] * 9)
"""At rest above a line that runs up the picture."""
STEADY = replace(CLEAN, motion_blur=False)


def drawn(seed: int) -> Vibration:
    return Vibration(RMS_RAD, *drawn_tones(random.Random(seed)))


@pytest.mark.parametrize("seed", range(5))
def test_the_camera_shakes_by_what_was_asked_for_between_60_and_200_hz(seed: int) -> None:
    rate_hz, seconds = 2000.0, 60.0
    angles = drawn(seed).angles_rad(np.arange(0.0, seconds, 1.0 / rate_hz))
    for axis in angles:
        assert axis.std() == pytest.approx(RMS_RAD, rel=0.03)
        power = np.abs(np.fft.rfft(axis)) ** 2
        hz = np.fft.rfftfreq(len(axis), 1.0 / rate_hz)
        assert power[(hz > 57.0) & (hz < 206.0)].sum() > 0.99 * power.sum()
    assert abs(float(np.mean(angles[0] * angles[1]))) < 0.2 * RMS_RAD**2


def test_a_tone_wanders_by_a_hundredth_of_its_frequency() -> None:
    t_s = np.arange(0.0, 200.0, 0.01)
    tones = [tone for seed in range(5) for axis in drawn_tones(random.Random(seed)) for tone in axis]
    for tone in tones:
        hz = np.diff(tone.at_rad(t_s)) / 0.01 / math.tau
        assert hz.std() == pytest.approx(0.01 * tone.hz, rel=0.2)
        assert hz.mean() == pytest.approx(tone.hz, rel=0.003)


def test_a_tone_near_a_multiple_of_the_frame_rate_swings_the_frames_slowly() -> None:
    frames_s = np.arange(300) / 30.0
    seen = Vibration(RMS_RAD, (Tone(90.1, 1.0, 0.3),)).angles_rad(frames_s)[0]
    assert seen == pytest.approx(RMS_RAD * math.sqrt(2.0) * np.sin(math.tau * 0.1 * frames_s + 0.3), abs=1e-9)
    assert np.abs(np.diff(seen)).max() < 0.03 * RMS_RAD


def test_an_exposure_takes_the_average_of_a_tone() -> None:
    at_s, over_s = np.array([0.3, 0.3071]), 0.004
    for seed in range(5):
        steady = [
            tuple(replace(tone, wanders=()) for tone in axis) for axis in drawn_tones(random.Random(seed))
        ]
        vibration = Vibration(RMS_RAD, *steady)
        parts_s = ((np.arange(200) + 0.5) / 200 - 0.5) * over_s
        slowly = vibration.angles_rad(at_s[:, None] + parts_s).mean(axis=2)
        assert vibration.angles_rad(at_s, over_s) == pytest.approx(slowly, abs=1e-3 * RMS_RAD)
    gone = Vibration(RMS_RAD, (Tone(200.0, 1.0, 0.3),)).angles_rad(at_s, 0.005)
    assert gone == pytest.approx(0.0, abs=1e-12), "a whole period"


def seen_at_px(picture: Image) -> Matrix:
    """(H,) where each row of a picture shows the yellow line that runs up it."""
    paint = np.clip(picture[..., 2].astype(float) - picture[..., 0] - 40.0, 0.0, None)
    at_px: Matrix = (paint * np.arange(paint.shape[1])).sum(axis=1) / paint.sum(axis=1)
    return at_px


@pytest.mark.parametrize("readout_s", [0.0, 0.015, 0.03])
def test_each_row_shows_the_line_from_where_the_camera_was_turned_to_then(readout_s: float) -> None:
    camera = SimCamera(readout_s=readout_s, vibration=drawn(1))
    found_px = seen_at_px(Renderer(DEMO, camera, STEADY).render(ABOVE, 0))[4:-4]
    floor = np.column_stack([np.linspace(4.6, 6.4, 2001), np.zeros(2001)])
    told_px = FloorSight(camera, ABOVE).pixels(floor)
    order = np.argsort(told_px[:, 1])
    told_at_px = np.interp(np.arange(4, 356), told_px[order, 1], told_px[order, 0])
    assert np.abs(found_px - told_at_px).max() < 0.35  # cells of 8 px stand for the rows between them
    wavy_px = found_px - np.polyval(np.polyfit(np.arange(352), found_px, 1), np.arange(352))
    assert (wavy_px.std() > 1.0) == (readout_s > 0.0)


def test_a_frame_at_once_is_that_of_a_drone_that_leans_so() -> None:
    camera = SimCamera(vibration=drawn(2))
    at_s = np.array(ABOVE.stamp_ns * 1e-9)
    roll_rad, pitch_rad = camera.vibration.angles_rad(at_s, camera.exposure_s).tolist()
    leaning = replace(ABOVE, roll_rad=roll_rad, pitch_rad=pitch_rad)
    turned = Renderer(DEMO, camera, STEADY).render(ABOVE, 0).astype(int)
    leant = Renderer(DEMO, SimCamera(), STEADY).render(leaning, 0).astype(int)
    still = Renderer(DEMO, SimCamera(), STEADY).render(ABOVE, 0).astype(int)
    assert np.abs(turned - leant).mean() < 0.1 * np.abs(turned - still).mean()


@pytest.mark.parametrize("readout_s", [0.0, 0.03])
def test_it_blurs_edges_and_leaves_them_in_place(readout_s: float) -> None:
    camera = SimCamera(vibration=drawn(3), readout_s=readout_s)
    sharp, blurred = (
        Renderer(DEMO, camera, look).render(ABOVE, 0) for look in (STEADY, replace(STEADY, motion_blur=True))
    )
    steepest = [int(np.abs(np.diff(one.astype(int), axis=1)).max()) for one in (sharp, blurred)]
    assert steepest[1] < 0.7 * steepest[0]
    aswept_px = (moments_px(blurred)[0] - moments_px(sharp)[0])[20:-20]
    assert np.abs(aswept_px).mean() < 0.1
    assert np.abs(aswept_px).max() < 0.35


def moments_px(picture: Image) -> tuple[Matrix, Matrix]:
    """(H,) the mean and the variance of where each row has the yellow line's paint, which no blur changes
    the amount of."""
    paint = picture[:, 250:391, 2].astype(float) - picture[:, 250:391, 0]
    paint -= np.median(np.hstack([paint[:, :20], paint[:, -20:]]), axis=1)[:, None]
    at_px, all_of_it = np.arange(250, 391), paint.sum(axis=1)
    mean = (paint * at_px).sum(axis=1) / all_of_it
    variance = (paint * (at_px - mean[:, None]) ** 2).sum(axis=1) / all_of_it
    return mean, variance


def test_what_is_swept_lies_on_the_side_where_the_camera_saw_it() -> None:
    """A point seen 1 px to the right for five sixths of the exposure, 5 px to the left for the rest."""
    picture = np.zeros((9, 41), np.uint8)
    picture[:, 20] = 240
    swept_px = np.zeros((1, 24, 2))
    swept_px[0, :20, 0], swept_px[0, 20:, 0] = 1.0, -5.0
    blur_vibrating(picture, (0.0, 0.0), swept_px, 0.0)
    assert (picture[4, 21], picture[4, 15]) == (200, 40)


def test_a_row_is_blurred_by_what_its_own_exposure_sweeps() -> None:
    """A slow tone, at its turning point in the first row and the fastest in the last."""
    readout_s, exposure_s = 1.0 / 240.0, 0.003
    top_s = ABOVE.stamp_ns * 1e-9 - readout_s / 2
    turning = Tone(60.0, 1.0, math.pi / 2 - math.tau * 60.0 * top_s)
    camera = SimCamera(vibration=Vibration(RMS_RAD, (turning,)), readout_s=readout_s, exposure_s=exposure_s)
    sharp, blurred = (
        Renderer(DEMO, camera, look).render(ABOVE, 0) for look in (STEADY, replace(STEADY, motion_blur=True))
    )
    wider = moments_px(blurred)[1] - moments_px(sharp)[1]
    first, last = np.median(wider[4:30]), np.median(wider[-30:-4])
    swept_px = RMS_RAD * math.sqrt(2.0) * SimCamera().lens.fx_px * math.tau * 60.0 * exposure_s
    assert last - first == pytest.approx(swept_px**2 / 12, rel=0.3)


def test_gyros_tell_what_their_filter_leaves_of_the_airframes_part() -> None:
    vibration = Vibration(RMS_RAD, (Tone(100.0, 1.0, 0.0),), (Tone(80.0, 1.0, 0.0),))
    sensors = Sensors(SensorParams(gyro_noise_radps=0.0, yaw_drift_radps=0.0, vibration=vibration))
    told = []
    for _ in range(2000):
        sensors.update(0.0023, Airframe())
        told.append(sensors.body_rates_radps(Airframe().kinematics(0)))
    roll, pitch, yaw = np.std(told, axis=0)
    for rate, hz in ((roll, 100.0), (pitch, 80.0)):
        passed = 1.0 / math.hypot(1.0, (hz / 40.0) ** 2)
        assert rate == pytest.approx(0.1 * RMS_RAD * math.tau * hz * passed, rel=0.05)
    assert yaw == 0.0


def test_the_rough_world_shakes_each_flight_by_tones_of_its_own() -> None:
    assert NOTHING.vibration == STILL == SensorParams().vibration == SimCamera().vibration
    flights = [unknowns_of(WorldKind.ROUGH, seed) for seed in range(20)]
    assert len({one.shake_tones for one in flights}) == 20
    for one in flights:
        assert math.degrees(one.vibration.rms_rad) == pytest.approx(SPREADS[WorldKind.ROUGH].shake_deg)
        axes = one.vibration.roll, one.vibration.pitch
        assert {len(tones) for tones in axes} <= {2, 3}
        assert all(60.0 <= tone.hz <= 200.0 for tones in axes for tone in tones)
        assert one.sensors(SensorParams()).vibration == one.vibration
        assert one.shaken(0)(ABOVE) == ABOVE


def test_the_usual_world_turns_the_camera_anew_for_each_frame() -> None:
    usual = unknowns_of(WorldKind.USUAL, 3)
    assert usual.vibration == STILL == usual.sensors(SensorParams()).vibration
    shaken = usual.shaken(3)
    rolls_rad = [shaken(ABOVE).roll_rad for _ in range(500)]
    assert math.degrees(float(np.std(rolls_rad))) == pytest.approx(0.15, rel=0.1)
    assert abs(float(np.corrcoef(rolls_rad[1:], rolls_rad[:-1])[0, 1])) < 0.15


def frames_of(unknowns: Unknowns, tmp_path: Path) -> list[Image]:
    """Those of a second that the world's camera sends from above a line."""
    simulation = prepare(SimOptions(world="ideal", seed=3), Scenario(), tmp_path, lambda _: None)
    taken: list[Image] = []

    async def main() -> None:
        clock, port = LoopClock(), free_port()
        spec = replace(
            world_spec(simulation, WorldPorts((1,), port, 3)),
            unknowns=unknowns,
            appearance=STEADY,
            cheap=FAITHFUL,
        )

        def take(ticket: FrameTicket) -> None:
            ring = FrameRing.attach(ticket.ring, ticket.slots, ticket.width_px, ticket.height_px)
            taken.append(ring.pixels(ticket.slot).copy())

        size = spec.camera.lens.width_px, spec.camera.lens.height_px
        listener = SharedCamera(f"udp://127.0.0.1:{port}", size, 0.06, clock, take, pytest.fail)

        def hovers(stamp_ns: int) -> Kinematics:
            return replace(ABOVE, stamp_ns=stamp_ns, yaw_rad=-spec.camera.mount.yaw_rad)

        peer = down_camera(spec, UNDAMAGED, hovers, clock, None, held, lambda _: None)
        tasks = [asyncio.ensure_future(listener.run()), asyncio.ensure_future(peer.run())]
        await asyncio.sleep(1.0)
        for task in tasks:
            task.cancel()
        await asyncio.wait(tasks)

    virtual(main())
    return taken


def test_the_frames_that_a_worlds_camera_sends_are_shaken(tmp_path: Path) -> None:
    still = np.array([seen_at_px(frame)[4:-4] for frame in frames_of(NOTHING, tmp_path / "still")])
    vibration = drawn(4)
    shaking = Unknowns(shake_rad=RMS_RAD, shake_tones=(vibration.roll, vibration.pitch), readout_s=0.015)
    shaken_px = np.array([seen_at_px(frame)[4:-4] for frame in frames_of(shaking, tmp_path / "shaken")])
    assert len(shaken_px) > 20
    assert np.ptp(still, axis=0).max() < 0.05
    aswept_px = shaken_px - still[0]
    # the camera sits a quarter turn aside: its picture goes right and left by pitch
    meant_rad = vibration.angles_rad(np.arange(0.0, 10.0, 1e-4), SimCamera().exposure_s)[1].std()
    assert aswept_px.std() == pytest.approx(meant_rad * SimCamera().lens.fx_px, rel=0.3)
    assert np.median(aswept_px.std(axis=1)) > 0.3 * aswept_px.std()  # within one frame
    assert aswept_px[:, 176].std() > 0.5 * aswept_px.std()  # and from frame to frame
