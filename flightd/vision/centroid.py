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
from flightd.vision.fit import fit_rows, is_bent
from flightd.vision.plane import Plane, shortest_length
from flightd.vision.sampling import Grid
from flightd.vision.strip import Array, Strip, bisector

TRIALS = 80
MAX_SLOPE = 1.25
"""dv/du of a band described along its own axis; a little beyond the diagonal so that none falls between."""

_MIN_CUTS = 5
_ROUNDS = 2
"""Draws go to long bands first; what they leave over is drawn from once more, for the short ones."""
_WORTH_A_FIT = 0.6
"""A band is fitted when so great a part of the slabs that the shortest band crosses vote for it."""
_SLAB_KEY, _SLABS_APART, _APART_PX = 1e6, 1 << 20, 1 << 17

_DRAWS = np.random.default_rng(20190909)
"""The same draws for every frame: one frame, one answer."""
_RANDOM = _DRAWS.random(TRIALS)
_NEAR, _FAR = _DRAWS.integers(3, 6, TRIALS, endpoint=True), _DRAWS.integers(14, 30, TRIALS, endpoint=True)
"""Slabs from a centroid to those that give its local slope and its partner."""


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
    rows = _straightened(cut(mask, grid, steep=True, spacing=spacing), plane, steep=True)
    columns = _straightened(cut(mask, grid, steep=False, spacing=spacing), plane, steep=False)
    cuts = _Both.of(rows, columns, grid.step)
    strips: list[Strip] = []
    # A diagonal band crosses fewest slabs for its length.
    crossed = shortest_length(plane) * math.sqrt(0.5) / cuts.spacing_px
    fewest = max(_MIN_CUTS, math.ceil(_WORTH_A_FIT * crossed))
    for _ in range(_ROUNDS):
        left = np.flatnonzero(cuts.free)
        if len(left) < fewest or not (found := _ransac(cuts, left, fewest)):
            break
        strips += found
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


@dataclass(frozen=True, slots=True)
class _Both:
    """The cuts by rows (steep bands, the first `split`) and by columns (shallow ones) in one list.

    The columns' slabs are numbered far beyond the rows', and their centroids lie `apart` pixels beyond:
    so no hypothesis in one direction finds a cut of the other near.  `ahead` is the way, along u, on
    which more slabs lie.
    """

    slab: NDArray[np.intp]
    ahead: NDArray[np.intp]
    middle: Array
    points: Array
    free: NDArray[np.bool_]
    split: int
    spacing_px: float
    step: int

    @staticmethod
    def of(rows: Cuts, columns: Cuts, step: int) -> _Both:
        parts = []
        for number, cuts in enumerate((rows, columns)):
            w = cuts.whole
            slab = cuts.slab[w]
            points = np.stack((cuts.u, cuts.low, cuts.high)).compress(w, axis=1)
            centre = (slab[0] + slab[-1]) / 2 if len(slab) else 0.0
            parts.append((slab + number * _SLABS_APART, np.where(slab < centre, 1, -1), points))
        slab, ahead = (np.concatenate((parts[0][k], parts[1][k])) for k in (0, 1))
        split, n = len(parts[0][0]), len(slab)
        points = np.empty((4, n))
        points[0] = 1.0
        points[1:, :split], points[1:, split:] = parts[0][2], parts[1][2]
        middle = (points[2] + points[3]) / 2
        middle[split:] += _APART_PX
        return _Both(slab, ahead, middle, points, np.ones(n, np.bool_), split, rows.spacing_px, step)

    def side(self, *, steep: bool) -> slice:
        return slice(0, self.split) if steep else slice(self.split, None)

    def take(self, strip: Strip) -> None:
        """The cuts of a band that was found are no other's, in neither direction."""
        b, step, width = strip.centre.b, self.step, strip.width_px / strip.cosine
        for steep in (True, False):
            side = self.side(steep=steep)
            u, middle = self.points[1, side], self.middle[side]
            if not steep:
                middle = middle - _APART_PX
            if steep == strip.steep:
                away, reach = middle - strip.centre.a - b * u, step + 0.15 * width
            else:
                away, reach = u - strip.centre.a - b * middle, max(step, 0.15 * width)
            self.free[side] &= np.abs(away) > reach


def _ransac(cuts: _Both, chosen: NDArray[np.intp], fewest: int) -> list[Strip]:
    """Sequential RANSAC: one matrix of hypotheses against centroids serves all bands of both directions,
    down to those with the `fewest` votes.

    Takes the cuts of the bands it finds off the free ones, and those that made no band after all.
    """
    strips: list[Strip] = []
    step = cuts.step
    u, low, high = cuts.points[1:].take(chosen, axis=1)
    middle, width = cuts.middle[chosen], (high - low).astype(np.float32)
    i, j = _pairs(cuts.slab[chosen], cuts.ahead[chosen], middle)
    du = u[j] - u[i]
    b, width_b = (middle[j] - middle[i]) / du, (width[j] - width[i]) / du
    good = (np.abs(b) <= MAX_SLOPE) & (np.abs(width[j] - width[i]) <= 0.25 * (width[j] + width[i]) + 2 * step)
    i, b, width_b = i[good], b[good], width_b[good]
    if not len(i):
        return strips
    # off = v - (v_i + b (u - u_i)) for all hypotheses and cuts in one product each; likewise the widths.
    ones = np.ones_like(u)
    known = np.stack((u, ones))
    expected = (np.stack((width_b, width[i] - width_b * u[i]), axis=1) @ known).astype(np.float32)
    off = (middle - np.stack((b, middle[i] - b * u[i]), axis=1) @ known).astype(np.float32)
    inlier = np.abs(off) <= step + 0.08 * expected
    inlier &= np.abs(width - expected) <= 2 * step + 0.25 * expected
    votes = inlier.astype(np.float32)
    free = np.ones(len(u), np.bool_)
    scores = votes.sum(axis=1)
    while scores[best := int(scores.argmax())] >= fewest:
        taken = inlier[best] & free
        strip = _fit_band(cuts, chosen[taken], steep=bool(chosen[i[best]] < cuts.split))
        if strip is not None:
            strips.append(strip)
            cuts.take(strip)
        cuts.free[chosen[taken]] = False
        free = cuts.free[chosen]
        scores = votes @ free.astype(np.float32)
    return strips


def _pairs(
    slab: NDArray[np.intp], ahead: NDArray[np.intp], middle: Array
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Random centroids, each with a partner far along the band it seems to belong to.

    A nearby slab gives the local slope, which says where to look in a slab further on: nearly every pair
    lies on one band, where blind pairs on k bands would agree once in k.
    """
    n = len(slab)
    i = (_RANDOM * n).astype(np.intp) if n > TRIALS else np.arange(n)
    key = slab * _SLAB_KEY + middle
    here, ahead = middle[i], ahead[i]
    near, far = ahead * _NEAR[: len(i)], ahead * _FAR[: len(i)]
    j, same = _nearest(key, slab, middle, slab[i] + near, here)
    i, j, far = i[same], j[same], far[same]
    slope = (middle[j] - middle[i]) / (slab[j] - slab[i])
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


def _fit_band(cuts: _Both, members: NDArray[np.intp], *, steep: bool) -> Strip | None:
    """Straight edges through the members' ends; None when they are too few, too short, or bent."""
    step, spacing_px = cuts.step, cuts.spacing_px
    noise = step / math.sqrt(12)
    side = cuts.points[:, cuts.side(steep=steep)]
    _, u, low, high = side
    inside = cuts.points.take(members, axis=1)
    for _ in range(2):
        if inside.shape[1] < _MIN_CUTS:
            return None
        low_fit, high_fit = fit_rows(inside, noise)
        # Once more through all cuts that agree with both edges.
        limit = 1.2 * step + 0.05 * abs(high_fit.at(0.0) - low_fit.at(0.0))
        agree = np.abs(low - low_fit.a - low_fit.b * u) <= limit
        agree &= np.abs(high - high_fit.a - high_fit.b * u) <= limit
        inside = side.compress(agree, axis=1)
    count = inside.shape[1]
    centre = bisector(low_fit, high_fit)
    if count < _MIN_CUTS or abs(centre.b) > MAX_SLOPE:
        return None
    u0, u1 = float(inside[1, 0]), float(inside[1, -1])
    reach = 0.3 * (u1 - u0)
    middle = (low + high) / 2
    around = np.abs(middle - centre.a - centre.b * u) <= limit + 2 * step
    around &= (u >= u0 - reach) & (u <= u1 + reach)
    core = inside[1], (inside[2] + inside[3]) / 2
    if is_bent(core, (u[around], middle[around]), noise):
        return None
    slabs = max(1.0, (u1 - u0) / spacing_px + 1)
    strip = Strip(steep, centre, low_fit, high_fit, u0 - spacing_px / 2, u1 + spacing_px / 2, count / slabs)
    return strip if strip.width_px > 0 else None
