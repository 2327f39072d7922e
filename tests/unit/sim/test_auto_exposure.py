"""The automatic exposure of the simulated down camera: as quick as its time constant, within its bounds."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flightd.sim.sensors.auto_exposure import GAINS, TARGET, AutoExposure, metered

STEP_S = 1.0 / 30.0


def settled(lag_s: float, light: float) -> AutoExposure:
    automatic = AutoExposure(lag_s)
    automatic.step(light, STEP_S)
    return automatic


@pytest.mark.parametrize("lag_s", [0.1, 0.5, 1.5])
def test_within_its_time_constant_it_makes_up_for_most_of_a_change_of_light(lag_s: float) -> None:
    automatic = settled(lag_s, TARGET)
    assert automatic.gain == pytest.approx(1.0)
    scene = TARGET / 2.0
    for _ in range(round(lag_s / STEP_S)):
        automatic.step(scene * automatic.gain, STEP_S)
    assert math.log2(automatic.gain) == pytest.approx(1.0 - math.exp(-1.0), abs=0.01)
    for _ in range(round(5.0 * lag_s / STEP_S)):
        automatic.step(scene * automatic.gain, STEP_S)
    assert automatic.gain == pytest.approx(2.0, rel=0.01)


def test_the_floor_that_it_stands_on_settles_it_at_once() -> None:
    assert settled(1.5, TARGET / 3.0).gain == pytest.approx(3.0)


@given(lights=st.lists(st.floats(0.0, 1.0), min_size=1, max_size=60), lag_s=st.floats(0.05, 2.0))
def test_whatever_it_sees_its_gain_stays_within_bounds(lights: list[float], lag_s: float) -> None:
    automatic = AutoExposure(lag_s)
    for light in lights:
        automatic.step(light, STEP_S)
        assert GAINS[0] <= automatic.gain * (1.0 + 1e-9)
        assert automatic.gain <= GAINS[1] * (1.0 + 1e-9)


def test_light_is_metered_without_the_gamma() -> None:
    assert metered(np.full((360, 640, 3), 255, np.uint8)) == pytest.approx(1.0)
    assert metered(np.full((360, 640, 3), 188, np.uint8)) == pytest.approx(0.5, abs=0.01)
    half = np.zeros((360, 640, 3), np.uint8)
    half[:, 320:] = 255
    assert metered(half) == pytest.approx(0.5)
