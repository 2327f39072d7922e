"""Arrival goes by the motion averaged over a moment."""

from __future__ import annotations

import math

import pytest

from flightd.core.types import GridPose
from flightd.mission.flight.smoothed_motion import SmoothedMotion


def pose(x_m: float, vx_mps: float) -> GridPose:
    return GridPose(0, "A1", 0.0, 0.0, 0.0, x_m, 0.0, vx_mps, 0.0, 1.6, (0.0,) * 9, 1.0)


def test_a_speed_that_swings_about_nothing_is_rest() -> None:
    motion = SmoothedMotion()
    for tick in range(200):
        swing = 2.0 * math.pi * 1.5 * tick * 0.02
        motion.step(pose(0.02 * math.sin(swing), 0.19 * math.cos(swing)), 0.02)
    assert motion.speed_mps < 0.08
    assert motion.distance_m((0.0, 0.0)) < 0.03


def test_what_moves_evenly_is_followed_without_a_lag() -> None:
    motion = SmoothedMotion()
    for tick in range(200):
        motion.step(pose(0.8 * 0.02 * tick, 0.8), 0.02)
    assert motion.speed_mps == pytest.approx(0.8)
    assert motion.distance_m((0.8 * 0.02 * 199, 0.0)) < 0.02


def test_without_a_pose_it_is_nowhere_and_begins_anew() -> None:
    motion = SmoothedMotion()
    assert motion.speed_mps == math.inf
    motion.step(pose(5.0, 1.0), 0.02)
    motion.step(None, 0.02)
    assert motion.distance_m((5.0, 0.0)) == math.inf
    motion.step(pose(1.0, 0.0), 0.02)
    assert motion.distance_m((1.0, 0.0)) == 0.0
    assert motion.speed_mps == 0.0
