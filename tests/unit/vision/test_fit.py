"""Fits of straight lines and what they claim to know."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flightd.vision.lines.band import Band, LinearFit, bisector, swapped
from flightd.vision.lines.fusion import fuse
from flightd.vision.lines.line_fit import Moments, fit, is_bent, law, moments, robust_lines, rows_of, sagitta


def strip(a: float, b: float, *, steep: bool = True, sigma: float = 1.0, half: float = 5.0) -> Band:
    centre = LinearFit(a, b, sigma**2, (sigma / 100) ** 2)
    return Band(steep, centre, centre.shifted(-half), centre.shifted(half), -100.0, 100.0, 1.0)


def test_the_covariance_of_a_fit_is_that_of_repeated_fits() -> None:
    rng = np.random.default_rng(3)
    u = np.linspace(40, 240, 60)
    values = [7 + 0.3 * u + rng.normal(0, 0.5, u.size) for _ in range(600)]
    fits = [fit(moments(rows_of(u, v)), 3, 0.01) for v in values]
    errors = np.array([(f.a - 7, f.b - 0.3) for f in fits])
    claimed = np.array([fits[0].var_a, fits[0].cov_ab, fits[0].var_b])
    measured = np.cov(errors.T)[[0, 0, 1], [0, 1, 1]]
    assert measured == pytest.approx(claimed, rel=0.5)


def test_a_robust_line_ignores_a_third_of_outliers() -> None:
    rng = np.random.default_rng(4)
    u = np.tile(np.linspace(-300, 300, 96), (2, 1))
    v = 3 - 0.02 * u + rng.normal(0, 0.1, u.shape)
    v[:, ::3] += rng.uniform(-2.5, 2.5, v[:, ::3].shape)
    lines = robust_lines(u, v, np.ones_like(u), (1.5, 0.7, 0.3))
    assert lines.a == pytest.approx([3, 3], abs=0.08)
    assert lines.b == pytest.approx([-0.02, -0.02], abs=4e-4)
    assert np.all(lines.scatter < 0.2)
    assert np.all(np.abs(lines.bow) < 0.2)


def test_points_without_weight_have_no_say() -> None:
    u = np.tile(np.linspace(0, 70, 8), (1, 1))
    v, weight = 2 * u, np.ones_like(u)
    v[0, 3], weight[0, 3] = 1e6, 0.0
    lines = robust_lines(u, v, weight, (0.3,))
    assert lines.a[0] == pytest.approx(0, abs=1e-6)
    assert lines.b[0] == pytest.approx(2)


def points(u: np.ndarray, v: np.ndarray) -> tuple[Moments, float]:
    return moments(rows_of(u, v)), float(np.ptp(u))


@given(a=st.floats(-900, 900), b=st.floats(-1.2, 1.2), bow=st.floats(-9, 9), middle=st.floats(-900, 900))
def test_a_parabola_has_its_sagitta_wherever_it_lies(a: float, b: float, bow: float, middle: float) -> None:
    u = np.linspace(middle - 60, middle + 60, 41)
    v = a + b * u + bow * ((u - middle) / 60) ** 2
    height, _ = sagitta(*points(u, v), 3, 0.1)
    assert height * math.hypot(1.0, b) == pytest.approx(bow, abs=1e-4)


@given(a=st.floats(-900, 900), b=st.floats(-1.2, 1.2), middle=st.floats(-4000, 4000), seed=st.integers(0, 99))
def test_a_fit_is_the_least_squares_line_far_from_the_middle_too(
    a: float, b: float, middle: float, seed: int
) -> None:
    u = np.linspace(middle - 40, middle + 40, 21)
    v = a + b * (u - middle) + np.random.default_rng(seed).normal(0, 1, u.size)
    slope, offset = np.polyfit(u - middle, v, 1)
    sums = moments(rows_of(u, v))
    line = fit(sums, 3, 0.1)
    assert line.at(middle) == pytest.approx(offset, abs=1e-5)
    assert line.b == pytest.approx(slope, abs=1e-7)
    assert law(sums, 3) == pytest.approx((line.a, line.b))


@given(radius=st.floats(50, 500), noise=st.floats(0, 0.5))
def test_an_arc_is_bent_and_a_line_is_not(radius: float, noise: float) -> None:
    u = np.linspace(-radius / 2, radius / 2, 80)
    ripple = np.random.default_rng(1).normal(0, noise, u.size)
    arc, line = np.sqrt(radius**2 - u**2) + ripple, 0.7 * u + ripple
    core = slice(20, 60)
    sigma = max(noise, 0.1)
    assert is_bent(points(u[core], arc[core]), lambda: points(u, arc), 3, sigma)
    assert not is_bent(points(u[core], line[core]), lambda: points(u, line), 3, sigma)


def test_a_line_that_ends_in_bends_is_a_line() -> None:
    u = np.linspace(-100, 100, 101)
    v = np.where(np.abs(u) > 70, (np.abs(u) - 70) ** 2 / 60, 0.0)
    core = np.abs(u) <= 70
    assert abs(sagitta(*points(u, v), 3, 0.1)[0]) > 0.02 * 200
    assert not is_bent(points(u[core], v[core]), lambda: points(u, v), 3, 0.1)


@given(a=st.floats(-300, 300), b=st.floats(-1.2, 1.2), steep=st.booleans())
def test_a_strip_and_its_line_pass_through_the_same_points(a: float, b: float, steep: bool) -> None:
    line = strip(a, b, steep=steep).to_line()
    for u in (-80.0, 90.0):
        x, y = (a + b * u, u) if steep else (u, a + b * u)
        c, s = math.cos(line.theta_rad), math.sin(line.theta_rad)
        assert x * c + y * s == pytest.approx(line.rho_px, abs=1e-6)
        assert line.start_px - 1e-6 <= y * c - x * s <= line.end_px + 1e-6


@settings(max_examples=50)
@given(a=st.floats(-200, 200), b=st.floats(-1.2, 1.2), steep=st.booleans(), seed=st.integers(0, 99))
def test_a_line_s_covariance_is_its_strip_s(a: float, b: float, steep: bool, seed: int) -> None:
    rng = np.random.default_rng(seed)
    cov = np.array([[0.04, -3e-5], [-3e-5, 4e-8]])
    centre = LinearFit(a, b, cov[0, 0], cov[1, 1], cov[0, 1])
    line = Band(steep, centre, centre, centre, -100.0, 100.0, 1.0).to_line()
    lines = []
    for da, db in rng.multivariate_normal([0, 0], cov, 400):
        moved = LinearFit(a + da, b + db)
        other = Band(steep, moved, moved, moved, -100.0, 100.0, 1.0).to_line()
        turn, rho = other.theta_rad - line.theta_rad, other.rho_px
        if abs(turn) > 1:
            turn, rho = turn - math.copysign(math.pi, turn), -rho
        lines.append((rho - line.rho_px, turn))
    measured = np.cov(np.array(lines).T)
    assert math.sqrt(measured[0, 0]) == pytest.approx(line.sigma_rho_px, rel=0.2)
    assert math.sqrt(measured[1, 1]) == pytest.approx(line.sigma_theta_rad, rel=0.2)
    scale = line.sigma_rho_px * line.sigma_theta_rad
    assert measured[0, 1] / scale == pytest.approx(line.rho_theta_cov / scale, abs=0.2)


def test_the_bisector_of_a_tapering_band_halves_its_angle() -> None:
    low, high = LinearFit(-10.0, math.tan(-0.2)), LinearFit(10.0, math.tan(0.4))
    assert math.atan(bisector(low, high).b) == pytest.approx(0.1)


@given(a=st.floats(-50, 50), b=st.floats(0.5, 1.5), sign=st.sampled_from([-1, 1]))
def test_described_along_the_other_axis_a_strip_is_the_same_line(a: float, b: float, sign: int) -> None:
    one = strip(a, sign * b)
    line, other = one.to_line(), swapped(one).to_line()
    assert other.rho_px == pytest.approx(line.rho_px, abs=1e-6)
    assert other.theta_rad == pytest.approx(line.theta_rad)
    assert other.sigma_rho_px == pytest.approx(line.sigma_rho_px)
    assert other.width_px == pytest.approx(line.width_px)


def test_what_two_methods_found_is_averaged_by_their_certainty() -> None:
    (both,) = fuse([strip(10.0, 0.1, sigma=1.0), strip(13.0, 0.1, sigma=2.0)], tolerance_px=5.0)
    assert both.centre.a == pytest.approx(10.6)
    assert both.centre.var_a == pytest.approx(0.8)


def test_what_disagrees_is_kept_apart() -> None:
    assert len(fuse([strip(10.0, 0.1), strip(25.0, 0.1)], tolerance_px=5.0)) == 2
    assert len(fuse([strip(10.0, 0.1), strip(10.0, 0.3)], tolerance_px=5.0)) == 2
