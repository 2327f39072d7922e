"""Straight lines through points, with honest covariances, and the test whether points are straight."""

from __future__ import annotations

import math
from dataclasses import dataclass

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


@dataclass(frozen=True, slots=True)
class RobustLines:
    """Straight lines v = a + b u through the rows of (E, S) points, outliers weighted out.

    `weight` (E, S) is each point's part in its line; `points` its sum.  `scatter` is the standard
    deviation of the points about their line, `bow` the sagitta of the best parabola through them, and
    `inflation` how much their correlation along the line widens the covariance.
    """

    a: Array
    b: Array
    mean_u: Array
    suu: Array
    weight: Array
    points: Array
    scatter: Array
    bow: Array
    inflation: Array

    def fit(self, e: int) -> LinearFit:
        """Line `e` with its covariance."""
        variance = float(self.scatter[e]) ** 2 * float(self.inflation[e])
        mean = float(self.mean_u[e])
        var_b = variance / max(float(self.suu[e]), 1e-9)
        var_a = variance / max(float(self.points[e]), 1e-9) + mean * mean * var_b
        return LinearFit(float(self.a[e]), float(self.b[e]), var_a, var_b, -mean * var_b)


_CUTS_PX = (3.0, 2.0, 1.0, 0.5, 0.3, 0.3)
_MIN_SCATTER_PX = 0.02


def robust_lines(u: Array, v: Array, weight: Array) -> RobustLines:
    """Fit each row by Tukey's biweight, its scale shrinking from the rough to the measured one."""
    w = weight
    for cut_px in _CUTS_PX:
        sw = np.maximum(w.sum(axis=1), 1e-9)
        mu, mv = (w * u).sum(axis=1) / sw, (w * v).sum(axis=1) / sw
        du, dv = u - mu[:, None], v - mv[:, None]
        wdu = w * du
        suu = np.maximum((wdu * du).sum(axis=1), 1e-9)
        b = (wdu * dv).sum(axis=1) / suu
        residual = dv - b[:, None] * du
        cut = np.maximum(4.0 * _scale(residual, weight), cut_px)[:, None]
        w = weight * np.maximum(0.0, 1.0 - (residual / cut) ** 2) ** 2
    sw = np.maximum(w.sum(axis=1), 1e-9)
    wr = w * residual
    square = (wr * residual).sum(axis=1)
    scatter = np.maximum(np.sqrt(square / np.maximum(sw - 2, 1.0)), _MIN_SCATTER_PX)

    # Over the stretch that the points really cover: 1.7 standard deviations of an even spread.
    t = du / np.maximum(1.732 * np.sqrt(suu / sw), 1.0)[:, None]
    tt = t * t
    stt = np.maximum((w * tt).sum(axis=1), 1e-9)
    q = tt - (stt / sw)[:, None] - ((w * tt * t).sum(axis=1) / stt)[:, None] * t
    bow = (wr * q).sum(axis=1) / np.maximum((w * q * q).sum(axis=1), 1e-9)

    # Wear, texture and compression move neighbouring points together: count them as a first-order
    # autoregressive process does.
    r = np.clip((wr[:, 1:] * wr[:, :-1]).sum(axis=1) / np.maximum((wr * wr).sum(axis=1), 1e-9), 0.0, 0.9)
    return RobustLines(mv - b * mu, b, mu, suu, w, sw, scatter, bow, (1 + r) / (1 - r))


def _scale(residual: Array, weight: Array) -> Array:
    """Median absolute residual of each row's valid points, as a standard deviation."""
    valid = weight > 0
    size = np.where(valid, np.abs(residual), np.inf)
    size.sort(axis=1)
    middle = np.minimum(valid.sum(axis=1) // 2, size.shape[1] - 1)
    median = size[np.arange(len(size)), middle]
    return np.where(np.isfinite(median), 1.4826 * median, 1.0)
