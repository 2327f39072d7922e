"""The filter's steps against closed forms, and step for step against filterpy's."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flightd.tracking.kalman import corrected, predicted


@given(st.lists(st.tuples(st.floats(-10, 10), st.floats(0.1, 5)), min_size=1, max_size=20), st.floats(0.1, 5))
def test_a_constant_is_the_weighted_mean_of_its_measurements(
    measured: list[tuple[float, float]], prior_sigma: float
) -> None:
    x, p, row = np.array([1.0]), np.array([[prior_sigma**2]]), np.array([[1.0]])
    for value, sigma in measured:
        x, p, _ = corrected(x, p, row, x - value, np.array([[sigma**2]]))
    weights = [1 / prior_sigma**2, *(1 / sigma**2 for _, sigma in measured)]
    mean = sum(w * v for w, v in zip(weights, [1.0, *(v for v, _ in measured)], strict=True)) / sum(weights)
    assert float(x[0]) == pytest.approx(mean, abs=1e-9)
    assert float(p[0, 0]) == pytest.approx(1 / sum(weights))


def test_the_covariance_stays_one_over_many_sharp_measurements() -> None:
    x, p = np.zeros(2), np.eye(2) * 100.0
    step_of, row, drift = np.array([[1.0, 0.02], [0.0, 1.0]]), np.array([[1.0, 0.0]]), np.diag([1e-9, 1e-7])
    for step in range(3000):
        x, p = step_of @ x, predicted(p, step_of, drift)
        x, p, _ = corrected(x, p, row, row @ x - 0.001 * step, np.array([[1e-8]]))
    assert np.linalg.eigvalsh(p).min() > 0.0
    assert np.allclose(p, p.T)
    assert float(x[1]) == pytest.approx(0.05, rel=0.01)


@given(st.integers(0, 2**32 - 1), st.integers(1, 4), st.integers(1, 3))
def test_it_steps_as_the_usual_library_does(seed: int, n: int, m: int) -> None:
    from filterpy.kalman import KalmanFilter as Reference  # it takes a second

    random = np.random.default_rng(seed)
    spread = random.normal(size=(n, n))
    usual = Reference(dim_x=n, dim_z=m)
    x, p = random.normal(size=n), spread @ spread.T + np.eye(n)
    usual.x, usual.P = x.reshape(-1, 1).copy(), p.copy()
    usual.F = np.eye(n) + 0.1 * random.normal(size=(n, n))
    usual.Q = np.diag(random.uniform(1e-6, 1e-2, n))
    usual.H = random.normal(size=(m, n))
    for _ in range(20):
        measured, noise = random.normal(size=m), np.diag(random.uniform(0.01, 1.0, m))
        usual.predict()
        x, p = usual.F @ x, predicted(p, usual.F, usual.Q)
        usual.update(measured.reshape(-1, 1), R=noise)
        x, p, _ = corrected(x, p, usual.H, usual.H @ x - measured, noise)
        np.testing.assert_allclose(x, usual.x.ravel(), rtol=1e-7, atol=1e-9)
        np.testing.assert_allclose(p, usual.P, rtol=1e-7, atol=1e-9)
