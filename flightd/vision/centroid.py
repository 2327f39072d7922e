"""Centroid method: thin slabs, the centroid of every band in each slab, RANSAC through the centroids.

The paper cuts the picture into W x H slices whose number follows the lines' coverage, and takes the
centroid of the largest contour of each.  Here a slice is a slab one sample thick across the whole
picture, and every band in it gives a centroid: in the thin limit the centroid of a straight band's cut is
exactly on its centre line whatever its slope, and parallel lines and crossings do not compete for slices.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from flightd.core.types import Image
from flightd.vision.plane import Plane
from flightd.vision.sampling import Grid
from flightd.vision.strip import Array, LinearFit, Strip, bisector

TRIALS = 256
MAX_SLOPE = 1.25
"""dv/du of a band described along its own axis; a little beyond the diagonal so that none falls between."""

_RANDOM = np.random.default_rng(20190909).random((2, TRIALS))
"""The same draws for every frame: one frame, one answer."""

Indices = NDArray[np.intp]


@dataclass(frozen=True, slots=True)
class Cuts:
    """Where slabs cut bands: slab position `u`, edges `low` < `high`, all in centred frame pixels.

    `whole` is False where the picture's border cuts the band off.
    """

    u: Array
    low: Array
    high: Array
    whole: NDArray[np.bool_]
    spacing_px: float


def slab_spacing(coverage: float) -> int:
    """Samples between slabs: little paint (thin or far lines) needs many slabs, much paint few."""
    return 1 if coverage < 0.04 else 2 if coverage < 0.15 else 3


def cut(mask: Image, grid: Grid, *, steep: bool, spacing: int) -> Cuts:
    """Cut the 0/255 mask by every `spacing`-th row (for steep bands) or column (for shallow ones)."""
    first = spacing // 2
    slabs = mask[first::spacing] if steep else cv2.transpose(mask)[first::spacing]
    rows, length = slabs.shape
    padded = np.zeros((rows, length + 2), np.uint8)
    padded[:, 1:-1] = slabs
    flat = padded.ravel()
    changes = np.flatnonzero(flat[1:] != flat[:-1])
    starts, ends = changes[0::2], changes[1::2]
    row = starts // (length + 2)
    start, end = starts - row * (length + 2), ends - row * (length + 2)
    along, across = (grid.y, grid.x) if steep else (grid.x, grid.y)
    return Cuts(
        u=along(row * spacing + first),
        low=across(start - 0.5),
        high=across(end - 0.5),
        whole=(start > 0) & (end < length),
        spacing_px=float(spacing * grid.step),
    )


def find(mask: Image, grid: Grid, plane: Plane) -> list[Strip]:
    """Straight bands in the mask, best supported first, each described along its own axis."""
    spacing = slab_spacing(cv2.countNonZero(mask) / mask.size)
    strips: list[Strip] = []
    for steep in (True, False):
        cuts = cut(mask, grid, steep=steep, spacing=spacing)
        strips += _bands(_straightened(cuts, plane, steep=steep), grid.step, steep=steep)
    return strips


def _straightened(cuts: Cuts, plane: Plane, *, steep: bool) -> Cuts:
    if plane.is_identity:
        return cuts
    if steep:
        low, u_low = plane.ideal(cuts.low, cuts.u)
        high, u_high = plane.ideal(cuts.high, cuts.u)
    else:
        u_low, low = plane.ideal(cuts.u, cuts.low)
        u_high, high = plane.ideal(cuts.u, cuts.high)
    return Cuts((u_low + u_high) / 2, low, high, cuts.whole, cuts.spacing_px)


def _bands(cuts: Cuts, step: int, *, steep: bool) -> list[Strip]:
    """Sequential RANSAC: one matrix of hypotheses against centroids serves all lines of a direction."""
    usable = np.flatnonzero(cuts.whole)
    if len(usable) < 4:
        return []
    u, low, high = cuts.u[usable], cuts.low[usable], cuts.high[usable]
    middle, width = (low + high) / 2, high - low
    n = len(u)
    i = (_RANDOM[0] * n).astype(np.intp)
    # Centroids are ordered along u: a partner within a third of them is likely on the same band.
    j = np.minimum(i + 1 + (_RANDOM[1] * max(2.0, n / 3)).astype(np.intp), n - 1)
    du = u[j] - u[i]
    with np.errstate(divide="ignore", invalid="ignore"):
        b = (middle[j] - middle[i]) / du
        width_b = (width[j] - width[i]) / du
    good = (
        (du >= 3 * cuts.spacing_px)
        & (np.abs(b) <= MAX_SLOPE)
        & (np.abs(width[j] - width[i]) <= 0.25 * (width[j] + width[i]) + 2 * step)
    )
    if not good.any():
        return []
    i, b, width_b = i[good], b[good], width_b[good]
    a, width_a = middle[i] - b * u[i], width[i] - width_b * u[i]
    expected_width = width_a[:, None] + width_b[:, None] * u
    tolerance = step + 0.08 * expected_width
    inlier = (np.abs(middle - a[:, None] - b[:, None] * u) <= tolerance) & (
        np.abs(width - expected_width) <= 2 * step + 0.25 * expected_width
    )
    strips: list[Strip] = []
    free = np.ones(n, np.bool_)
    scores = inlier.sum(axis=1)
    while True:
        best = int(scores.argmax())
        if scores[best] < 4:
            break
        members = np.flatnonzero(inlier[best] & free)
        strip = _fit_band(u, low, high, members, step, cuts.spacing_px, steep=steep)
        taken = inlier[best] & free
        if strip is not None:
            strips.append(strip)
            reach = step + 0.15 * (strip.high.at(0.0) - strip.low.at(0.0))
            taken |= np.abs(middle - strip.centre.a - strip.centre.b * u) <= reach
        free &= ~taken
        scores = inlier @ free.astype(np.int32)
    return strips


def _fit_band(
    u: Array, low: Array, high: Array, members: Indices, step: int, spacing_px: float, *, steep: bool
) -> Strip | None:
    """Straight edges through the members' ends; None when they are too few or too short for a line."""
    for _ in range(2):
        if len(members) < 4:
            return None
        low_fit = fit_line(u[members], low[members], step / math.sqrt(12))
        high_fit = fit_line(u[members], high[members], step / math.sqrt(12))
        centre = bisector(low_fit, high_fit)
        # Once more through all cuts that agree with both edges.
        off_low = np.abs(low - low_fit.a - low_fit.b * u)
        off_high = np.abs(high - high_fit.a - high_fit.b * u)
        width = high_fit.at(0.0) - low_fit.at(0.0)
        limit = 1.2 * step + 0.05 * abs(width)
        members = np.flatnonzero((off_low <= limit) & (off_high <= limit))
    if len(members) < 4:
        return None
    ends = u[members]
    u0, u1 = float(ends.min()), float(ends.max())
    slabs = max(1.0, (u1 - u0) / spacing_px + 1)
    strip = Strip(
        steep, centre, low_fit, high_fit, u0 - spacing_px / 2, u1 + spacing_px / 2, len(members) / slabs
    )
    if abs(centre.b) > MAX_SLOPE or strip.width_px <= 0:
        return None
    return strip


def fit_line(u: Array, v: Array, sigma: float, weight: Array | None = None) -> LinearFit:
    """Least squares v = a + b u, each v good to at least `sigma`; the covariance follows the scatter."""
    w = np.ones_like(u) if weight is None else weight
    sw = float(w.sum())
    mean_u, mean_v = float(w @ u) / sw, float(w @ v) / sw
    du, dv = u - mean_u, v - mean_v
    suu = float(w @ (du * du))
    b = float(w @ (du * dv)) / suu if suu > 0 else 0.0
    scatter = dv - b * du
    variance = max(sigma * sigma, float(w @ (scatter * scatter)) / max(1.0, sw - 2))
    var_b = variance / suu if suu > 0 else variance
    return LinearFit(mean_v - b * mean_u, b, variance / sw + mean_u * mean_u * var_b, var_b, -mean_u * var_b)
