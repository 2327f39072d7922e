"""Pads in rendered pictures: found where they are, to a centimetre, and nowhere else."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from flightd.config.control import TiltCompensation
from flightd.core.geometry import Mount
from flightd.core.types import Attitude, Image, PadSight
from flightd.sim.appearance import CLEAN, DEFAULT, HARSH, Appearance
from flightd.sim.floor.renderer import Renderer
from flightd.sim.scenario.scenario import FloorScenario
from flightd.sim.sensors.optics import SimCamera
from flightd.site.site_file import load_site
from flightd.tracking.tilt_compensation import FloorView, ground_point
from flightd.vision.line_detector import Detector
from tests.sim.world.test_renderer import hover

DEMO = load_site(Path(__file__).parents[3] / "configs" / "site-demo.toml")
CAMERA = replace(SimCamera(), mount=Mount(math.pi / 2))
LENS = CAMERA.lens
SIZE_M = DEMO.home.size_m


def seen(picture: Image) -> tuple[PadSight, ...]:
    return Detector("combined", "yellow", LENS, in_flight=True).detect(picture).pads


@pytest.mark.parametrize("look", [DEFAULT, CLEAN])
@pytest.mark.parametrize(
    ("height_m", "roll_deg", "pitch_deg", "yaw_deg"), [(0.8, 0, 0, 0), (1.2, 4, -3, 20), (1.7, -5, 5, -65)]
)
def test_a_pushed_pad_is_placed_on_the_floor_to_two_centimetres(
    look: Appearance, height_m: float, roll_deg: float, pitch_deg: float, yaw_deg: float
) -> None:
    site = FloorScenario(pad_off_m=(0.15, -0.2)).site(DEMO)
    roll, pitch, yaw = math.radians(roll_deg), math.radians(pitch_deg), math.radians(yaw_deg)
    pose = hover(0.13, -0.14, height_m, roll_rad=roll, pitch_rad=pitch, yaw_rad=yaw)
    (pad,) = seen(Renderer(site, CAMERA, look, 3).render(pose, 1))
    view = FloorView(LENS, CAMERA.mount, Attitude(0, roll, pitch, yaw), height_m, TiltCompensation.EXACT, 0.0)
    point = ground_point(pad.x_px, pad.y_px, view)
    assert point is not None
    forward, right, scale = point
    x_m = pose.x_m + math.cos(yaw) * forward - math.sin(yaw) * right
    y_m = pose.y_m + math.sin(yaw) * forward + math.cos(yaw) * right
    assert math.hypot(x_m - 0.15, y_m + 0.2) < 0.02
    assert pad.side_px * scale == pytest.approx(SIZE_M, rel=0.1)


def test_no_pad_is_seen_where_none_is_or_only_a_part() -> None:
    renderer = Renderer(DEMO, CAMERA, HARSH, 5)
    nodes = [node for node in DEMO.nodes.values() if node.id != "A1"]
    for k, node in enumerate(nodes):
        pose = hover(node.x_m, node.y_m, 0.9 + 0.07 * k, yaw_rad=0.3 * k)
        sides = [pad.side_px / LENS.fx_px * pose.height_m for pad in seen(renderer.render(pose, k))]
        assert not [side for side in sides if abs(side - SIZE_M) < 0.3 * SIZE_M], node.id
    assert seen(renderer.render(hover(0.3, 0.45, 1.0), 99)) == ()


def test_looking_for_pads_costs_little_beside_the_lines() -> None:
    clock = Detector("combined", "yellow", LENS, in_flight=True, now_ns=time.process_time_ns)
    picture = Renderer(DEMO, CAMERA, DEFAULT, 3).render(hover(0.1, 0.1, 1.4), 1)
    timings = [clock.detect(picture).timings_ms for _ in range(15)]
    pads = float(np.median([t["pads"] for t in timings]))
    whole = float(np.median([sum(t.values()) for t in timings]))
    assert pads < 0.4 * whole
