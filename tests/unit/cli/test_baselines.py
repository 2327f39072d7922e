"""What flightd is compared with does find lines: nobody is beaten who was not trying."""

from __future__ import annotations

import math

import numpy as np
import pytest

from flightd.sim.dataset.generate import generate
from flightd.studies.baselines import BASELINES


@pytest.mark.parametrize("name", BASELINES)
@pytest.mark.parametrize("seed", range(4))
def test_each_baseline_finds_a_clean_line(name: str, seed: int) -> None:
    if name.startswith("skimage"):
        pytest.importorskip("skimage")
    frame = generate("clean", seed, 640, 360, colour="yellow", layout="single")
    truth = frame.label.lines[0]
    x, y = (truth.x1 + truth.x2) / 2, (truth.y1 + truth.y2) / 2
    _, theta = truth.hessian(640, 360)
    found = BASELINES[name](frame.bgr)
    near = [
        (abs(x * math.cos(t) + y * math.sin(t) - rho), abs(math.sin(t - theta)))
        for rho, t in found
        if abs(math.sin(t - theta)) < math.radians(5)
    ]
    assert near
    assert min(near)[0] < truth.thickness / 2 + 3


@pytest.mark.parametrize("name", BASELINES)
def test_no_baseline_sees_a_line_on_an_empty_floor(name: str) -> None:
    if name.startswith("skimage"):
        pytest.importorskip("skimage")
    assert BASELINES[name](np.full((360, 640, 3), 110, np.uint8)) == []
