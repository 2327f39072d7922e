"""Floor markers: found in rendered pictures where they lie, and what they tell a drone that was carried."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from flightd.config.control import TiltCompensation
from flightd.config.schema import load_config
from flightd.core.geometry import Mount
from flightd.core.markers import MarkerDictionary, MarkerSet
from flightd.core.types import Attitude, LineSet, Phase
from flightd.sim.appearance import DEFAULT, HARSH, Appearance
from flightd.sim.floor.renderer import Renderer
from flightd.sim.sensors.optics import SimCamera
from flightd.site.layout import lay_out
from flightd.site.site import Aisle, Marker, Pad
from flightd.site.site_file import load_site
from flightd.tracking.tilt_compensation import FloorView, ground_point
from flightd.vision.line_detector import Detector
from tests.rigs.brisk import BRISK
from tests.sim.ideal.ideal_flight import IdealFlight
from tests.sim.ideal.test_carried import wrong_visits
from tests.sim.world.test_renderer import hover

CONFIGS = Path(__file__).parents[3] / "configs"
CONFIG = load_config(CONFIGS / "sim.toml").with_values(mission=BRISK)
DEMO = load_site(CONFIGS / "site-demo.toml")
CAMERA = replace(SimCamera(), mount=Mount(math.pi / 2))
LENS = CAMERA.lens
TAG = Marker(7, MarkerDictionary.ARUCO_4X4_50, 1.62, 0.24, 0.2, 0.4)
FINE = Marker(301, MarkerDictionary.APRILTAG_36H11, 1.62, -0.22, 0.2, -1.5)


@pytest.mark.parametrize("look", [DEFAULT, HARSH])
@pytest.mark.parametrize("marker", [TAG, FINE])
@pytest.mark.parametrize(
    ("height_m", "roll_deg", "pitch_deg", "yaw_deg"), [(0.8, 0, 0, 0), (1.2, 4, -3, 20), (1.5, -5, 5, -65)]
)
def test_a_marker_is_placed_on_the_floor_to_two_centimetres(
    look: Appearance, marker: Marker, height_m: float, roll_deg: float, pitch_deg: float, yaw_deg: float
) -> None:
    roll, pitch, yaw = math.radians(roll_deg), math.radians(pitch_deg), math.radians(yaw_deg)
    pose = hover(1.5, 0.0, height_m, roll_rad=roll, pitch_rad=pitch, yaw_rad=yaw)
    picture = Renderer(replace(DEMO, markers=(marker,)), CAMERA, look, 3).render(pose, 1)
    (seen,) = (
        Detector("combined", "yellow", LENS, markers=MarkerSet(marker.dictionary, (1, marker.id)))
        .detect(picture)
        .markers
    )
    assert seen.id == marker.id
    view = FloorView(LENS, CAMERA.mount, Attitude(0, roll, pitch, yaw), height_m, TiltCompensation.EXACT, 0.0)
    point = ground_point(seen.x_px, seen.y_px, view)
    assert point is not None
    forward, right, scale = point
    x_m = pose.x_m + math.cos(yaw) * forward - math.sin(yaw) * right
    y_m = pose.y_m + math.sin(yaw) * forward + math.cos(yaw) * right
    assert math.hypot(x_m - marker.x_m, y_m - marker.y_m) < 0.02
    assert seen.side_px * scale == pytest.approx(marker.size_m, rel=0.1)


def test_floors_without_a_marker_show_none_and_are_not_searched_unasked() -> None:
    renderer = Renderer(DEMO, CAMERA, HARSH, 5)
    every = MarkerSet(MarkerDictionary.ARUCO_4X4_50, tuple(range(50)))
    asked, unasked = Detector(lens=LENS, markers=every), Detector(lens=LENS, now_ns=time.perf_counter_ns)
    found: list[LineSet] = []
    for k, node in enumerate(DEMO.nodes.values()):
        picture = renderer.render(hover(node.x_m, node.y_m, 0.9 + 0.07 * k, yaw_rad=0.3 * k), k)
        found.append(asked.detect(picture))
        assert "markers" not in unasked.detect(picture).timings_ms
    assert not [seen.markers for seen in found if seen.markers]


def test_the_search_costs_a_small_part_of_a_detection() -> None:
    renderer = Renderer(replace(DEMO, markers=(TAG,)), CAMERA, DEFAULT, 3)
    picture = renderer.render(hover(1.5, 0.0, 1.2), 1)
    # by processor time: its threads wait for a core while other tests have it
    detector = Detector(lens=LENS, markers=MarkerSet(TAG.dictionary, (TAG.id,)), now_ns=time.process_time_ns)
    timings = [detector.detect(picture).timings_ms for _ in range(15)]
    share = [told["markers"] / sum(told.values()) for told in timings]
    assert np.median(share) < 0.5


UNIFORM = lay_out(
    "uniform",
    [Aisle("A", 0.0, 0.0, (1.5,) * 8)],
    [],
    [Pad("home", "A4", 0.5)],
    ceiling_m=6.0,
    markers=[Marker(3, MarkerDictionary.ARUCO_4X4_50, 6.2, 0.2)],
)


def test_where_cells_look_alike_a_marker_settles_where_the_drone_is() -> None:
    flight = IdealFlight(UNIFORM, CONFIG, visits=("A3",), carried_to="A5", seed=2)
    flown = flight.fly(200)
    assert [event for event in flown.events if event.text == "corrected: it is A5"]
    assert (flown.phase, flown.visited) == (Phase.DONE, ["A3"])
    assert wrong_visits(flown, UNIFORM) == []
    assert max(k.x_m for phase, k in flown.truth if phase is Phase.RELOCATE) < 6.7, "not on to the line's end"
