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
from flightd.vision.lines.band import Array, Band, bisector
from flightd.vision.lines.line_fit import BEYOND, Moments, fit, is_bent, law, moments
from flightd.vision.lines.sampling import Grid
from flightd.vision.lines.undistortion import NOWHERE_PX, Plane, shortest_length

TRIALS, _MOST_TRIALS = 64, 192
_CUTS_PER_TRIAL, _MOST_LOOKS = 4, 150_000
"""Draws follow the number of cuts, for the short bands among much clutter; but no more than so many looks, of
each draw at each cut."""
MAX_SLOPE = 1.25
"""dv/du of a band described along its own axis; a little beyond the diagonal so that none falls between."""

_PASS_OF_WIDTH, _PASS_WIDTH = 0.08, 0.25
"""A cut votes for a band when its middle is off by no more than a sample and the first part of the width that
is expected there, and its width by no more than two samples and the second part."""
_MIN_CUTS = 5
_WORTH_A_FIT = 0.6
"""A band is fitted when so great a part of the slabs that the shortest band crosses vote for it."""
_SPARSEST = 4
"""What others have left is a band where it shows in one of so many slabs, over the length of the shortest."""
_SLAB_KEY, _SLABS_APART, _APART_PX = 1e6, 1 << 20, 1 << 17

_LOW, _HIGH, _MIDDLE = 3, 4, 5
"""Rows of a cut's points that hold the band's edges and the middle between them."""

_DRAWS = np.random.default_rng(20190909)
"""The same draws for every frame: one frame, one answer."""
_SPREAD = np.arange(_MOST_TRIALS) + _DRAWS.random(_MOST_TRIALS)
"""Evenly over all cuts, so that a band has draws as its length demands."""
_NEAR = _DRAWS.integers(3, 6, _MOST_TRIALS, endpoint=True)
_FAR = _DRAWS.integers(14, 30, _MOST_TRIALS, endpoint=True)
"""Slabs from a centroid to those that give its local slope and its partner."""


def slab_spacing(coverage: float) -> int:
    """Samples between slabs: little paint (thin or far lines) needs many slabs, much paint few."""
    return 2 if coverage < 0.03 else 3 if coverage < 0.12 else 4


def find(mask: Image, grid: Grid, plane: Plane) -> list[Band]:
    """Straight bands in the 0/255 mask, each described along its own axis."""
    spacing = slab_spacing(cv2.countNonZero(mask) / mask.size)
    cuts = _cut(mask, grid, plane, spacing)
    strips: list[Band] = []
    # A diagonal band crosses fewest slabs for its length.
    crossed = shortest_length(plane) * math.sqrt(0.5) / cuts.spacing_px
    fewest = max(_MIN_CUTS, math.ceil(_WORTH_A_FIT * crossed))
    while cuts.may_hold(fewest):
        found = _ransac(cuts, fewest)
        # Draws go to long bands first; what they leave over is drawn from once more, for the short ones: but
        # not where nothing is straight, or every second cut has had its draw.
        if strips or not found or len(cuts.free) <= 2 * TRIALS:
            return strips + found
        strips, cuts = found, cuts.left()
    return strips


@dataclass(frozen=True, slots=True)
class _Slabs:
    """Every `spacing`-th row (for steep bands), then every `spacing`-th column of a mask, one after another
    in one flat buffer of `size` samples with an unpainted one between any two.

    `first` is where each slab begins in the buffer.  `about` (6, slabs) holds the same, where its last
    sample ends, its position u, what to take off step times a place in the buffer to get an edge's v,
    its number, and the way along u, 1 or -1, on which more slabs lie.
    """

    columns_at: int
    size: int
    first: NDArray[np.intp]
    about: Array


@lru_cache(maxsize=16)
def _slabs(grid: Grid, height: int, width: int, spacing: int) -> _Slabs:
    y, x = (np.arange(spacing // 2, side, spacing) for side in (height, width))
    length = np.repeat((width, height), (len(y), len(x)))
    ends = np.cumsum(length + 1)
    first = ends - length - 1
    origin = np.repeat((float(grid.x(0)), float(grid.y(0))), (len(y), len(x)))
    u = np.concatenate((grid.y(y), grid.x(x)))
    number = np.concatenate((np.arange(len(y)), np.arange(len(x)) + _SLABS_APART))
    return _Slabs(
        columns_at=len(y) * (width + 1) + 1,
        size=int(ends[-1]) + 1,
        first=first,
        about=np.array(
            (first, ends - 1, u, grid.step * (first + 0.5) - origin, number, np.where(u < 0, 1, -1))
        ),
    )


@dataclass(frozen=True, slots=True)
class _Cuts:
    """Where slabs cut bands: by rows (steep bands, the first `split`) and by columns (shallow ones).

    `points` is (6, N): one, the slab's position u, its square, the band's edges, low and high, and the
    middle between them, in centred frame pixels; `known` (4, N) is one, u, the middle and the width.  The
    columns' slabs are numbered far beyond the rows', and their known middles lie far beyond, too: so no
    hypothesis in one direction finds a cut of the other near.  `key` (N + 2) orders them by slab and
    then by place, the slabs far apart, infinity at both ends.  `ahead` is the way, along u, on which more
    slabs lie.  A cut is no other band's once it is not `free`.  `sides` are the points of all cuts by
    columns and by rows, also of those that are left out here.
    """

    key: Array
    ahead: Array
    points: Array
    known: NDArray[np.float32]
    free: NDArray[np.bool_]
    sides: tuple[Array, Array]
    split: int
    spacing_px: float
    step: int

    def take(self, strip: Band) -> None:
        """The cuts of a band that was found are no other's, in neither direction."""
        a, b = strip.centre.a, strip.centre.b
        reach = 0.15 * strip.width_px / strip.cosine
        # v - (a + b u) of the cuts' middles in units of what still belongs to the band; in the other
        # direction u and v change their parts.
        along, across = 1 / (self.step + reach), 1 / max(self.step, reach)
        laws = (
            (-a * along, -b * along, 0.0, 0.0, 0.0, along),
            (-a * across, across, 0.0, 0.0, 0.0, -b * across),
        )
        off = np.abs(np.array(laws) @ self.points) > 1.0
        own, other = off if strip.steep else off[::-1]
        self.free[: self.split] &= own[: self.split]
        self.free[self.split :] &= other[self.split :]

    def may_hold(self, fewest: int) -> bool:
        """Whether so many cuts of one direction lie near enough to each other to be one band's."""
        within = _SPARSEST * fewest * self.spacing_px
        for u in (self.points[1, : self.split], self.points[1, self.split :]):
            if len(u) >= fewest and (u[fewest - 1 :] - u[: len(u) - fewest + 1]).min() < within:
                return True
        return False

    def left(self) -> _Cuts:
        """Only those that are still free."""
        free = self.free
        return _Cuts(
            self.key[np.concatenate(((True,), free, (True,)))],
            self.ahead[free],
            self.points.compress(free, axis=1),
            self.known.compress(free, axis=1),
            free[free],
            self.sides,
            int(np.count_nonzero(free[: self.split])),
            self.spacing_px,
            self.step,
        )


def _cut(mask: Image, grid: Grid, plane: Plane, spacing: int) -> _Cuts:
    """Cut the mask's bands, but for those that the picture's border cuts off."""
    height, width = mask.shape
    slabs = _slabs(grid, height, width, spacing)
    flat = np.zeros(slabs.size, np.uint8)
    at, first = slabs.columns_at, spacing // 2
    flat[1:at].reshape(-1, width + 1)[:, :-1] = mask[first::spacing]
    flat[at:].reshape(-1, height + 1)[:, :-1] = cv2.transpose(mask)[first::spacing]
    changes = (flat[1:] != flat[:-1]).nonzero()[0].reshape(-1, 2).T
    slab = slabs.first.searchsorted(changes[0], "right") - 1
    begin, end, u, shift, number, ahead = slabs.about.take(slab, axis=1)
    whole = (changes[0] > begin) & (changes[1] < end)
    points = np.empty((6, len(slab)))
    points[0] = 1.0
    points[1] = u
    points[_LOW : _HIGH + 1] = changes * grid.step - shift
    if not plane.is_identity:
        _straighten(points, int(number.searchsorted(_SLABS_APART)), plane)
        whole &= (points[[1, _LOW, _HIGH]] < NOWHERE_PX).all(axis=0)
    points, number = points.compress(whole, axis=1), number[whole]
    split = int(number.searchsorted(_SLABS_APART))
    _, u, square, low, high, middle = points
    np.multiply(u, u, out=square)
    np.multiply(low + high, 0.5, out=middle)
    known = np.empty((4, len(u)), np.float32)
    known[0], known[1], known[2], known[3] = 1.0, u, middle, high - low
    known[2, split:] += _APART_PX
    key = np.empty(len(u) + 2)
    key[0], key[-1] = -np.inf, np.inf
    np.multiply(number, _SLAB_KEY, out=key[1:-1])
    key[1:-1] += known[2]
    free = np.ones(len(u), np.bool_)
    sides = points[:, split:], points[:, :split]
    spacing_px = float(spacing * grid.step)
    return _Cuts(key, ahead[whole], points, known, free, sides, split, spacing_px, grid.step)


def _straighten(points: Array, split: int, plane: Plane) -> None:
    """Take the lens's distortion out of the (6, N) points in place."""
    steep = np.arange(points.shape[1]) < split
    u, edges = points[1], points[_LOW : _HIGH + 1]
    x, y = plane.ideal(np.where(steep, edges, u), np.where(steep, u, edges))
    points[1] = np.where(steep, y, x).mean(axis=0)
    points[_LOW : _HIGH + 1] = np.where(steep, x, y)


def _ransac(cuts: _Cuts, fewest: int) -> list[Band]:
    """Sequential RANSAC: one matrix of hypotheses against centroids serves all bands of both directions,
    down to those with the `fewest` votes.

    Takes the cuts of the bands it finds off the free ones, and those that made no band after all.
    """
    strips: list[Band] = []
    step, free, known = cuts.step, cuts.free, cuts.known
    i, j = _pairs(cuts.key, cuts.ahead)
    one, other = known.take(i, axis=1), known.take(j, axis=1)
    _, du, rise, change = other - one
    b, width_b = rise / du, change / du
    good = (np.abs(b) <= MAX_SLOPE) & (np.abs(change) <= _PASS_WIDTH * (one[3] + other[3]) + 2 * step)
    (kept,) = good.nonzero()
    if not len(kept):
        return strips
    i, one, b, width_b = i.take(kept), one.take(kept, axis=1), b.take(kept), width_b.take(kept)
    # How far each cut is off each hypothesis, v - (v_i + b (u - u_i)), to either side beyond what is let
    # pass, and the width expected there, in one product.
    laws = np.zeros((3, 3, len(i)), np.float32)
    laws[2, 0], laws[2, 1] = one[3] - width_b * one[1], width_b
    passed = _PASS_OF_WIDTH * laws[2]
    passed[0] += step
    off = np.empty_like(laws[0])
    off[0], off[1], off[2] = b * one[1] - one[2], -b, 1.0
    np.subtract(off, passed, out=laws[0])
    np.subtract(-off, passed, out=laws[1])
    above, below, expected = laws.swapaxes(1, 2) @ known[:3]
    votes = np.maximum(above, below, out=above) <= 0
    votes &= expected >= (known[3] - 2 * step) / (1 + _PASS_WIDTH)
    votes &= expected <= (known[3] + 2 * step) / (1 - _PASS_WIDTH)
    inlier = votes.astype(np.float32)
    while True:
        scores = inlier @ free.astype(np.float32)
        best = int(scores.argmax())
        if scores[best] < fewest:
            return strips
        (taken,) = (votes[best] & free).nonzero()
        strip = _fit_band(cuts, taken, steep=bool(i[best] < cuts.split))
        if strip is not None:
            strips.append(strip)
            cuts.take(strip)
        free[taken] = False


def _pairs(key: Array, ahead: Array) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Random centroids, each with a partner far along the band it seems to belong to.

    A nearby slab gives the local slope, which says where to look in a slab further on: nearly every pair
    lies on one band, where blind pairs on k bands would agree once in k.
    """
    n = len(ahead)
    trials = min(n, max(TRIALS, min(n // _CUTS_PER_TRIAL, _MOST_LOOKS // n, _MOST_TRIALS)))
    i = (_SPREAD[:trials] * (n / trials)).astype(np.intp) if n > trials else np.arange(n)
    here, way = key.take(i + 1), ahead[i]
    near, far = way * _NEAR[:trials], way * _FAR[:trials]
    j, same = _nearest(key, here + near * _SLAB_KEY)
    (kept,) = same.nonzero()
    i, j = i.take(kept), j.take(kept)
    far, here, near = far.take(kept), here.take(kept), near.take(kept)
    rise = key.take(j + 1) - here - near * _SLAB_KEY
    k, same = _nearest(key, here + far * _SLAB_KEY + rise / near * far)
    return i, np.where(same, k, j)


def _nearest(key: Array, wanted: Array) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
    """Which centroid's key is nearest to each `wanted`, and whether it is of the same slab."""
    at = key.searchsorted(wanted)
    above, below = key.take(at) - wanted, wanted - key.take(at - 1)
    return at - 1 - (below <= above), np.minimum(above, below) < 0.5 * _SLAB_KEY


def _fit_band(cuts: _Cuts, members: NDArray[np.intp], *, steep: bool) -> Band | None:
    """Straight edges through the members' ends; None when they are too few, too short, or bent."""
    step, spacing_px = cuts.step, cuts.spacing_px
    noise = step / math.sqrt(12)
    if len(members) < _MIN_CUTS:
        return None
    first = moments(cuts.points.take(members, axis=1))
    (a, b), (c, d) = law(first, _LOW), law(first, _HIGH)
    # Once more through all cuts that agree with both edges.
    side = cuts.sides[steep]
    limit = 1.2 * step + 0.05 * abs(c - a)
    away = np.array(((-a, -b, 0.0, 1.0, 0.0, 0.0), (-c, -d, 0.0, 0.0, 1.0, 0.0))) @ side
    off = np.abs(away)
    inside = side.compress(np.maximum(off[0], off[1]) <= limit, axis=1)
    count = inside.shape[1]
    if count < _MIN_CUTS:
        return None
    u0, u1 = float(inside[1, 0]), float(inside[1, -1])
    core = moments(inside)
    low_fit, high_fit = fit(core, _LOW, noise), fit(core, _HIGH, noise)
    centre = bisector(low_fit, high_fit)
    if abs(centre.b) > MAX_SLOPE:
        return None

    def around() -> tuple[Moments, float]:
        near = np.abs(away[0] + away[1]) <= 2 * (limit + 2 * step)
        near &= np.abs(side[1] - 0.5 * (u0 + u1)) <= (0.5 + BEYOND) * (u1 - u0)
        wide = side.compress(near, axis=1)
        return moments(wide), float(wide[1, -1] - wide[1, 0])

    if is_bent((core, u1 - u0), around, _MIDDLE, noise):
        return None
    slabs = max(1.0, (u1 - u0) / spacing_px + 1)
    strip = Band(steep, centre, low_fit, high_fit, u0 - spacing_px / 2, u1 + spacing_px / 2, count / slabs)
    return strip if strip.width_px > 0 else None
