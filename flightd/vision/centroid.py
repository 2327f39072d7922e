"""Centroid method: thin slabs, the centroid of every band in each slab, RANSAC through the centroids.

The paper cuts the picture into W x H slices whose number follows the lines' coverage, and takes the
centroid of the largest contour of each.  Here a slice is a slab one sample thick across the whole
picture, and every band in it gives a centroid: in the thin limit the centroid of a straight band's cut is
exactly on its centre line whatever its slope, and parallel lines and crossings do not compete for slices.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from flightd.core.types import Image
from flightd.vision.fit import fit_rows, is_bent
from flightd.vision.plane import Plane, shortest_length
from flightd.vision.sampling import Grid
from flightd.vision.strip import Array, LinearFit, Strip, bisector

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


def slab_spacing(coverage: float) -> int:
    """Samples between slabs: little paint (thin or far lines) needs many slabs, much paint few."""
    return 2 if coverage < 0.06 else 3 if coverage < 0.2 else 4


def find(mask: Image, grid: Grid, plane: Plane) -> list[Strip]:
    """Straight bands in the 0/255 mask, each described along its own axis."""
    spacing = slab_spacing(cv2.countNonZero(mask) / mask.size)
    cuts = _cut(mask, grid, plane, spacing)
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


@dataclass(frozen=True, slots=True)
class _Slabs:
    """Every `spacing`-th row (for steep bands), then every `spacing`-th column of a mask, one after another
    in one flat buffer of `size` samples with an unpainted one between any two.

    One entry for each slab: where its `first` sample begins and its `last` one ends in the buffer, its
    `number`, its position `u`, and what to take off step times a place in the buffer to get an edge's v.
    """

    rows: int
    columns_at: int
    size: int
    first: NDArray[np.intp]
    last: NDArray[np.intp]
    number: NDArray[np.intp]
    u: Array
    shift: Array


@lru_cache(maxsize=16)
def _slabs(grid: Grid, height: int, width: int, spacing: int) -> _Slabs:
    y, x = (np.arange(spacing // 2, side, spacing) for side in (height, width))
    length = np.repeat((width, height), (len(y), len(x)))
    ends = np.cumsum(length + 1)
    first = ends - length - 1
    origin = np.repeat((float(grid.x(0)), float(grid.y(0))), (len(y), len(x)))
    return _Slabs(
        rows=len(y),
        columns_at=len(y) * (width + 1) + 1,
        size=int(ends[-1]) + 1,
        first=first,
        last=ends - 1,
        number=np.concatenate((np.arange(len(y)), np.arange(len(x)) + _SLABS_APART)),
        u=np.concatenate((grid.y(y), grid.x(x))),
        shift=grid.step * (first + 0.5) - origin,
    )


@dataclass(frozen=True, slots=True)
class _Cuts:
    """Where slabs cut bands: by rows (steep bands, the first `split`) and by columns (shallow ones).

    `points` is (4, N): one, the slab's position u, and the band's edges, low and high, in centred frame
    pixels.  The columns' slabs are numbered far beyond the rows', and their `middle`s lie far beyond, too:
    so no hypothesis in one direction finds a cut of the other near.  `ahead` is the way, along u, on
    which more slabs lie.  A cut is no other band's once it is not `free`.
    """

    slab: NDArray[np.intp]
    ahead: NDArray[np.intp]
    middle: Array
    points: Array
    free: NDArray[np.bool_]
    split: int
    spacing_px: float
    step: int

    def side(self, *, steep: bool) -> slice:
        return slice(0, self.split) if steep else slice(self.split, None)

    def take(self, strip: Strip) -> None:
        """The cuts of a band that was found are no other's, in neither direction."""
        a, b = strip.centre.a, strip.centre.b
        reach = 0.15 * strip.width_px / strip.cosine
        # v - (a + b u) of the cuts' middles; in the other direction u and v change their parts.
        along, across = (-a, -b, 0.5, 0.5), (-a, 1.0, -0.5 * b, -0.5 * b)
        for steep, law, limit in (
            (strip.steep, along, self.step + reach),
            (not strip.steep, across, max(self.step, reach)),
        ):
            side = self.side(steep=steep)
            self.free[side] &= np.abs(np.array(law) @ self.points[:, side]) > limit


def _cut(mask: Image, grid: Grid, plane: Plane, spacing: int) -> _Cuts:
    """Cut the mask's bands, but for those that the picture's border cuts off."""
    height, width = mask.shape
    slabs = _slabs(grid, height, width, spacing)
    flat = np.zeros(slabs.size, np.uint8)
    at, first = slabs.columns_at, spacing // 2
    flat[1:at].reshape(-1, width + 1)[:, :-1] = mask[first::spacing]
    flat[at:].reshape(-1, height + 1)[:, :-1] = cv2.transpose(mask)[first::spacing]
    changes = np.flatnonzero(flat[1:] != flat[:-1]).reshape(-1, 2)
    slab = slabs.first.searchsorted(changes[:, 0], "right") - 1
    whole = (changes[:, 0] > slabs.first.take(slab)) & (changes[:, 1] < slabs.last.take(slab))
    slab, edges = slab[whole], changes[whole]
    split = int(slab.searchsorted(slabs.rows))
    points = np.empty((4, len(slab)))
    points[0] = 1.0
    points[1] = slabs.u.take(slab)
    points[2:] = edges.T * grid.step - slabs.shift.take(slab)
    if not plane.is_identity:
        _straighten(points, split, plane)
    middle = 0.5 * (points[2] + points[3])
    middle[split:] += _APART_PX
    ahead = np.ones(len(slab), np.intp)
    for side in (slice(0, split), slice(split, None)):
        there = slab[side]
        if len(there):
            ahead[side][2 * there >= there[0] + there[-1]] = -1
    free = np.ones(len(slab), np.bool_)
    return _Cuts(
        slabs.number.take(slab), ahead, middle, points, free, split, float(spacing * grid.step), grid.step
    )


def _straighten(points: Array, split: int, plane: Plane) -> None:
    """Take the lens's distortion out of the (4, N) points in place."""
    steep = np.arange(points.shape[1]) < split
    u, edges = points[1], points[2:]
    x, y = plane.ideal(np.where(steep, edges, u), np.where(steep, u, edges))
    points[1] = np.where(steep, y, x).mean(axis=0)
    points[2:] = np.where(steep, x, y)


def _ransac(cuts: _Cuts, chosen: NDArray[np.intp], fewest: int) -> list[Strip]:
    """Sequential RANSAC: one matrix of hypotheses against centroids serves all bands of both directions,
    down to those with the `fewest` votes.

    Takes the cuts of the bands it finds off the free ones, and those that made no band after all.
    """
    strips: list[Strip] = []
    step = cuts.step
    _, u, low, high = cuts.points.take(chosen, axis=1)
    middle, width = cuts.middle[chosen], high - low
    i, j = _pairs(cuts.slab[chosen], cuts.ahead[chosen], middle)
    du, change = u[j] - u[i], width[j] - width[i]
    b, width_b = (middle[j] - middle[i]) / du, change / du
    good = (np.abs(b) <= MAX_SLOPE) & (np.abs(change) <= 0.25 * (width[j] + width[i]) + 2 * step)
    i, b, width_b = i[good], b[good], width_b[good]
    if not len(i):
        return strips
    # How far each cut is off each hypothesis, v - (v_i + b (u - u_i)), in one product; likewise the width.
    known = np.stack((np.ones_like(u), u, middle)).astype(np.float32)
    laws = np.empty((2, len(i), 3), np.float32)
    laws[0, :, 0], laws[0, :, 1], laws[0, :, 2] = b * u[i] - middle[i], -b, 1.0
    laws[1, :, 0], laws[1, :, 1], laws[1, :, 2] = width[i] - width_b * u[i], width_b, 0.0
    off, expected = laws @ known
    votes = np.abs(off, out=off) <= step + 0.08 * expected
    votes &= np.abs(expected - width.astype(np.float32)) <= 2 * step + 0.25 * expected
    inlier = votes.astype(np.float32)
    scores = inlier @ np.ones(len(u), np.float32)
    while scores[best := int(scores.argmax())] >= fewest:
        taken = chosen[votes[best] & cuts.free[chosen]]
        strip = _fit_band(cuts, taken, steep=bool(chosen[i[best]] < cuts.split))
        if strip is not None:
            strips.append(strip)
            cuts.take(strip)
        cuts.free[taken] = False
        scores = inlier @ cuts.free[chosen].astype(np.float32)
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


def _fit_band(cuts: _Cuts, members: NDArray[np.intp], *, steep: bool) -> Strip | None:
    """Straight edges through the members' ends; None when they are too few, too short, or bent."""
    step, spacing_px = cuts.step, cuts.spacing_px
    noise = step / math.sqrt(12)
    side = cuts.points[:, cuts.side(steep=steep)]
    inside = cuts.points.take(members, axis=1)
    for _ in range(2):
        if inside.shape[1] < _MIN_CUTS:
            return None
        low_fit, high_fit = fit_rows(inside, noise)
        # Once more through all cuts that agree with both edges.
        limit = 1.2 * step + 0.05 * abs(high_fit.at(0.0) - low_fit.at(0.0))
        away = _off(low_fit, high_fit) @ side
        off = np.abs(away)
        inside = side.compress((off[0] <= limit) & (off[1] <= limit), axis=1)
    count = inside.shape[1]
    centre = bisector(low_fit, high_fit)
    if count < _MIN_CUTS or abs(centre.b) > MAX_SLOPE:
        return None
    u0, u1 = float(inside[1, 0]), float(inside[1, -1])
    reach = 0.3 * (u1 - u0)
    u = side[1]
    around = np.abs(away[0] + away[1]) <= 2 * (limit + 2 * step)
    around &= (u >= u0 - reach) & (u <= u1 + reach)
    if is_bent(_middles(inside), _middles(side.compress(around, axis=1)), noise):
        return None
    slabs = max(1.0, (u1 - u0) / spacing_px + 1)
    strip = Strip(steep, centre, low_fit, high_fit, u0 - spacing_px / 2, u1 + spacing_px / 2, count / slabs)
    return strip if strip.width_px > 0 else None


def _off(low: LinearFit, high: LinearFit) -> Array:
    """(2, 4): what makes of a cut's points how far its edges are off these."""
    return np.array(((-low.a, -low.b, 1.0, 0.0), (-high.a, -high.b, 0.0, 1.0)))


def _middles(points: Array) -> tuple[Array, Array]:
    return points[1], 0.5 * (points[2] + points[3])
