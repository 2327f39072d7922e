"""Straight lines through points, with honest covariances, and the test whether points are straight."""

from __future__ import annotations

import math

import numpy as np

from flightd.vision.strip import Array, LinearFit

MAX_BOW = 0.02
"""Sagitta over chord beyond which a band is a curve: an arc of radius 6 chords.  What cheap lenses bend
stays below it."""


def fit_line(u: Array, v: Array, sigma: float) -> LinearFit:
    """Least squares v = a + b u, each v good to at least `sigma`; the covariance follows the scatter."""
    n = len(u)
    mean_u, mean_v = float(np.add.reduce(u)) / n, float(np.add.reduce(v)) / n
    du, dv = u - mean_u, v - mean_v
    suu, suv = float(du @ du), float(du @ dv)
    b = suv / suu if suu > 0 else 0.0
    variance = max(sigma * sigma, (float(dv @ dv) - b * suv) / max(1, n - 2))
    var_b = variance / suu if suu > 0 else variance
    return LinearFit(mean_v - b * mean_u, b, variance / n + mean_u * mean_u * var_b, var_b, -mean_u * var_b)


def bow(u: Array, v: Array, sigma: float) -> bool:
    """Whether v(u) is bent: its sagitta exceeds MAX_BOW of the chord, and four of its own sigmas."""
    n = len(u)
    chord = float(u.max() - u.min())
    if n < 5 or chord <= 0:
        return False
    t = (u - float(np.add.reduce(u)) / n) * (2 / chord)
    # v = c0 + c1 t + c2 q with q the part of t^2 that no straight line explains: the sagitta is c2, to
    # within how unevenly the points lie.
    tt = t * t
    stt = float(t @ t)
    q = tt - stt / n - (float(t @ tt) / stt) * t
    sqq = float(q @ q)
    if sqq <= 1e-9 * n:
        return False
    c1, c2 = float(t @ v) / stt, float(q @ v) / sqq
    residual = v - float(np.add.reduce(v)) / n - c1 * t - c2 * q
    variance = max(sigma * sigma, float(residual @ residual) / max(1, n - 3))
    sagitta = abs(c2) / math.hypot(1.0, c1 * 2 / chord)
    return sagitta > max(MAX_BOW * chord, 4 * math.sqrt(variance / sqq))
