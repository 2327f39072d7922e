"""Labels are read in passing at the plan's speed, however they are tilted: the benchmark in short."""

from __future__ import annotations

import math

import cv2
import numpy as np
import pytest

from flightd.sim.racks.code_symbols import Symbol, Symbology
from tools.bench_passes import Passed, flight_of, passes, shelf
from tools.pass_drawing import HungBox, Tilt

SEED = 2
FLIGHT = 3
"""Past linear codes turned by 16, 17 and 23 degrees, the first leant by 18 besides."""


@pytest.fixture(scope="module")
def passed() -> list[Passed]:
    site = shelf(nodes=3)
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        return list(passes(site, flight_of(site, SEED, FLIGHT), SEED))
    finally:
        cv2.setNumThreads(threads)


def test_every_label_is_read_in_passing_at_the_speed_of_the_plan(passed: list[Passed]) -> None:
    assert len(passed) == 6
    assert sum(one.symbology in {Symbology.CODE_128, Symbology.EAN_13} for one in passed) == 4
    assert max(one.tilt_deg for one in passed) > 20.0
    assert [one for one in passed if not one.read] == []


def test_nothing_is_told_that_is_not_there(passed: list[Passed]) -> None:
    assert not any(one.wrong for one in passed)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_tilted_box_is_as_large_as_it_was_and_leans_as_far_as_it_is_tilted(side: float) -> None:
    right, up = Tilt(lean_rad=math.radians(25.0), axis_rad=0.7).axes(side, -side)
    assert np.linalg.norm(right) == pytest.approx(1.0)
    assert np.linalg.norm(up) == pytest.approx(1.0)
    assert right @ up == pytest.approx(0.0)
    facing = abs(np.cross(right, up)[1])
    assert math.degrees(math.acos(facing)) == pytest.approx(25.0)
    flat_right, flat_up = Tilt().axes(side, -side)
    assert flat_right.tolist() == [side, 0.0, 0.0]
    assert flat_up.tolist() == [0.0, 0.0, 1.0]


def test_a_box_has_room_for_its_turned_label() -> None:
    label = Symbol(Symbology.EAN_13, "4012345678901")
    upright = HungBox(label, False, 0.003, 0.0, 1.4, Tilt(), 1).size_m
    turned = HungBox(label, False, 0.003, 0.0, 1.4, Tilt(turn_rad=math.radians(30.0)), 1).size_m
    assert upright == pytest.approx((117 * 0.003 + 0.08, 0.22))
    assert turned[1] > upright[1] + 0.1
