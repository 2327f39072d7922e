"""Tilt compensation: the exact form is the homography, the paper's is its first-order limit."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from flightd.config.control import TiltCompensation
from flightd.core.geometry import Lens, Mount, ground_homography, normalise_line
from flightd.core.types import Attitude, Line
from flightd.sim.plant.kinematics import Kinematics
from flightd.sim.random_sites import random_site
from flightd.site.site import PaintedLine, Site
from flightd.tracking.tilt_compensation import FloorView, GroundLine, ground_lines, heights_by_width
from tests.sim.ideal.ideal_sight import EyeErrors, IdealEye

LENS = Lens(640, 360, 381.4, 381.4, 319.5, 179.5)
PERFECT = EyeErrors(0.0, 0.0)


def pose(x: float, y: float, height: float, roll: float, pitch: float, yaw: float) -> Kinematics:
    return Kinematics(0, x, y, height, 0, 0, 0, roll, pitch, yaw, 0, 0, 0)


def seen(site: Site, k: Kinematics, mount: Mount, how: TiltCompensation) -> list[GroundLine]:
    lines = IdealEye(site, LENS, mount, PERFECT).see(k, 0, 0).lines
    attitude = Attitude(0, k.roll_rad, k.pitch_rad, k.yaw_rad)
    return ground_lines(lines, FloorView(LENS, mount, attitude, k.height_m, how, 0.0))


def offset_in_map(line: GroundLine, k: Kinematics) -> tuple[float, float]:
    """The middle of the visible part in map coordinates."""
    c, s = math.cos(k.yaw_rad), math.sin(k.yaw_rad)
    return (
        k.x_m + c * line.forward_m - s * line.right_m,
        k.y_m + s * line.forward_m + c * line.right_m,
    )


def distance_to_paint(site: Site, x: float, y: float) -> float:
    def to(line: PaintedLine) -> float:
        dx, dy = line.x1_m - line.x0_m, line.y1_m - line.y0_m
        share = ((x - line.x0_m) * dx + (y - line.y0_m) * dy) / (dx * dx + dy * dy)
        share = min(max(share, 0.0), 1.0)
        return math.hypot(x - line.x0_m - share * dx, y - line.y0_m - share * dy)

    return min(to(line) for line in site.lines)


@given(
    roll=st.floats(-0.3, 0.3),
    pitch=st.floats(-0.3, 0.3),
    yaw=st.floats(-math.pi, math.pi),
    height=st.floats(0.5, 4.0),
    mount_yaw=st.floats(-math.pi, math.pi),
    forward=st.floats(-0.2, 0.2),
    down=st.floats(-0.1, 0.1),
)
@settings(deadline=None, max_examples=60)
def test_exact_compensation_puts_every_line_on_its_paint(
    roll: float, pitch: float, yaw: float, height: float, mount_yaw: float, forward: float, down: float
) -> None:
    site = random_site(3)
    node = site.nodes["A2"]
    k = pose(node.x_m + 0.1, node.y_m - 0.2, height, roll, pitch, yaw)
    for line in seen(site, k, Mount(mount_yaw, (forward, 0.05, down)), TiltCompensation.EXACT):
        assert distance_to_paint(site, *offset_in_map(line, k)) < 1e-6
        along_grid = (line.theta_rad + yaw) % (math.pi / 2)
        assert min(along_grid, math.pi / 2 - along_grid) < 1e-6
        distance = abs(line.right_m * math.cos(line.theta_rad) - line.forward_m * math.sin(line.theta_rad))
        assert distance == pytest.approx(abs(line.rho_m), abs=1e-6)


@pytest.mark.parametrize(("roll", "pitch"), [(1.0, 0.0), (0.0, 1.0), (0.7, -0.7)])
def test_the_papers_form_is_the_first_order_limit_of_the_exact_one(roll: float, pitch: float) -> None:
    """Halving the tilt must quarter the difference (and the uncompensated error only halves)."""
    site = random_site(3)
    node = site.nodes["A2"]

    def error(how: TiltCompensation, tilt: float) -> float:
        k = pose(node.x_m, node.y_m, 1.5, roll * tilt, pitch * tilt, 0.0)
        exact = seen(site, k, Mount(), TiltCompensation.EXACT)
        other = seen(site, k, Mount(), how)
        return max(abs(a.rho_m - b.rho_m) for a, b in zip(exact, other, strict=True))

    big, small = error(TiltCompensation.FIRST_ORDER, 0.04), error(TiltCompensation.FIRST_ORDER, 0.02)
    assert small < 0.3 * big + 1e-5
    assert error(TiltCompensation.NONE, 0.04) > 10 * big


def test_lines_at_the_horizon_and_impossible_heights_are_left_out() -> None:
    site = random_site(3)
    k = pose(0.0, 0.0, 1.5, 0.0, 0.0, 0.0)
    lines = IdealEye(site, LENS, Mount(), PERFECT).see(k, 0, 0).lines
    assert lines
    for height, roll in ((0.0, 0.0), (math.nan, 0.0), (1.5, 1.2)):
        view = FloorView(LENS, Mount(), Attitude(0, roll, 0.0, 0.0), height, TiltCompensation.EXACT, 0.0)
        assert ground_lines(lines, view) == []


@given(
    roll=st.floats(-0.3, 0.3),
    pitch=st.floats(-0.3, 0.3),
    height=st.floats(0.5, 4.0),
    forward=st.floats(-0.35, 0.35),
    right=st.floats(-0.7, 0.7),
    way=st.floats(0.0, math.pi),
)
@settings(deadline=None, max_examples=60)
def test_the_height_by_a_lines_width_is_right_wherever_the_line_is_and_however_the_drone_leans(
    roll: float, pitch: float, height: float, forward: float, right: float, way: float
) -> None:
    width_m, along = 0.01, np.array([math.cos(way), math.sin(way)])
    across = np.array([-along[1], along[0]])
    homography = ground_homography(LENS, Mount(), roll, pitch)

    def pixel(on_floor: NDArray[np.float64]) -> NDArray[np.float64]:  # of a camera `height` up
        x, y, w = homography @ np.array([*on_floor / height, 1.0])
        return np.array([x / w, y / w]) - LENS.centre_px

    middle = np.array([forward, right]) * height
    here, tangent = pixel(middle), pixel(middle + 1e-4 * along) - pixel(middle - 1e-4 * along)
    tangent /= np.linalg.norm(tangent)
    normal = np.array([-tangent[1], tangent[0]])
    width_px = abs(normal @ (pixel(middle + width_m / 2 * across) - pixel(middle - width_m / 2 * across)))
    rho, theta = normalise_line(float(normal @ here), math.atan2(normal[1], normal[0]))
    at_px = float(here @ np.array([-math.sin(theta), math.cos(theta)]))
    line = Line(rho, theta, float(width_px), at_px - 1.0, at_px + 1.0, 1.0, 0.1, 0.001)
    view = FloorView(LENS, Mount(), Attitude(0, roll, pitch, 0.0), math.nan, TiltCompensation.NONE, 0.0)
    assert heights_by_width([line], view, width_m) == pytest.approx([height], rel=1e-3)
