"""Ridge and thinning of a mask."""

from __future__ import annotations

import math

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from flightd.core.types import Image
from flightd.vision.lines import skeleton
from flightd.vision.lines.sampling import Grid
from flightd.vision.lines.undistortion import Plane
from tests.unit.vision import drawing
from tests.unit.vision.drawing import Band, grid

CLOCKWISE = ((-1, 0), (-1, 1), (0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1))


def mask_of(bands: list[Band], width: int = 160, height: int = 120) -> Image:
    return drawing.mask_of(bands, *grid(width, height))


def test_thinning_leaves_one_connected_line_one_sample_wide() -> None:
    mask = mask_of([Band(0, 0.0, 15.0), Band(0, math.pi / 2, 15.0)])
    thin = skeleton.thin(mask)
    assert not np.any((thin > 0) & (mask == 0))
    count, _ = cv2.connectedComponents(thin, connectivity=8)
    assert count == 2  # the floor and one skeleton
    blocks = np.lib.stride_tricks.sliding_window_view(thin > 0, (2, 2)).sum(axis=(2, 3))
    assert np.count_nonzero(blocks == 4) == 0


def thinned_pixel_by_pixel(mask: Image) -> NDArray[np.bool_]:
    """The algorithm as published: conditions (a) to (d) and (c'), (d'), each pass on the one before."""
    image = np.pad(mask > 0, 1)
    changed = True
    while changed:
        changed = False
        for first in (True, False):
            doomed = []
            for y, x in zip(*np.nonzero(image), strict=True):
                ring = [image[y + dy, x + dx] for dy, dx in CLOCKWISE]
                p2, _, p4, _, p6, _, p8, _ = ring
                turns = sum(not a and b for a, b in zip(ring, [*ring[1:], ring[0]], strict=True))
                if first:
                    open_side = not (p2 and p4 and p6) and not (p4 and p6 and p8)
                else:
                    open_side = not (p2 and p4 and p8) and not (p2 and p6 and p8)
                if 2 <= sum(ring) <= 6 and turns == 1 and open_side:
                    doomed.append((y, x))
            for place in doomed:
                image[place] = False
            changed |= bool(doomed)
    return np.asarray(image[1:-1, 1:-1])


@pytest.mark.parametrize("seed", range(4))
def test_thinning_is_zhang_and_suen_s(seed: int) -> None:
    grain = cv2.GaussianBlur(np.random.default_rng(seed).normal(size=(50, 60)), (0, 0), 3.0)
    mask: Image = ((grain > 0.03) * 255).astype(np.uint8)
    assert np.array_equal(skeleton.thin(mask) > 0, thinned_pixel_by_pixel(mask))


@pytest.mark.parametrize("theta", [0.0, 0.5, 1.2, math.pi / 2, 2.2])
def test_the_ridge_runs_along_the_middle(theta: float) -> None:
    ridge, distance = skeleton.distance_ridge(mask_of([Band(7.0, theta, 17.0)]))
    x, y = grid(160, 120)
    off = (x * math.cos(theta) + y * math.sin(theta) - 7.0)[ridge]
    assert np.abs(off).max() < 2.5
    assert abs(off.mean()) < 0.3
    assert distance[ridge].mean() == pytest.approx(8.5, abs=1.2)


@pytest.mark.parametrize("zhang_suen", [False, True])
def test_bands_come_out_of_ridge_and_skeleton_alike(zhang_suen: bool) -> None:
    bands = [Band(-20.0, 0.3, 12.0), Band(20.0, 0.3 + math.pi / 2, 12.0)]
    strips = skeleton.find(mask_of(bands), Grid(160, 120, 1), Plane(160, 120), zhang_suen=zhang_suen)
    for band in bands:
        assert any(
            abs(line.rho_px - band.rho) < 1.5 and abs(line.theta_rad - band.theta) < 0.03
            for line in (s.to_line() for s in strips)
        )
