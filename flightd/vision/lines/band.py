"""A straight painted band, as the methods hand it from hypothesis to refinement.

Inside vision a band is described in the image axis along which it runs: a *steep* one as x = a + b y, a
shallow one as y = a + b x, in pixels about the image centre.  In that form edges are found along whole
pixel rows or columns, with no interpolation of the picture, and a fit is linear.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from flightd.core.geometry import normalise_line
from flightd.core.types import Line

Array: TypeAlias = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class LinearFit:
    """v = a + b u with the covariance of (a, b)."""

    a: float
    b: float
    var_a: float = 0.0
    var_b: float = 0.0
    cov_ab: float = 0.0

    def at(self, u: float) -> float:
        return self.a + self.b * u

    def shifted(self, by: float, variance: float = 0.0) -> LinearFit:
        """The parallel `by` further along v, itself known to `variance`."""
        return LinearFit(self.a + by, self.b, self.var_a + variance, self.var_b, self.cov_ab)


@dataclass(frozen=True, slots=True)
class Band:
    """A band between two edges, `low` on the side of smaller v, visible for u in [u0, u1].

    `steep` says that u is y and v is x.  `centre` is the bisector of the edges.  `support` is the part
    of the span that is painted, `clear` the part that also shows floor on both sides.
    """

    steep: bool
    centre: LinearFit
    low: LinearFit
    high: LinearFit
    u0: float
    u1: float
    support: float
    clear: float = 1.0

    @property
    def cosine(self) -> float:
        """Ratio of a distance across the band to the same distance measured along v."""
        return 1.0 / math.hypot(1.0, self.centre.b)

    @property
    def width_px(self) -> float:
        middle = (self.u0 + self.u1) / 2
        return max(0.0, self.high.at(middle) - self.low.at(middle)) * self.cosine

    @property
    def length_px(self) -> float:
        return (self.u1 - self.u0) / self.cosine

    def run(self, width_px: float, height_px: float) -> tuple[float, float]:
        """From where to where along u its centre line is inside a picture of that size."""
        half_u, half_v = width_px / 2, height_px / 2
        if self.steep:
            half_u, half_v = half_v, half_u
        a, b = self.centre.a, self.centre.b
        slope = b if abs(b) > 1e-9 else 1e-9
        one, other = (-half_v - a) / slope, (half_v - a) / slope
        u0, u1 = max(-half_u, min(one, other)), min(half_u, max(one, other))
        return u0, max(u0 + 1.0, u1)

    def to_line(self) -> Line:
        """The same band as a message: Hessian normal form, its covariance carried over to first order."""
        a, b = self.centre.a, self.centre.b
        norm2 = 1.0 + b * b
        norm = math.sqrt(norm2)
        if self.steep:
            rho, theta = normalise_line(a / norm, math.atan2(-b, 1.0))
            raw_theta, theta_b = math.atan2(-b, 1.0), -1.0 / norm2
        else:
            rho, theta = normalise_line(a / norm, math.atan2(1.0, -b))
            raw_theta, theta_b = math.atan2(1.0, -b), 1.0 / norm2
        flip = -1.0 if abs(raw_theta - theta) > 1e-9 else 1.0
        rho_a, rho_b = flip / norm, -flip * a * b / (norm2 * norm)
        c = self.centre
        var_rho = rho_a**2 * c.var_a + rho_b**2 * c.var_b + 2 * rho_a * rho_b * c.cov_ab
        cov = theta_b * (rho_a * c.cov_ab + rho_b * c.var_b)
        direction = (-math.sin(theta), math.cos(theta))
        ends = []
        for u in (self.u0, self.u1):
            x, y = (c.at(u), u) if self.steep else (u, c.at(u))
            ends.append(x * direction[0] + y * direction[1])
        return Line(
            rho_px=rho,
            theta_rad=theta,
            width_px=self.width_px,
            start_px=min(ends),
            end_px=max(ends),
            support=min(1.0, max(0.0, self.support)),
            sigma_rho_px=math.sqrt(max(0.0, var_rho)),
            sigma_theta_rad=abs(theta_b) * math.sqrt(max(0.0, c.var_b)),
            rho_theta_cov=cov,
        )


def bisector(low: LinearFit, high: LinearFit) -> LinearFit:
    """The line midway between two edges: of parallel ones the middle, of tapering ones the bisector of
    their angle.  The edges' errors are taken as independent."""
    n_low, n_high = math.hypot(1.0, low.b), math.hypot(1.0, high.b)
    scale = 1.0 / (1.0 / n_low + 1.0 / n_high)
    return LinearFit(
        a=(low.a / n_low + high.a / n_high) * scale,
        b=(low.b / n_low + high.b / n_high) * scale,
        var_a=(low.var_a + high.var_a) / 4,
        var_b=(low.var_b + high.var_b) / 4,
        cov_ab=(low.cov_ab + high.cov_ab) / 4,
    )


def swapped(strip: Band) -> Band:
    """The same band described along the other image axis; only for bands near the diagonal."""

    def turn(fit: LinearFit) -> LinearFit:
        b = 1.0 / fit.b
        # u = (v - a) / b: the covariance follows from d(a'), d(b') in (a, b).
        ja, jb, kb = -b, fit.a * b * b, -b * b
        return LinearFit(
            -fit.a * b,
            b,
            ja * ja * fit.var_a + jb * jb * fit.var_b + 2 * ja * jb * fit.cov_ab,
            kb * kb * fit.var_b,
            ja * kb * fit.cov_ab + jb * kb * fit.var_b,
        )

    low, high = turn(strip.low), turn(strip.high)
    if strip.centre.b > 0:
        low, high = high, low
    ends = sorted((strip.centre.at(strip.u0), strip.centre.at(strip.u1)))
    return Band(not strip.steep, turn(strip.centre), low, high, ends[0], ends[1], strip.support, strip.clear)
