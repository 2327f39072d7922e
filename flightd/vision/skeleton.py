"""Skeleton method: the ridge of the paint, Hough lines on it, clustered by mean.

The default ridge is where the distance to the nearest unpainted sample peaks across the band: one
distance transform instead of dozens of thinning passes, the band's half width for free, and no bias.
Zhang-Suen thinning, the paper's, is there by option.
"""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from flightd.core.types import Image
from flightd.vision.fit import bow, fit_line
from flightd.vision.plane import Plane
from flightd.vision.sampling import Grid
from flightd.vision.strip import Array, Strip

CLUSTER_RAD = math.radians(5.0)
"""Hough lines closer than this in angle, a few samples apart, are one line (paper, section IV)."""

_MIN_POINTS = 10
_VOTE_SHARE = 0.06
"""Votes a Hough line needs, as a part of the mask's longer side."""
_MAX_CANDIDATES = 64
_MAX_CLUSTERS = 12
_AROUND = np.ones((5, 5), np.uint8)
_NEIGHBOURS = ((-1, 0), (-1, 1), (0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1))
"""Clockwise from north, P2..P9 of Zhang and Suen."""


def distance_ridge(mask: Image) -> tuple[NDArray[np.bool_], NDArray[np.float32]]:
    """Ridge samples of the 0/255 mask and every sample's distance to the unpainted, in samples."""
    distance = np.asarray(cv2.distanceTransform(mask, cv2.DIST_L2, 3), np.float32)
    # A sample is on the ridge when nothing two samples around is deeper; the staircase of a slanted edge
    # makes small peaks too, but those have deeper paint right behind them.
    deepest = cv2.dilate(distance, _AROUND)
    return (distance >= deepest - 0.7) & (mask > 0), distance


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


def find(mask: Image, grid: Grid, plane: Plane, *, zhang_suen: bool = False) -> list[Strip]:
    """Straight bands in the mask, best supported first."""
    ridge, distance = distance_ridge(mask)
    if zhang_suen:
        ridge = thin(mask) > 0
    ys, xs = np.nonzero(ridge)
    if len(xs) < _MIN_POINTS:
        return []
    radius = distance[ys, xs].astype(float) * grid.step
    x, y = plane.ideal(grid.x(xs), grid.y(ys))
    need = max(_MIN_POINTS, round(_VOTE_SHARE * max(mask.shape)))
    found = cv2.HoughLines(ridge.view(np.uint8), 1, math.pi / 180, need)
    if found is None:
        return []
    peaks = np.asarray(found, np.float64).reshape(-1, found.shape[-1])[:_MAX_CANDIDATES]
    strips: list[Strip] = []
    free = np.ones(len(xs), np.bool_)
    for mean_rho, theta in _clusters(peaks, grid):
        rho, c, s = mean_rho, math.cos(theta), math.sin(theta)
        if not plane.is_identity:
            rho, c, s = _straightened(rho, c, s, plane)
        members = np.flatnonzero((np.abs(x * c + y * s - rho) <= 1.5 * grid.step) & free)
        if len(members) < _MIN_POINTS:
            continue
        steep = abs(c) >= abs(s)
        u, v = (y, x) if steep else (x, y)
        strip = _fit_ridge(u, v, radius, members, free, grid.step, steep=steep)
        if strip is None:
            continue
        strips.append(strip)
        away = np.abs(v - strip.centre.a - strip.centre.b * u) * strip.cosine
        free &= away > max(2 * grid.step, 0.3 * strip.width_px)
    return strips


def _clusters(peaks: Array, grid: Grid) -> list[tuple[float, float]]:
    """Mean (rho, theta) of the Hough peaks that belong together, strongest first, about the image centre."""
    theta = peaks[:, 1]
    # Hough's rho is in samples from the first sample.
    rho = peaks[:, 0] * grid.step + float(grid.x(0)) * np.cos(theta) + float(grid.y(0)) * np.sin(theta)
    votes = peaks[:, 2] if peaks.shape[1] > 2 else np.arange(len(peaks), 0, -1.0)
    means: list[tuple[float, float]] = []
    left = np.ones(len(peaks), np.bool_)
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


def _straightened(rho: float, c: float, s: float, plane: Plane) -> tuple[float, float, float]:
    """The line of a distortion-free camera through two points of the raw one."""
    half = plane.height_px / 4
    x, y = plane.ideal(
        np.array([rho * c - half * s, rho * c + half * s]), np.array([rho * s + half * c, rho * s - half * c])
    )
    dx, dy = float(x[0] - x[1]), float(y[0] - y[1])
    length = math.hypot(dx, dy)
    nx, ny = dy / length, -dx / length
    return float(x[0] * nx + y[0] * ny), nx, ny


def _fit_ridge(
    u: Array,
    v: Array,
    radius: Array,
    members: NDArray[np.intp],
    free: NDArray[np.bool_],
    step: int,
    *,
    steep: bool,
) -> Strip | None:
    """A straight line through the ridge; None when too little of it is straight and of one width."""
    noise = step / math.sqrt(6)
    for limit in (1.5, 1.0):
        typical = _median(radius[members])
        kept = members[np.abs(radius[members] - typical) <= 1.2 * step + 0.3 * typical]
        if len(kept) < _MIN_POINTS:
            return None
        fit = fit_line(u[kept], v[kept], noise)
        members = np.flatnonzero((np.abs(v - fit.a - fit.b * u) <= limit * step) & free)
        if len(members) < _MIN_POINTS:
            return None
    if bow(u[kept], v[kept], noise):
        return None
    # The distance is to the first unpainted sample's centre: half a sample beyond the edge.
    half = max(step / 2, typical - step / 2) * math.hypot(1.0, fit.b)
    u0, u1 = float(u[kept].min()) - step / 2, float(u[kept].max()) + step / 2
    slabs = np.count_nonzero(np.bincount(((u[kept] - u0) / step).astype(np.intp)))
    return Strip(steep, fit, fit.shifted(-half), fit.shifted(half), u0, u1, slabs * step / (u1 - u0))


def _median(values: Array) -> float:
    middle = len(values) // 2
    return float(np.partition(values, middle)[middle])
