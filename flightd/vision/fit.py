"""Straight lines through points, with honest covariances, and the test whether points are straight."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flightd.vision.strip import Array, LinearFit

MAX_BOW = 0.02
"""Sagitta over chord beyond which a band is a curve: an arc of radius 6 chords.  What cheap lenses bend
stays below it."""


def fit_line(u: Array, v: Array, sigma: float) -> LinearFit:
    """Least squares v = a + b u, each v good to at least `sigma`; the covariance follows the scatter."""
    return fit_rows(np.stack((np.ones_like(u), u, v)), sigma)[0]


def fit_rows(points: Array, sigma: float) -> list[LinearFit]:
    """`fit_line` of each of the rows from the third on of the (K, N) `points`, whose first is ones and
    whose second is u.  One product of the points with themselves holds all the sums."""
    sums = (points @ points.T).tolist()
    n, su, suu = sums[0][0], sums[0][1], sums[1][1]
    mean_u = su / n
    suu -= su * mean_u
    fits = []
    for k in range(2, len(sums)):
        sv, suv, svv = sums[0][k], sums[1][k], sums[k][k]
        suv -= mean_u * sv
        b = suv / suu if suu > 0 else 0.0
        variance = max(sigma * sigma, (svv - sv * sv / n - b * suv) / max(1.0, n - 2))
        var_b = variance / suu if suu > 0 else variance
        fits.append(
            LinearFit(sv / n - b * mean_u, b, variance / n + mean_u * mean_u * var_b, var_b, -mean_u * var_b)
        )
    return fits


def is_bent(core: tuple[Array, Array], around: tuple[Array, Array], sigma: float) -> bool:
    """Whether points (u, v), each good to `sigma`, run on a curve.

    Of a curve the points that fit a straight line look straight: what lies around them must bend by
    MAX_BOW.  But straight bands end in bends, too: so their core must bend the same way.
    """
    wide, wide_sigma, chord = sagitta(*around, sigma)
    if abs(wide) <= max(MAX_BOW * chord, 4 * wide_sigma):
        return False
    narrow, narrow_sigma, chord = sagitta(*core, sigma)
    return narrow * wide > 0 and abs(narrow) > max(0.5 * MAX_BOW * chord, narrow_sigma)


def sagitta(u: Array, v: Array, sigma: float) -> tuple[float, float, float]:
    """Height of the best parabola's arc over its chord, its standard deviation, and the chord."""
    n = len(u)
    if n < 5:
        return 0.0, math.inf, 0.0
    first, last = float(u.min()), float(u.max())
    chord = last - first
    if chord <= 0:
        return 0.0, math.inf, 0.0
    rows = np.empty((4, n))
    rows[0] = 1.0
    t = np.multiply(u, 2 / chord, out=rows[1])
    t -= (first + last) / chord
    np.multiply(t, t, out=rows[2])
    np.subtract(v, v[0], out=rows[3])
    (_, s1, s2, sv), (_, _, s3, s1v), (_, _, s4, s2v), (_, _, _, svv) = (rows @ rows.T).tolist()
    # v = c0 + c1 t + c2 q with q the part of t^2 that no straight line explains: the sagitta is c2, to
    # within how unevenly the points lie.
    stt, stq, stv = s2 - s1 * s1 / n, s3 - s1 * s2 / n, s1v - s1 * sv / n
    if stt <= 1e-9 * n:
        return 0.0, math.inf, chord
    sqq, sqv = s4 - s2 * s2 / n - stq * stq / stt, s2v - s2 * sv / n - stq * stv / stt
    if sqq <= 1e-9 * n:
        return 0.0, math.inf, chord
    c1, c2 = stv / stt, sqv / sqq
    residual = svv - sv * sv / n - c1 * stv - c2 * sqv
    variance = max(sigma * sigma, residual / max(1, n - 3))
    slope = math.hypot(1.0, c1 * 2 / chord)
    return c2 / slope, math.sqrt(variance / sqq) / slope, chord


@dataclass(frozen=True, slots=True)
class RobustLines:
    """Straight lines v = a + b u through the rows of (E, S) points, outliers weighted out.

    `points` is the sum of the points' weights, `scatter` the standard deviation about the line, `bow` the
    sagitta of the best parabola.  `mean_variance` is the variance of v at `mean_u`, `spread` the
    variance of u; both errors follow from them.
    """

    a: Array
    b: Array
    mean_u: Array
    spread: Array
    points: Array
    scatter: Array
    bow: Array
    mean_variance: Array

    def fit(self, e: int) -> LinearFit:
        """Line `e` with its covariance."""
        variance, mean = float(self.mean_variance[e]), float(self.mean_u[e])
        var_b = variance / max(float(self.spread[e]), 1e-9)
        return LinearFit(
            float(self.a[e]), float(self.b[e]), variance + mean * mean * var_b, var_b, -mean * var_b
        )


_MIN_SCATTER_PX = 0.02
_STRETCHES = 8
_SHARED_PER_PX = 3.0
"""Rough edges (wear, blur, compression) also err together over longer stretches than a line shows; found by
normalised errors on generated frames of all levels: 1.1 for smooth edges, 2 at 0.35 px of scatter."""


def robust_lines(u: Array, v: Array, weight: Array, cuts_px: tuple[float, ...]) -> RobustLines:
    """Fit each row by Tukey's biweight; `cuts_px` are the smallest cuts of the iterations, rough to fine."""
    valid = weight > 0
    w = weight
    for cut_px in cuts_px:
        sw, mu, mv, du, dv, suu, b = _weighted(u, v, w)
        residual = dv - b[:, None] * du
        cut = np.maximum(4.0 * _scale(residual, valid), cut_px)[:, None]
        near = np.maximum(0.0, 1.0 - (residual / cut) ** 2)
        w = weight * near**2
    sw = np.maximum(w.sum(axis=1), 1e-9)
    wr = w * residual
    srr = _dot(wr, residual)
    scatter = np.maximum(np.sqrt(srr / np.maximum(sw - 2, 1.0)), _MIN_SCATTER_PX)

    # Over the stretch that the points really cover: 1.7 standard deviations of an even spread.
    t = du / np.maximum(1.732 * np.sqrt(suu / sw), 1.0)[:, None]
    wt = w * t
    stt, tt = np.maximum(_dot(wt, t), 1e-9), t * t
    q = tt - (stt / sw)[:, None] - (_dot(wt, tt) / stt)[:, None] * t
    bow = _dot(wr, q) / np.maximum(_dot(w * q, q), 1e-9)

    # The variance of an M-estimator (Huber): points half-way out count against it.  Wear, texture, shadow
    # and compression move neighbouring points together, which shows in the sums over stretches of the
    # line: they scatter more than independent points would.
    rr = np.maximum(_dot(wr, wr), 1e-12)
    sums = wr.reshape(len(wr), _STRETCHES, -1).sum(axis=2)
    inflation = np.maximum(1.0, _dot(sums, sums) / rr * (_STRETCHES / (_STRETCHES - 2)))
    rough = (1.0 + _SHARED_PER_PX * np.minimum(scatter, 0.5)) ** 2
    slope = np.maximum((weight * near * (5.0 * near - 4.0)).sum(axis=1), 0.2 * sw)
    noise = np.maximum(rr, sw * _MIN_SCATTER_PX**2) / slope**2
    return RobustLines(mv - b * mu, b, mu, suu / sw, sw, scatter, bow, noise * inflation * rough)


def weighted_lines(u: Array, v: Array, weight: Array) -> tuple[Array, Array]:
    """Plain weighted least squares of each row: a and b (E,)."""
    _, mu, mv, _, _, _, b = _weighted(u, v, weight)
    return mv - b * mu, b


def _weighted(u: Array, v: Array, w: Array) -> tuple[Array, Array, Array, Array, Array, Array, Array]:
    sw = np.maximum(w.sum(axis=1), 1e-9)
    mu, mv = _dot(w, u) / sw, _dot(w, v) / sw
    du, dv = u - mu[:, None], v - mv[:, None]
    wdu = w * du
    suu = np.maximum(_dot(wdu, du), 1e-9)
    return sw, mu, mv, du, dv, suu, _dot(wdu, dv) / suu


def _dot(a: Array, b: Array) -> Array:
    """Row by row scalar products."""
    return np.asarray(np.einsum("es,es->e", a, b))


def row_medians(values: Array, valid: NDArray[np.bool_]) -> Array:
    """Median of each row's valid values; infinite where none is."""
    ordered = np.where(valid, values, np.inf)
    ordered.sort(axis=1)
    middle = np.minimum(np.count_nonzero(valid, axis=1) // 2, ordered.shape[1] - 1)
    return np.asarray(ordered[np.arange(len(ordered)), middle])


def _scale(residual: Array, valid: NDArray[np.bool_]) -> Array:
    """Median absolute residual of each row's valid points, as a standard deviation."""
    return np.minimum(1.4826 * row_medians(np.abs(residual), valid), 1.0)
