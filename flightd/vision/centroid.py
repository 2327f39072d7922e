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
from flightd.vision.fit import fit_lines, is_bent
from flightd.vision.plane import Plane
from flightd.vision.sampling import Grid
from flightd.vision.strip import Array, Strip, bisector

TRIALS = 72
MAX_SLOPE = 1.25
"""dv/du of a band described along its own axis; a little beyond the diagonal so that none falls between."""

_MIN_CUTS = 5
_ROUNDS = 2
"""Draws go to long bands first; what they leave over is drawn from once more, for the short ones."""
_NEAR_SLABS, _FAR_SLABS = (3, 6), (14, 30)
_SLAB_KEY = 1e6

_RANDOM = np.random.default_rng(20190909).random((3, TRIALS))
"""The same draws for every frame: one frame, one answer."""


@dataclass(frozen=True, slots=True)
class Cuts:
    """Where slabs cut bands: slab number, its position `u`, edges `low` < `high`, centred frame pixels.

    `whole` is False where the picture's border cuts the band off.
    """

    slab: NDArray[np.intp]
    u: Array
    low: Array
    high: Array
    whole: NDArray[np.bool_]
    spacing_px: float


def slab_spacing(coverage: float) -> int:
    """Samples between slabs: little paint (thin or far lines) needs many slabs, much paint few."""
    return 2 if coverage < 0.06 else 3 if coverage < 0.2 else 4


def cut(mask: Image, grid: Grid, *, steep: bool, spacing: int) -> Cuts:
    """Cut the 0/255 mask by every `spacing`-th row (for steep bands) or column (for shallow ones)."""
    first = spacing // 2
    slabs = mask[first::spacing] if steep else cv2.transpose(mask)[first::spacing]
    rows, length = slabs.shape
    padded = np.zeros((rows, length + 2), np.uint8)
    padded[:, 1:-1] = slabs
    flat = padded.ravel()
    changes = np.flatnonzero(flat[1:] != flat[:-1])
    row, place = np.divmod(changes, length + 2)
    slab, start, end = row[0::2], place[0::2], place[1::2]
    along, across = (grid.y, grid.x) if steep else (grid.x, grid.y)
    return Cuts(
        slab=slab,
        u=along(slab * spacing + first),
        low=across(start - 0.5),
        high=across(end - 0.5),
        whole=(start > 0) & (end < length),
        spacing_px=float(spacing * grid.step),
    )


def find(mask: Image, grid: Grid, plane: Plane) -> list[Strip]:
    """Straight bands in the mask, each described along its own axis."""
    spacing = slab_spacing(cv2.countNonZero(mask) / mask.size)
    strips: list[Strip] = []
    for steep in (True, False):
        cuts = cut(mask, grid, steep=steep, spacing=spacing)
        strips += _bands(_straightened(cuts, plane, steep=steep), grid.step, strips, steep=steep)
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
    return Cuts(cuts.slab, (u_low + u_high) / 2, low, high, cuts.whole, cuts.spacing_px)


def _bands(cuts: Cuts, step: int, known: list[Strip], *, steep: bool) -> list[Strip]:
    """The bands through the cuts, except those of the `known` bands, which run the other way."""
    usable = cuts.whole.copy()
    if known:
        centre = (cuts.low + cuts.high) / 2
        for other in known:
            away = np.abs(cuts.u - other.centre.a - other.centre.b * centre)
            usable &= away > max(step, 0.15 * other.width_px / other.cosine)
    strips: list[Strip] = []
    for _ in range(_ROUNDS):
        left = np.flatnonzero(usable)
        if len(left) < _MIN_CUTS:
            break
        found, free = _ransac(cuts, left, step, steep=steep)
        strips += found
        usable[left[~free]] = False
        if not found:
            break
    return strips


def _ransac(
    cuts: Cuts, chosen: NDArray[np.intp], step: int, *, steep: bool
) -> tuple[list[Strip], NDArray[np.bool_]]:
    """Sequential RANSAC: one matrix of hypotheses against centroids serves all bands of a direction.

    Returns the bands and which of the chosen cuts belong to none.
    """
    slab, u, low, high = cuts.slab[chosen], cuts.u[chosen], cuts.low[chosen], cuts.high[chosen]
    middle, width = (low + high) / 2, high - low
    strips: list[Strip] = []
    free = np.ones(len(u), np.bool_)
    i, j = _pairs(slab, u, middle)
    b = (middle[j] - middle[i]) / (u[j] - u[i])
    width_b = (width[j] - width[i]) / (u[j] - u[i])
    good = (np.abs(b) <= MAX_SLOPE) & (np.abs(width[j] - width[i]) <= 0.25 * (width[j] + width[i]) + 2 * step)
    if not good.any():
        return strips, free
    i, b, width_b = i[good], b[good], width_b[good]
    du = (u - u[i][:, None]).astype(np.float32)
    off = np.abs((middle - middle[i][:, None]).astype(np.float32) - b.astype(np.float32)[:, None] * du)
    expected = width.astype(np.float32)[i][:, None] + width_b.astype(np.float32)[:, None] * du
    inlier = off <= step + 0.08 * expected
    inlier &= np.abs(width.astype(np.float32) - expected) <= 2 * step + 0.25 * expected
    votes = inlier.astype(np.float32)
    scores = votes.sum(axis=1)
    while scores[best := int(scores.argmax())] >= _MIN_CUTS:
        taken = inlier[best] & free
        strip = _fit_band(u, low, high, np.flatnonzero(taken), step, cuts.spacing_px, steep=steep)
        if strip is not None:
            strips.append(strip)
            reach = step + 0.15 * (strip.high.at(0.0) - strip.low.at(0.0))
            taken |= np.abs(middle - strip.centre.a - strip.centre.b * u) <= reach
        free &= ~taken
        scores = votes @ free.astype(np.float32)
    return strips, free


def _pairs(slab: NDArray[np.intp], u: Array, middle: Array) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Random centroids, each with a partner far along the band it seems to belong to.

    A nearby slab gives the local slope, which says where to look in a slab further on: nearly every pair
    lies on one band, where blind pairs on k bands would agree once in k.
    """
    n = len(u)
    i = (_RANDOM[0] * n).astype(np.intp) if n > TRIALS else np.arange(n)
    draws = _RANDOM[:, : len(i)]
    key = slab * _SLAB_KEY + middle
    ahead = np.where(slab[i] - slab[0] < (slab[-1] - slab[0]) / 2, 1, -1)
    near = ahead * np.rint(_NEAR_SLABS[0] + draws[1] * (_NEAR_SLABS[1] - _NEAR_SLABS[0])).astype(np.intp)
    j, same = _nearest(key, slab, middle, slab[i] + near, middle[i])
    i, ahead, j, draw = i[same], ahead[same], j[same], draws[2][same]
    slope = (middle[j] - middle[i]) / (slab[j] - slab[i])
    far = ahead * np.rint(_FAR_SLABS[0] + draw * (_FAR_SLABS[1] - _FAR_SLABS[0])).astype(np.intp)
    k, same = _nearest(key, slab, middle, slab[i] + far, middle[i] + slope * far)
    return i, np.where(same, k, j)


def _nearest(
    key: Array, slab: NDArray[np.intp], middle: Array, wanted_slab: NDArray[np.intp], wanted: Array
) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
    """Index of the centroid nearest to `wanted` in `wanted_slab`, and whether that slab has one."""
    at = np.searchsorted(key, wanted_slab * _SLAB_KEY + wanted)
    after, before = np.minimum(at, len(key) - 1), np.maximum(at - 1, 0)
    after_ok, before_ok = slab[after] == wanted_slab, slab[before] == wanted_slab
    nearer = np.abs(middle[after] - wanted) < np.abs(middle[before] - wanted)
    use_after = after_ok & (nearer | ~before_ok)
    return np.where(use_after, after, before), after_ok | before_ok


def _fit_band(
    u: Array, low: Array, high: Array, members: NDArray[np.intp], step: int, spacing_px: float, *, steep: bool
) -> Strip | None:
    """Straight edges through the members' ends; None when they are too few, too short, or bent."""
    noise = step / math.sqrt(12)
    for _ in range(2):
        if len(members) < _MIN_CUTS:
            return None
        low_fit, high_fit = fit_lines(u[members], (low[members], high[members]), noise)
        # Once more through all cuts that agree with both edges.
        off_low = np.abs(low - low_fit.a - low_fit.b * u)
        off_high = np.abs(high - high_fit.a - high_fit.b * u)
        limit = 1.2 * step + 0.05 * abs(high_fit.at(0.0) - low_fit.at(0.0))
        members = np.flatnonzero((off_low <= limit) & (off_high <= limit))
    if len(members) < _MIN_CUTS:
        return None
    centre = bisector(low_fit, high_fit)
    inside = u[members]
    if abs(centre.b) > MAX_SLOPE:
        return None
    reach = 0.3 * (float(inside.max()) - float(inside.min()))
    middle = (low + high) / 2
    around = np.abs(middle - centre.a - centre.b * u) <= limit + 2 * step
    around &= (u >= inside.min() - reach) & (u <= inside.max() + reach)
    if is_bent((inside, middle[members]), (u[around], middle[around]), noise):
        return None
    u0, u1 = float(inside.min()), float(inside.max())
    slabs = max(1.0, (u1 - u0) / spacing_px + 1)
    strip = Strip(
        steep, centre, low_fit, high_fit, u0 - spacing_px / 2, u1 + spacing_px / 2, len(members) / slabs
    )
    return strip if strip.width_px > 0 else None
