"""Junctions from rendered pictures, as the localiser gets them: on the map, with the map's arms."""

from __future__ import annotations

import math
import random
from pathlib import Path

from flightd.config.control import TiltCompensation
from flightd.config.schema import load_config
from flightd.core.tracks import FloorJunction
from flightd.core.types import Attitude
from flightd.sim.appearance import DEFAULT
from flightd.sim.floor.renderer import Renderer
from flightd.sim.plant.kinematics import Kinematics
from flightd.sim.sensors.optics import SimCamera
from flightd.site.painted_lines import Features, PaintMap
from flightd.site.site_file import load_site
from flightd.tracking.ground_junctions import floor_junctions
from flightd.tracking.tilt_compensation import FloorView
from flightd.vision.line_detector import Detector

CONFIGS = Path(__file__).parents[3] / "configs"
CONFIG = load_config(CONFIGS / "sim.toml")
DEMO = load_site(CONFIGS / "site-demo.toml")
LENS, MOUNT = CONFIG.camera.lens(), CONFIG.camera.mount()
REACH = 0.35
"""Looked at within this times the height."""


def told(k: Kinematics, features: Features, seen: tuple[FloorJunction, ...]) -> tuple[int, int]:
    """How many features are near the drone, and how many of them were told with the right arms."""
    expected = found = 0
    for (x, y), arms in zip(features.at_m, features.arms, strict=True):
        dx, dy = float(x) - k.x_m, float(y) - k.y_m
        if max(abs(dx), abs(dy)) < REACH * k.height_m:
            expected += 1
            found += any(math.hypot(at.dx_m - dx, at.dy_m - dy) < 0.1 and at.arms == int(arms) for at in seen)
    return expected, found


def test_crossings_and_ends_are_told_where_the_map_has_them_whatever_the_attitude() -> None:
    renderer = Renderer(DEMO, SimCamera(lens=LENS, mount=MOUNT), DEFAULT, 3)
    detector, paint, rng = Detector("combined", "yellow"), PaintMap.of(DEMO), random.Random(1)
    expected = found = 0
    for i in range(16):
        node = rng.choice(list(DEMO.nodes.values()))
        yaw = rng.choice([0.0, math.pi / 2, math.pi]) + rng.gauss(0.0, 0.04)
        roll, pitch, height = rng.gauss(0.0, 0.03), rng.gauss(0.0, 0.03), rng.choice([1.6, 2.2])
        x, y = node.x_m + rng.uniform(-0.5, 0.5), node.y_m + rng.uniform(-0.1, 0.1)
        k = Kinematics(i, x, y, height, 0, 0, 0, roll, pitch, yaw, 0, 0, 0)
        view = FloorView(LENS, MOUNT, Attitude(0, roll, pitch, yaw), height, TiltCompensation.EXACT, 0.005)
        seen = floor_junctions(detector.detect(renderer.render(k, i), i, i).junctions, view, yaw)
        for features in (paint.crossings, paint.ends):
            counted = told(k, features, seen)
            expected, found = expected + counted[0], found + counted[1]
    assert expected > 20
    assert found >= 0.9 * expected
