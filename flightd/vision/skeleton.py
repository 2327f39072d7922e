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
from flightd.vision.centroid import fit_line
from flightd.vision.plane import Plane
from flightd.vision.sampling import Grid
from flightd.vision.strip import Array, LinearFit, Strip

CLUSTER_RAD = math.radians(5.0)
"""Lines closer than this in angle, and crossing within a band's width, are one (paper, section IV)."""

_MIN_VOTES = 12
_MAX_CANDIDATES = 120
_AROUND = np.ones((5, 5), np.uint8)


def distance_ridge(mask: Image) -> tuple[NDArray[np.bool_], NDArray[np.float32]]:
    """Ridge samples of the 0/255 mask and every sample's distance to the unpainted, in samples."""
    distance = np.asarray(cv2.distanceTransform(mask, cv2.DIST_L2, 3), np.float32)
    # A sample is on the ridge when nothing two samples around is deeper; the staircase of a slanted edge
    # makes small peaks too, but those have deeper paint right behind them.
    deepest = cv2.dilate(distance, _AROUND)
    return (distance >= deepest - 0.7) & (mask > 0), distance


def thin(mask: Image) -> Image:
    """Zhang-Suen thinning of a 0/255 mask to one pixel wide lines (Comm. ACM 27(3), 1984)."""
    image = np.zeros((mask.shape[0] + 2, mask.shape[1] + 2), np.uint8)
    image[1:-1, 1:-1] = mask > 0
    changed = True
    while changed:
        changed = False
        for first in (True, False):
            ys, xs = np.nonzero(image)
            p = [image[ys + dy, xs + dx] for dy, dx in _NEIGHBOURS]
            count = sum(p[1:], start=p[0].astype(np.int16))
            rises = np.zeros(len(ys), np.int16)
            for k in range(8):
                rises += (p[k] == 0) & (p[(k + 1) % 8] == 1)
            north, east, south, west = p[0], p[2], p[4], p[6]
            if first:
                edge = (north & east & south) | (east & south & west)
            else:
                edge = (north & east & west) | (north & south & west)
            remove = (count >= 2) & (count <= 6) & (rises == 1) & (edge == 0)
            if remove.any():
                image[ys[remove], xs[remove]] = 0
                changed = True
    return np.ascontiguousarray(image[1:-1, 1:-1]) * np.uint8(255)


_NEIGHBOURS = ((-1, 0), (-1, 1), (0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1))
"""Clockwise from north, as P2..P9 of the algorithm."""


def find(mask: Image, grid: Grid, plane: Plane, *, zhang_suen: bool = False) -> list[Strip]:
    """Straight bands in the mask, best supported first."""
    ridge, distance = distance_ridge(mask)
    if zhang_suen:
        ridge = thin(mask) > 0
    ys, xs = np.nonzero(ridge)
    if len(xs) < _MIN_VOTES:
        return []
    radius = distance[ys, xs].astype(float) * grid.step
    x, y = plane.ideal(grid.x(xs), grid.y(ys))
    votes = ridge.astype(np.uint8)
    found = cv2.HoughLines(votes, 1, math.pi / 180, _MIN_VOTES)
    if found is None:
        return []
    candidates = np.asarray(found, float).reshape(-1, found.shape[-1])[:_MAX_CANDIDATES, :2]
    strips: list[Strip] = []
    free = np.ones(len(xs), np.bool_)
    for rho, theta in candidates:
        # Hough's rho is in samples from the first sample.
        c, s = math.cos(theta), math.sin(theta)
        centred = rho * grid.step + float(grid.x(0)) * c + float(grid.y(0)) * s
        if not plane.is_identity:
            centred, c, s = _straightened(centred, c, s, plane)
        off = np.abs(x * c + y * s - centred)
        members = np.flatnonzero((off <= 1.5 * grid.step) & free)
        if len(members) < _MIN_VOTES:
            continue
        strip = _fit_ridge(x, y, radius, members, free, grid.step, steep=abs(c) >= abs(s))
        if strip is None:
            continue
        strips.append(strip)
        away = (
            (x - strip.centre.a - strip.centre.b * y)
            if strip.steep
            else (y - strip.centre.a - strip.centre.b * x)
        )
        free &= np.abs(away) * strip.cosine > max(2 * grid.step, 0.3 * strip.width_px)
    return strips


def _straightened(rho: float, c: float, s: float, plane: Plane) -> tuple[float, float, float]:
    half = plane.height_px / 4
    xs = np.array([rho * c - half * s, rho * c + half * s])
    ys = np.array([rho * s + half * c, rho * s - half * c])
    xs, ys = plane.ideal(xs, ys)
    dx, dy = float(xs[1] - xs[0]), float(ys[1] - ys[0])
    length = math.hypot(dx, dy)
    nx, ny = -dy / length, dx / length
    if nx * c + ny * s < 0:
        nx, ny = -nx, -ny
    return float(xs[0] * nx + ys[0] * ny), nx, ny


def _fit_ridge(
    x: Array,
    y: Array,
    radius: Array,
    members: NDArray[np.intp],
    free: NDArray[np.bool_],
    step: int,
    *,
    steep: bool,
) -> Strip | None:
    u, v = (y, x) if steep else (x, y)
    for limit in (1.5, 1.0):
        typical = float(np.median(radius[members]))
        kept = members[np.abs(radius[members] - typical) <= 1.2 * step + 0.3 * typical]
        if len(kept) < _MIN_VOTES:
            return None
        fit = fit_line(u[kept], v[kept], step / math.sqrt(6))
        off = np.abs(v - fit.a - fit.b * u)
        members = np.flatnonzero((off <= limit * step) & free)
        if len(members) < _MIN_VOTES:
            return None
    typical = float(np.median(radius[kept]))
    # The distance is to the first unpainted sample's centre: half a sample beyond the edge.
    half = max(step / 2, typical - step / 2) * math.hypot(1.0, fit.b)
    u0, u1 = float(u[kept].min()), float(u[kept].max())
    slabs = np.unique(np.round(u[kept] / step)).size
    support = slabs * step / max(step, u1 - u0 + step)
    return Strip(steep, fit, _shifted(fit, -half), _shifted(fit, half), u0 - step / 2, u1 + step / 2, support)


def _shifted(fit: LinearFit, by: float) -> LinearFit:
    return LinearFit(fit.a + by, fit.b, fit.var_a, fit.var_b, fit.cov_ab)
