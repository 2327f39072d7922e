"""What paint the bands account for."""

from __future__ import annotations

import math

import numpy as np
import pytest

from flightd.core.types import Image
from flightd.vision import centroid, evidence
from flightd.vision.plane import Plane
from flightd.vision.sampling import Grid
from tests.unit.vision.drawing import Band, coverage, grid

GRID, PLANE = Grid(320, 240, 1), Plane(320, 240)


def mask_of(bands: list[Band]) -> Image:
    mask: Image = ((coverage(bands, *grid(320, 240)) > 0.5) * 255).astype(np.uint8)
    return mask


@pytest.mark.parametrize("theta", [0.0, 0.7, 1.9])
def test_paint_is_left_until_every_band_is_known(theta: float) -> None:
    bands = [Band(-40.0, theta, 12.0), Band(30.0, theta + math.pi / 2, 20.0)]
    strips = centroid.find(mask_of(bands), GRID, PLANE)
    assert len(strips) == 2
    assert not evidence.is_paint_left(mask_of(bands), strips, GRID, PLANE)
    for one in strips:
        assert evidence.is_paint_left(mask_of(bands), [one], GRID, PLANE)


def test_specks_are_no_paint_left() -> None:
    mask = mask_of([])
    mask[50:54, 60:64] = 255
    assert not evidence.is_paint_left(mask, [], GRID, PLANE)
