"""What a picture of the simulated front camera costs, in units of one BGR-to-HSV conversion of the same
picture.

`pytest -s tests/bench/test_front_renderer_cost.py` prints the milliseconds of one core's time too.
"""

import math
from collections.abc import Callable
from pathlib import Path
from time import thread_time

import cv2
import numpy as np

from flightd.sim.plant.kinematics import Kinematics
from flightd.sim.racks.appearance import RackAppearance
from flightd.sim.racks.front_camera import FrontCamera, front_lens
from flightd.sim.racks.renderer import FrontRenderer
from flightd.site.site_file import load_site

SITE = load_site(Path(__file__).parents[2] / "configs" / "site-racks-small.toml")
FRAMES = 30


def before_the_shelf(frame: int) -> Kinematics:
    """Hovering before a bay, rocking a little as a drone does."""
    sway = math.sin(frame / 4)
    yaw_rad = math.pi / 2 + 0.03 * sway
    return Kinematics(
        frame, 2.6 + 0.03 * sway, 0.0, 1.6, 0.05, 0.0, 0.0, 0.03 * sway, 0.02, yaw_rad, 0.0, 0.0, 0.0
    )


def cost_ms(work: Callable[[int], object]) -> float:
    """Median CPU time of one call."""
    spent = []
    for i in range(FRAMES):
        start = thread_time()
        work(i)
        spent.append((thread_time() - start) * 1e3)
    return float(np.median(spent))


def test_a_picture_costs_a_few_conversions() -> None:
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        renderer = FrontRenderer(SITE, FrontCamera(lens=front_lens(1280, 720)), RackAppearance(), 1)
        out = np.empty((720, 1280, 3), np.uint8)
        renderer.render(before_the_shelf(0), 0, out)  # the first view's goods are not steady state
        unit_ms = cost_ms(lambda _: cv2.cvtColor(out, cv2.COLOR_BGR2HSV))
        median_ms = cost_ms(lambda i: renderer.render(before_the_shelf(i), i, out))
    finally:
        cv2.setNumThreads(threads)
    print(f"\n1280x720: median {median_ms:.2f} ms, {median_ms / unit_ms:.0f} conversions of {unit_ms:.2f} ms")
    assert median_ms < 30 * unit_ms
