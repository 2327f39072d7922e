"""A rack front that is dark, or too light, is counted in passing as one in the usual light is."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import cache

import cv2
import pytest

from flightd.app.build import scanner_of
from flightd.config.paths import shipped
from flightd.config.schema import load_config
from flightd.core.inventory import LocationState
from flightd.core.scanning import BodyPose, Finding
from flightd.mission.scan.scanner import Scanner
from flightd.sim.plant.kinematics import Kinematics
from flightd.sim.racks.appearance import RackAppearance
from flightd.sim.racks.front_camera import FrontCamera
from flightd.sim.racks.renderer import FrontRenderer
from flightd.sim.sensors.optics import Taking
from flightd.site.site_file import load_site
from flightd.vision.shelf.shelf_look import read_shelf

SITE = load_site(shipped("site-racks-small.toml"))
NODES = [node.id for node in SITE.aisle_nodes("A")][:3]
SEED, EMPTY_SEED = 4, 6
"""Of the goods; with the second there is an empty place on each level."""
BEFORE_M = 2.0
"""A leg is reached with the shelf in view already, as on the turn before it."""


@pytest.fixture(autouse=True)
def one_thread() -> Iterator[None]:
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    yield
    cv2.setNumThreads(threads)


@cache
def flown_past(
    *lit: float, learns: bool, lamp: float = 0.0, level: int = 1, seed: int = SEED
) -> tuple[dict[str, Finding], int]:
    """What is found on the left of aisle A, from that level on, in that light, of which there may be one for
    each level, by that lamp, and how many places there are."""
    expert = {} if learns else {"darker": 1.0, "brighter": 1.0}
    config = load_config(shipped("sim.toml")).with_values(
        front_camera={"url": "udp://127.0.0.1:0"}, scan={"mode": "sweep", "expert": expert}
    )
    scanner = scanner_of(config, SITE)
    assert isinstance(scanner, Scanner)
    legs = scanner.legs(NODES, NODES[0], -math.pi / 2, 0.9)
    leg = next(leg for leg in legs if leg.side.value == "left" and leg.levels[0] == level)
    camera = FrontCamera()
    light = {f"A left {number}": factor for number, factor in enumerate(lit, start=1)} | {"A left": lit[0]}
    renderer = FrontRenderer(SITE, camera, RackAppearance(light=light), seed)
    scanner.begin_sweep([leg])
    scanner.begin_leg(0)
    scanner.step_sweep(0, leg, 0.0)
    how, now_ns, seq = [scanner.exposure] * 2, 1, 0
    xs, y_m = [SITE.locations[code].x_m for code in leg.locations], SITE.nodes[NODES[0]].y_m
    x_m = min(xs) - BEFORE_M
    while x_m < max(xs) + BEFORE_M:
        speed_mps = min(leg.speed_mps, scanner.passing_mps)
        pose = BodyPose(now_ns, x_m, y_m, leg.height_m, 0.0, 0.0, leg.yaw_rad, 0.01, 0.01, 0.004, True)
        places = scanner.places(pose)
        if places:
            moves = speed_mps, 0.0, 0.0, 0.0, 0.0, leg.yaw_rad, 0.0, 0.0, 0.0
            true = Kinematics(now_ns, x_m, y_m, leg.height_m, *moves)
            taken = how[0]  # asked for two pictures ago
            picture = renderer.render(true, seq, None, Taking(*taken, lamp))
            scanner.take(read_shelf(picture, seq, now_ns, places, *taken)[0], pose)
        scanner.step_sweep(now_ns, leg, speed_mps)
        how = [*how[1:], scanner.exposure]
        x_m += speed_mps / camera.fps
        seq, now_ns = seq + 1, now_ns + round(1e9 / camera.fps)
    scanner.end_leg(leg)
    scanner.end_sweep(now_ns)
    return {found.location: found for found in scanner.drain()[0]}, len(leg.locations)


def states(found: dict[str, Finding]) -> dict[str, LocationState]:
    return {code: finding.state for code, finding in found.items()}


def test_a_front_in_the_usual_light_is_counted_whole() -> None:
    found, count = flown_past(1.0, learns=True)
    assert len(found) == count
    assert states(found) == states(flown_past(1.0, learns=False)[0])


@pytest.mark.parametrize("lit", [0.35, 2.0])
def test_a_dark_or_over_lit_front_is_counted_as_well_but_for_where_its_light_was_learnt(lit: float) -> None:
    right = states(flown_past(1.0, learns=False)[0])
    left_alone, count = flown_past(lit, learns=False)
    found, _ = flown_past(lit, learns=True)
    assert len(left_alone) <= count / 2
    assert len(found) >= count - 1
    assert states(found).items() <= right.items()


@pytest.mark.parametrize(("level", "lit"), [(1, (0.5, 2.0)), (2, (2.0, 0.5))])
def test_a_level_is_counted_in_its_own_light_whatever_its_neighbours_is(
    level: int, lit: tuple[float, float]
) -> None:
    right = states(flown_past(1.0, learns=False, level=level, seed=EMPTY_SEED)[0])
    found, count = flown_past(*lit, learns=True, level=level, seed=EMPTY_SEED)
    assert LocationState.EMPTY in right.values()
    assert len(found) >= count - 1
    assert states(found).items() <= right.items()


def test_a_lamp_lights_a_dark_front() -> None:
    """By itself, without another exposure."""
    without, count = flown_past(0.2, learns=False)
    lit, _ = flown_past(0.2, learns=False, lamp=0.9)
    assert len(without) <= count / 2
    assert len(lit) == count
