"""The filter against closed forms, and step for step against filterpy's."""

from __future__ import annotations

import numpy as np
import pytest
from filterpy.kalman import KalmanFilter as Reference
from hypothesis import given
from hypothesis import strategies as st

from flightd.tracking.kalman import KalmanFilter


@given(st.lists(st.tuples(st.floats(-10, 10), st.floats(0.1, 5)), min_size=1, max_size=20), st.floats(0.1, 5))
def test_a_constant_is_the_weighted_mean_of_its_measurements(
    measured: list[tuple[float, float]], prior_sigma: float
) -> None:
    kf = KalmanFilter(np.array([[1.0]]), np.array([[prior_sigma**2]]))
    kf.H = np.array([[1.0]])
    for value, sigma in measured:
        kf.update(np.array([[value]]), np.array([[sigma**2]]))
    weights = [1 / prior_sigma**2, *(1 / sigma**2 for _, sigma in measured)]
    mean = sum(w * v for w, v in zip(weights, [1.0, *(v for v, _ in measured)], strict=True)) / sum(weights)
    assert float(kf.x[0, 0]) == pytest.approx(mean, abs=1e-9)
    assert float(kf.P[0, 0]) == pytest.approx(1 / sum(weights))


def test_a_motion_is_predicted_with_its_control_and_its_noise() -> None:
    dt = 0.1
    kf = KalmanFilter(np.array([[0.0], [2.0]]), np.diag([0.01, 0.04]))
    kf.F = np.array([[1.0, dt], [0.0, 1.0]])
    kf.B = np.array([[0.5 * dt * dt], [dt]])
    kf.Q = np.diag([0.0, 0.001])
    kf.predict(u=np.array([[3.0]]))
    assert kf.x.ravel() == pytest.approx([0.215, 2.3])
    assert kf.P.ravel() == pytest.approx([0.01 + 0.04 * dt * dt, 0.04 * dt, 0.04 * dt, 0.041])


def test_the_covariance_stays_one_over_many_sharp_measurements() -> None:
    kf = KalmanFilter(np.zeros((2, 1)), np.eye(2) * 100.0)
    kf.F, kf.H, kf.Q = np.array([[1.0, 0.02], [0.0, 1.0]]), np.array([[1.0, 0.0]]), np.diag([1e-9, 1e-7])
    for step in range(3000):
        kf.predict()
        kf.update(np.array([[0.001 * step]]), np.array([[1e-8]]))
    assert np.linalg.eigvalsh(kf.P).min() > 0.0
    assert np.allclose(kf.P, kf.P.T)
    assert float(kf.x[1, 0]) == pytest.approx(0.05, rel=0.01)


@given(st.integers(0, 2**32 - 1), st.integers(1, 4))
def test_it_steps_as_the_usual_library_does(seed: int, n: int) -> None:
    random = np.random.default_rng(seed)
    spread = random.normal(size=(n, n))
    kf = KalmanFilter(random.normal(size=(n, 1)), spread @ spread.T + np.eye(n))
    usual = Reference(dim_x=n, dim_z=1, dim_u=1)
    usual.x, usual.P = kf.x.copy(), kf.P.copy()
    kf.F = usual.F = np.eye(n) + 0.1 * random.normal(size=(n, n))
    kf.B = usual.B = random.normal(size=(n, 1))
    kf.Q = usual.Q = np.diag(random.uniform(1e-6, 1e-2, n))
    kf.H = usual.H = random.normal(size=(1, n))
    for _ in range(20):
        control, measured = random.normal(size=(1, 1)), random.normal(size=(1, 1))
        noise = np.array([[random.uniform(0.01, 1.0)]])
        for each in (kf, usual):
            each.predict(u=control)
        kf.update(measured, noise)
        usual.update(measured, R=noise)
        np.testing.assert_allclose(kf.x, usual.x, rtol=1e-7, atol=1e-9)
        np.testing.assert_allclose(kf.P, usual.P, rtol=1e-7, atol=1e-9)
