"""Straight lines through points, with honest covariances, and the test whether points are straight."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from flightd.vision.lines.band import Array, LinearFit

MAX_BOW = 0.02
"""Sagitta over chord beyond which a band is a curve: an arc of radius 6 chords.  What cheap lenses bend
stays below it."""

BEYOND = 0.3
"""A curve shows in how it goes on by this part of what looks straight."""

Moments: TypeAlias = list[list[float]]
"""(3 + K, 3 + K) sums of products of the rows one, u, u squared, and K times v at u."""


def rows_of(u: Array, *values: Array) -> Array:
    """(3 + K, N) rows whose moments are asked for: one, u, u squared, and K values at u."""
    return np.stack((np.ones_like(u), u, u * u, *values))


def moments(rows: Array) -> Moments:
    """All that lines and parabolas through the points of `rows_of` follow from."""
    sums: Moments = (rows @ rows.T).tolist()
    return sums


def _line(sums: Moments, column: int) -> tuple[float, float, float, float, float]:
    """Least squares a and b of v = a + b u for the values in a row of the moments, the mean of u, and the
    sums of squares of u and of products with the values about it."""
    n, su, sv = sums[0][0], sums[0][1], sums[0][column]
    mean_u = su / n
    suu, suv = sums[1][1] - su * mean_u, sums[1][column] - mean_u * sv
    b = suv / suu if suu > 0 else 0.0
    return sv / n - b * mean_u, b, mean_u, suu, suv


def law(sums: Moments, column: int) -> tuple[float, float]:
    """Least squares (a, b) of v = a + b u for the values in a row of the moments."""
    a, b, *_ = _line(sums, column)
    return a, b


def fit(sums: Moments, column: int, sigma: float) -> LinearFit:
    """The same with its covariance: the values are good to at least `sigma`, and to their scatter."""
    n, sv = sums[0][0], sums[0][column]
    a, b, mean_u, suu, suv = _line(sums, column)
    variance = max(sigma * sigma, (sums[column][column] - sv * sv / n - b * suv) / max(1.0, n - 2))
    var_b = variance / suu if suu > 0 else variance
    return LinearFit(a, b, variance / n + mean_u * mean_u * var_b, var_b, -mean_u * var_b)


def is_bent(
    core: tuple[Moments, float], around: Callable[[], tuple[Moments, float]], column: int, sigma: float
) -> bool:
    """Whether points, each good to `sigma`, run on a curve: `core` and `around` are their moments, and how
    far they reach along u; v is in the given row.

    Of a curve the points that fit a straight line look straight: what lies around them must bend by
    MAX_BOW.  But straight bands end in bends, too: so their core must bend the same way.
    """
    narrow, narrow_sigma = sagitta(*core, column, sigma)
    if abs(narrow) <= max(0.5 * MAX_BOW * core[1], narrow_sigma):
        return False
    sums, chord = around()
    wide, wide_sigma = sagitta(sums, chord, column, sigma)
    return narrow * wide > 0 and abs(wide) > max(MAX_BOW * chord, 4 * wide_sigma)


def sagitta(sums: Moments, chord: float, column: int, sigma: float) -> tuple[float, float]:
    """Height over its `chord` of the best parabola's arc through the values in a row of the moments, and its
    standard deviation."""
    n, s1, s2 = sums[0][:3]
    if n < 5 or chord <= 0:
        return 0.0, math.inf
    s3, s4 = sums[1][2], sums[2][2]
    sv, s1v, s2v, svv = sums[0][column], sums[1][column], sums[2][column], sums[column][column]
    # About the points' mean, t = u - mean and w = v - mean.
    mean_u, mean_v = s1 / n, sv / n
    tt = s2 - mean_u * s1
    ttt = s3 - 3 * mean_u * s2 + 2 * mean_u * mean_u * s1
    tttt = s4 - 4 * mean_u * s3 + 6 * mean_u * mean_u * s2 - 3 * mean_u**3 * s1
    tw = s1v - mean_u * sv
    ttw = s2v - 2 * mean_u * s1v + mean_u * mean_u * sv - mean_v * tt
    half = chord / 2
    if tt <= 1e-9 * n * half**2:
        return 0.0, math.inf
    # v = c0 + c1 t + c2 q with q the part of t^2 that no straight line explains: the sagitta is c2 over half
    # the chord, to within how unevenly the points lie.
    qq, qw = tttt - tt * tt / n - ttt * ttt / tt, ttw - ttt * tw / tt
    if qq <= 1e-9 * n * half**4:
        return 0.0, math.inf
    c1, c2 = tw / tt, qw / qq
    residual = svv - mean_v * sv - c1 * tw - c2 * qw
    variance = max(sigma * sigma, residual / max(1.0, n - 3))
    scale = half * half / math.hypot(1.0, c1)
    return c2 * scale, math.sqrt(variance / qq) * scale


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
