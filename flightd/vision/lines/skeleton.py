"""Skeleton method: the ridge of the paint, Hough lines on it, clustered by mean.

The default ridge is where the distance to the nearest unpainted sample peaks across the band: one
distance transform instead of dozens of thinning passes, the band's half width for free, and no bias.
Zhang-Suen thinning, the paper's, is there by option.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from flightd.core.types import Image
from flightd.vision.lines.band import Array, Band, LinearFit
from flightd.vision.lines.line_fit import BEYOND, Moments, fit, is_bent, law, moments, rows_of
from flightd.vision.lines.sampling import Grid
from flightd.vision.lines.undistortion import Plane

CLUSTER_RAD = math.radians(5.0)
"""Hough lines closer than this in angle, a few samples apart, are one line (paper, section IV)."""

_MIN_POINTS = 10
_VOTE_SHARE = 0.06
"""Votes a Hough line needs, as a part of the mask's longer side."""
_MAX_CANDIDATES = 64
_MAX_CLUSTERS = 10
_WEAKEST = 0.12
"""Hough lines with less than this part of the strongest one's votes are scraps."""
_PLACE, _RADIUS = 3, 4
"""Rows of what is known at ridge points: their place across the band, and the band's half width there."""
_AROUND = np.ones((5, 5), np.uint8)
_NEIGHBOURS = ((-1, 0), (-1, 1), (0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1))
"""Clockwise from north, P2..P9 of Zhang and Suen."""


def distance_ridge(mask: Image) -> tuple[NDArray[np.bool_], NDArray[np.float32]]:
    """Ridge samples of the 0/255 mask and every sample's distance to the unpainted, in samples."""
    distance = np.asarray(cv2.distanceTransform(mask, cv2.DIST_L2, 3), np.float32)
    distance = np.minimum(distance, np.float32(max(mask.shape)))  # paint everywhere is infinitely deep
    # A sample is on the ridge when nothing two samples around is deeper; the staircase of a slanted edge
    # makes small peaks too, but those have deeper paint right behind them.
    deepest = cv2.dilate(distance, _AROUND)
    ridge = (distance >= deepest - 0.7) & (mask > 0)
    # Paint that the picture's border cuts is deepest there, on no ridge of its own.
    ridge[[0, -1]] = False
    ridge[:, [0, -1]] = False
    return ridge, distance


def thin(mask: Image) -> Image:
    """Zhang-Suen thinning of a 0/255 mask to lines one sample wide (Comm. ACM 27(3), 1984)."""
    image = np.zeros((mask.shape[0] + 2, mask.shape[1] + 2), np.uint8)
    image[1:-1, 1:-1] = mask > 0
    changed = True
    while changed:
        changed = False
        for first in (True, False):
            ys, xs = np.nonzero(image)
            p = np.stack([image[ys + dy, xs + dx] for dy, dx in _NEIGHBOURS])
            count = p.sum(axis=0)
            rises = ((p == 0) & (np.roll(p, -1, axis=0) == 1)).sum(axis=0)
            north, east, south, west = p[0], p[2], p[4], p[6]
            kept = (east & south & (north | west)) if first else (north & west & (east | south))
            remove = (count >= 2) & (count <= 6) & (rises == 1) & (kept == 0)
            if remove.any():
                image[ys[remove], xs[remove]] = 0
                changed = True
    return np.ascontiguousarray(image[1:-1, 1:-1]) * np.uint8(255)


def find(
    mask: Image, grid: Grid, plane: Plane, seeds: Sequence[Band] = (), *, zhang_suen: bool = False
) -> list[Band]:
    """Straight bands in the mask.

    The ridge is first fitted along `seeds`, bands that are known roughly; Hough then looks for lines in
    what is left of it.
    """
    ridge, distance = distance_ridge(mask)
    if zhang_suen:
        ridge = thin(mask) > 0
    place = np.flatnonzero(ridge)
    if len(place) < _MIN_POINTS:
        return []
    ys, xs = np.divmod(place, ridge.shape[1])
    radius = distance.ravel()[place].astype(float) * grid.step
    x, y = plane.ideal(grid.x(xs), grid.y(ys))
    points = _Ridge(x, y, radius, np.ones(len(x), np.bool_), grid.step)
    strips = [_take_band(points, *_normal(seed), passes=1) for seed in seeds]
    need = max(_MIN_POINTS, round(_VOTE_SHARE * max(mask.shape)))
    if np.count_nonzero(points.free) >= need:
        if seeds:
            ridge.ravel()[place[~points.free]] = False
        found = cv2.HoughLinesWithAccumulator(ridge.view(np.uint8), 1, math.pi / 180, need)
        peaks = np.zeros((0, 3)) if found is None else np.asarray(found, np.float64).reshape(-1, 3)
        lines = _clusters(peaks[:_MAX_CANDIDATES], grid)
        strips += [_take_band(points, *_straightened(*line, plane)) for line in lines]
    return [strip for strip in strips if strip is not None]


@dataclass(frozen=True, slots=True)
class _Ridge:
    """Ridge points in centred frame pixels, the band's half width there, and which are not yet taken."""

    x: Array
    y: Array
    radius: Array
    free: NDArray[np.bool_]
    step: int


def _take_band(ridge: _Ridge, rho: float, c: float, s: float, passes: int = 2) -> Band | None:
    """The straight band along a line; its points are taken off the free ones."""
    members = np.flatnonzero((np.abs(ridge.x * c + ridge.y * s - rho) <= 1.5 * ridge.step) & ridge.free)
    if len(members) < _MIN_POINTS:
        return None
    steep = abs(c) >= abs(s)
    u, v = (ridge.y, ridge.x) if steep else (ridge.x, ridge.y)
    strip = _fit_ridge(u, v, ridge, members, passes, steep=steep)
    if strip is not None:
        away = np.abs(v - strip.centre.a - strip.centre.b * u) * strip.cosine
        np.logical_and(ridge.free, away > max(2 * ridge.step, 0.3 * strip.width_px), out=ridge.free)
    return strip


def _normal(strip: Band) -> tuple[float, float, float]:
    """(rho, cos theta, sin theta) of a band's centre line."""
    n = strip.cosine
    across, along = n, -strip.centre.b * n
    return (strip.centre.a * n, across, along) if strip.steep else (strip.centre.a * n, along, across)


def _clusters(peaks: Array, grid: Grid) -> list[tuple[float, float]]:
    """Mean (rho, theta) of the Hough peaks that belong together, strongest first, about the image centre."""
    theta, votes = peaks[:, 1], peaks[:, 2]
    # Hough's rho is in samples from the first sample.
    rho = peaks[:, 0] * grid.step + float(grid.x(0)) * np.cos(theta) + float(grid.y(0)) * np.sin(theta)
    means: list[tuple[float, float]] = []
    left = votes >= _WEAKEST * votes.max(initial=0.0)
    while left.any() and len(means) < _MAX_CLUSTERS:
        first = int(left.argmax())
        turn = (theta - theta[first] + math.pi / 2) % math.pi - math.pi / 2
        flipped = np.abs(theta - theta[first]) > math.pi / 2
        shift = np.where(flipped, -rho, rho) - rho[first]
        member = left & (np.abs(turn) <= CLUSTER_RAD) & (np.abs(shift) <= 6 * grid.step)
        near = member & (np.abs(turn) <= CLUSTER_RAD / 2) & (np.abs(shift) <= 2 * grid.step)
        weight = votes[near] / votes[near].sum()
        means.append((rho[first] + float(weight @ shift[near]), theta[first] + float(weight @ turn[near])))
        left &= ~member
    return means


def _straightened(rho: float, theta: float, plane: Plane) -> tuple[float, float, float]:
    """(rho, cos theta, sin theta) that a distortion-free camera would see."""
    c, s = math.cos(theta), math.sin(theta)
    if plane.is_identity:
        return rho, c, s
    half = plane.height_px / 4
    x, y = plane.ideal(
        np.array([rho * c - half * s, rho * c + half * s]), np.array([rho * s + half * c, rho * s - half * c])
    )
    dx, dy = float(x[0] - x[1]), float(y[0] - y[1])
    length = math.hypot(dx, dy)
    nx, ny = dy / length, -dx / length
    return float(x[0] * nx + y[0] * ny), nx, ny


def _fit_ridge(
    u: Array, v: Array, ridge: _Ridge, members: NDArray[np.intp], passes: int, *, steep: bool
) -> Band | None:
    """A straight line through the ridge; None when too little of it is straight and of one width."""
    radius, step = ridge.radius, ridge.step
    noise = step / math.sqrt(6)
    points = rows_of(u, v, radius)
    for _ in range(passes):
        # The band may taper; where others cross or join it, the ridge is wider than its own line says.
        near = points.take(members, axis=1)
        a, b = law(moments(near), _RADIUS)
        off = np.abs(near[_RADIUS] - a - b * near[1])
        near = near.compress(off <= 1.2 * step + 0.2 * near[_RADIUS], axis=1)
        if near.shape[1] < _MIN_POINTS:
            return None
        core = moments(near)
        centre, half = fit(core, _PLACE, noise), fit(core, _RADIUS, noise)
        away = np.abs(v - centre.a - centre.b * u)
        members = np.flatnonzero((away <= 1.5 * step) & ridge.free)
        if len(members) < _MIN_POINTS:
            return None
    along = near[1]
    first, last = float(along.min()), float(along.max())

    def around() -> tuple[Moments, float]:
        reach = BEYOND * (last - first)
        wide = points.compress((away <= 3 * step) & (u >= first - reach) & (u <= last + reach), axis=1)
        return moments(wide), float(np.ptp(wide[1]))

    if is_bent((core, last - first), around, _PLACE, noise):
        return None
    # The distance is to the first unpainted sample's centre: half a sample beyond the edge.
    stretch = math.hypot(1.0, centre.b)
    u0, u1 = first - step / 2, last + step / 2
    if min(half.at(u0), half.at(u1)) < step / 2:
        return None
    a, b = (half.a - step / 2) * stretch, half.b * stretch
    # The transform counts whole samples: its edges are known half as well as its ridge.
    variance = step * step / 4
    low = LinearFit(centre.a - a, centre.b - b, centre.var_a + variance, centre.var_b, centre.cov_ab)
    high = LinearFit(centre.a + a, centre.b + b, centre.var_a + variance, centre.var_b, centre.cov_ab)
    slabs = np.count_nonzero(np.bincount(((along - u0) / step).astype(np.intp)))
    return Band(steep, centre, low, high, u0, u1, slabs * step / (u1 - u0))
