"""What a rolling shutter bends is put where it was at the middle row's time."""

from __future__ import annotations

import math
from dataclasses import fields, replace

import numpy as np
import pytest

from flightd.core.geometry import (
    Matrix,
    Mount,
    ground_homography,
    heading_rotation,
    normalise_line,
    wrap_half_pi,
)
from flightd.core.types import FloorFeature, Line, LineSet
from flightd.sim.plant.kinematics import Kinematics
from flightd.sim.sensors.optics import moved, wide_lens
from flightd.tracking.rolling_shutter import ImageMotion, as_of_one_moment

LENS = replace(wide_lens(), distortion=(0.0, 0.0, 0.0, 0.0, 0.0))
READOUT_S = 0.02
MOTIONS = {
    "rolls": {"roll_rate_radps": 0.6},
    "pitches": {"pitch_rate_radps": -0.5},
    "turns": {"yaw_rate_radps": 0.8},
    "flies": {"vx_mps": 0.9, "vy_mps": -0.4},
    "all at once": {"roll_rate_radps": 0.4, "pitch_rate_radps": 0.3, "yaw_rate_radps": -0.5, "vx_mps": 0.7},
}


def pose_of(motion: dict[str, float]) -> Kinematics:
    rest = {field.name: 0.0 for field in fields(Kinematics)}
    at = {"stamp_ns": 0, "x_m": 3.0, "y_m": 0.1, "height_m": 1.5, "yaw_rad": 0.4}
    return Kinematics(**(rest | at | motion))  # type: ignore[arg-type]


def pixel(point_m: tuple[float, float], pose: Kinematics, mount: Mount) -> tuple[float, float]:
    """Where a floor point is seen all at once, in centred pixels."""
    level = heading_rotation(pose.yaw_rad).T @ np.array([point_m[0] - pose.x_m, point_m[1] - pose.y_m, 0.0])
    homography = ground_homography(LENS, mount, pose.roll_rad, pose.pitch_rad)
    seen: Matrix = homography @ np.array([level[0] / pose.height_m, level[1] / pose.height_m, 1.0])
    return float(seen[0] / seen[2]) - LENS.centre_px[0], float(seen[1] / seen[2]) - LENS.centre_px[1]


def rolled(point_m: tuple[float, float], pose: Kinematics, mount: Mount) -> tuple[float, float]:
    """Where it is seen by rows that are exposed one after the other."""
    x, y = pixel(point_m, pose, mount)
    for _ in range(8):
        x, y = pixel(point_m, moved(pose, y / LENS.height_px * READOUT_S), mount)
    return x, y


def line_through(a: tuple[float, float], b: tuple[float, float]) -> Line:
    turned = math.atan2(a[0] - b[0], b[1] - a[1])
    rho, theta = normalise_line(a[0] * math.cos(turned) + a[1] * math.sin(turned), turned)
    start, end = sorted(y * math.cos(theta) - x * math.sin(theta) for x, y in (a, b))
    return Line(rho, theta, 20.0, start, end, 1.0, 0.1, 0.001)


@pytest.mark.parametrize("name", MOTIONS)
@pytest.mark.parametrize("mount", [Mount(), Mount(yaw_rad=1.2, roll_rad=0.03)], ids=["straight", "turned"])
def test_points_and_lines_are_where_they_were_at_the_middle_row(name: str, mount: Mount) -> None:
    pose = pose_of(MOTIONS[name])
    points = [(2.5, 0.0), (3.6, 0.0), (3.1, -0.4), (3.0, 0.6), (3.3, 0.3)]
    true = [pixel(point, pose, mount) for point in points]
    bent = [rolled(point, pose, mount) for point in points]
    features = tuple(FloorFeature(i, x, y) for i, (x, y) in enumerate(bent))
    lines = (line_through(bent[0], bent[1]), line_through(bent[2], bent[3]))
    seen = LineSet(0, 0, LENS.width_px, LENS.height_px, lines, (), "combined", features=features)
    rates = (pose.roll_rate_radps, pose.pitch_rate_radps, pose.yaw_rate_radps)
    motion = ImageMotion.of(rates, (pose.vx_mps, pose.vy_mps), pose.yaw_rad, pose.height_m, mount)
    straight = as_of_one_moment(seen, LENS, motion, READOUT_S)
    was_off = max(math.dist(a, b) for a, b in zip(bent, true, strict=True))
    off = max(math.dist((f.x_px, f.y_px), t) for f, t in zip(straight.features, true, strict=True))
    assert was_off > 0.5
    assert off < 0.1 * was_off
    for line, (a, b) in zip(straight.lines, ((0, 1), (2, 3)), strict=True):
        wanted = line_through(true[a], true[b])
        assert abs(wrap_half_pi(line.theta_rad - wanted.theta_rad)) < 1e-3
        assert {round(line.start_px), round(line.end_px)} == {round(wanted.start_px), round(wanted.end_px)}
        assert math.dist(line.point_at(0.0), wanted.point_at(0.0)) < 0.3


def test_a_shutter_that_opens_for_all_rows_at_once_bends_nothing() -> None:
    seen = LineSet(0, 0, 640, 360, (line_through((-100.0, 10.0), (120.0, 30.0)),), (), "combined")
    motion = ImageMotion.of((0.5, 0.0, 0.0), (0.8, 0.0), 0.0, 1.5, Mount())
    assert as_of_one_moment(seen, LENS, motion, 0.0) is seen


def test_a_line_whose_normal_turns_over_keeps_what_its_errors_have_in_common() -> None:
    motion = ImageMotion.of((0.5, 0.0, 0.0), (0.0, 0.0), 0.0, 1.5, Mount())
    straight = [line_through((40.0, -150.0), (40.0 + dx_px, 150.0)) for dx_px in (0.4, -0.4)]
    bent = tuple(replace(line, rho_theta_cov=2e-3) for line in straight)
    seen = LineSet(0, 0, LENS.width_px, LENS.height_px, bent, (), "combined")
    flipped = []
    for line, before in zip(as_of_one_moment(seen, LENS, motion, READOUT_S).lines, bent, strict=True):
        flipped.append(math.cos(line.theta_rad - before.theta_rad) < 0.0)
        assert flipped[-1] is (line.rho_px * before.rho_px < 0.0)
        assert line.rho_theta_cov == (-2e-3 if flipped[-1] else 2e-3)
    assert any(flipped)
