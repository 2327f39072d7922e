"""What a picture of the simulated camera costs, in units of one BGR-to-HSV conversion of the same picture.

`pytest -s tests/bench/test_renderer_cost.py` prints the milliseconds of one core's time too.
"""

import math
from collections.abc import Callable
from pathlib import Path
from time import thread_time

import cv2
import numpy as np
import pytest

from flightd.sim.floor.renderer import Renderer
from flightd.sim.plant.kinematics import Kinematics
from flightd.sim.sensors.optics import SimCamera, wide_lens
from flightd.site.site_file import load_site

SITE = load_site(Path(__file__).parents[2] / "configs" / "site-demo.toml")
FRAMES = 60


def along_the_aisle(frame: int) -> Kinematics:
    """0.4 m/s along aisle A at 1.2 m, rocking a little as a drone does."""
    t = frame / 30.0
    sway = math.sin(t)
    return Kinematics(
        stamp_ns=round(t * 1e9),
        x_m=0.5 + 0.4 * t,
        y_m=0.03 * sway,
        height_m=1.2,
        vx_mps=0.4,
        vy_mps=0.03,
        climb_mps=0.0,
        roll_rad=0.05 * sway,
        pitch_rad=0.04 * sway,
        yaw_rad=0.03 * sway,
        roll_rate_radps=0.05,
        pitch_rate_radps=0.04,
        yaw_rate_radps=0.03,
    )


def cost_ms(work: Callable[[int], object]) -> tuple[float, float]:
    """Median and mean CPU time of one call."""
    spent = []
    for i in range(FRAMES):
        start = thread_time()
        work(i)
        spent.append((thread_time() - start) * 1e3)
    return float(np.median(spent)), float(np.mean(spent))


@pytest.mark.parametrize(("width_px", "height_px"), [(640, 360), (1920, 1080)])
def test_a_picture_costs_a_few_conversions(width_px: int, height_px: int) -> None:
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        renderer = Renderer(SITE, SimCamera(lens=wide_lens(width_px, height_px)))
        out = np.empty((height_px, width_px, 3), np.uint8)
        renderer.render(along_the_aisle(0), 0, out)  # the first view's tiles are not steady state
        unit_ms, _ = cost_ms(lambda _: cv2.cvtColor(out, cv2.COLOR_BGR2HSV))
        median_ms, mean_ms = cost_ms(lambda i: renderer.render(along_the_aisle(i), i, out))
    finally:
        cv2.setNumThreads(threads)
    print(
        f"\n{width_px}x{height_px}: median {median_ms:.2f} ms, mean with new floor {mean_ms:.2f} ms, "
        f"{median_ms / unit_ms:.0f} conversions of {unit_ms:.2f} ms"
    )
    assert median_ms < 40 * unit_ms
    assert mean_ms < 60 * unit_ms
