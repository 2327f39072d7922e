"""Points of the floor that are followed from frame to frame, lines or not (Lucas-Kanade, in pyramids).

What is followed is what the floor has anyway: grain, stains, cracks, the corners of paint.  A point is told
when it was found again in a second frame, forwards and backwards, and moved as most others did.
"""

from __future__ import annotations

import math
from typing import Any, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from flightd.core.types import FloorFeature, Image
from flightd.vision.lines.sampling import Grid
from flightd.vision.lines.undistortion import NOWHERE_PX, Plane

Array: TypeAlias = NDArray[Any]

MOST_TOLD = 6
_WIDTH_PX = 160
"""Width of the small picture in which points are followed."""
_MOST, _ENOUGH, _FEWEST = 24, 12, 4
"""Points followed; fewer than `_ENOUGH` are made up; fewer than `_FEWEST` agree by chance."""
_APART_PX = 10.0
_REACH = math.ceil(_APART_PX) - 1
"""Whole pixels that are nearer than that."""
_QUALITY = 0.02
_CONTRAST = 1e-3
"""Least eigenvalue of a corner's structure tensor (detail of 0..1): flatter ones are noise."""
_LIGHT_PX, _GAIN = 7, 4.0
"""What is wider than this in the small picture is light: shadows and mirrored lamps do not move as the floor
does, and pull what lies in them along."""
_BORDER_PX = 4
_GAP_NS = 250_000_000
"""After so long the floor below is another one."""
_BACK_PX = 0.3
_AGREE_PX = 1.2
"""A picture's motion is nearly a similarity; lens and tilt bend it by less than this."""
_WINDOW = (11, 11)
_LEVELS = 2
_STOP = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 12, 0.02)
_BLOCK = 5


class FeatureTracker:
    """Give each frame to `find` in turn.  One for each detector: what it follows is its own."""

    def __init__(self) -> None:
        self._detail: Image | None = None
        self._stamp_ns = 0
        self._ids: Array = np.empty(0, np.int64)
        self._told: Array = np.empty(0, bool)
        self._at: Array = np.empty((0, 2), np.float32)

    def find(
        self, small: Image, grid: Grid, seq: int, stamp_ns: int, plane: Plane
    ) -> tuple[FloorFeature, ...]:
        """The points of frame `seq`, of which `small` are the BGR samples on `grid`, that were followed from
        the frame before, the oldest first, at most `MOST_TOLD`; in centred image coordinates of a
        distortion-free camera."""
        join = max(round(grid.width / _WIDTH_PX), 1)
        detail = _detail_of(small, join)
        follows = self._detail is not None and 0 < stamp_ns - self._stamp_ns <= _GAP_NS
        if follows and self._detail is not None and self._detail.shape == detail.shape:
            self._follow(self._detail, detail)
        else:
            self._keep(np.zeros(len(self._ids), bool))
        found = self._tell(plane, grid, join)
        if len(self._ids) < _ENOUGH:
            self._detect(detail, seq)
        self._detail, self._stamp_ns = detail, stamp_ns
        return found

    def _follow(self, before: Image, now: Image) -> None:
        if not len(self._at):
            return
        ahead, there = _followed(before, now, self._at)
        back, again = _followed(now, before, ahead)
        height, width = now.shape
        inside = (ahead >= _BORDER_PX).all(axis=1) & (ahead < (width - _BORDER_PX, height - _BORDER_PX)).all(
            1
        )
        same = np.abs(back - self._at).max(axis=1) < _BACK_PX
        good = there & again & inside & same
        good[good] = _agreeing(self._at[good], ahead[good])
        self._at = ahead
        self._keep(good)
        self._told = np.ones(len(self._ids), bool)

    def _keep(self, good: Array) -> None:
        self._ids, self._at, self._told = self._ids[good], self._at[good], self._told[good]

    def _tell(self, plane: Plane, grid: Grid, join: int) -> tuple[FloorFeature, ...]:
        chosen = np.flatnonzero(self._told)[:MOST_TOLD]
        if not len(chosen):
            return ()
        at = (self._at[chosen].astype(float) + 0.5) * join - 0.5
        x, y = plane.ideal(grid.x(at[:, 0]), grid.y(at[:, 1]))
        there = np.maximum(np.abs(x), np.abs(y)) < NOWHERE_PX
        chosen, x, y = chosen[there], x[there], y[there]
        return tuple(
            FloorFeature(int(id_), round(float(u), 2), round(float(v), 2))
            for id_, u, v in zip(self._ids[chosen], x, y, strict=True)
        )

    def _detect(self, detail: Image, seq: int) -> None:
        """Look for new points away from those that are followed."""
        free = np.zeros(detail.shape, np.uint8)
        free[_BORDER_PX:-_BORDER_PX, _BORDER_PX:-_BORDER_PX] = 255
        for x, y in self._at:
            cv2.circle(free, (round(float(x)), round(float(y))), round(_APART_PX), 0, -1)
        strength = np.asarray(cv2.cornerMinEigenVal(detail, _BLOCK))
        wanted = _MOST - len(self._ids)
        limit = max(_QUALITY * float(strength.max()), _CONTRAST)
        peaks = (strength == cv2.dilate(strength, _BLOCK_ONES)) & (strength > limit) & (free > 0)
        rows, columns = np.nonzero(peaks)
        chosen = _spread(rows, columns, strength[rows, columns], wanted)
        fresh = np.stack([columns[chosen], rows[chosen]], axis=1).astype(np.float32)
        ids = np.int64(seq) * _MOST + np.arange(len(fresh))
        self._ids = np.concatenate([self._ids, ids])
        self._at = np.concatenate([self._at, fresh])
        self._told = np.concatenate([self._told, np.zeros(len(fresh), bool)])


_BLOCK_ONES = np.ones((_BLOCK, _BLOCK), np.uint8)


def _detail_of(small: Image, join: int) -> Image:
    """The detail of the grey picture without its light, `join` samples a side to one pixel."""
    grey = cv2.cvtColor(small, cv2.COLOR_BGR2GRAY)
    size = max(small.shape[1] // join, 1), max(small.shape[0] // join, 1)
    whole = grey[: size[1] * join, : size[0] * join]
    joined = cv2.resize(whole, size, interpolation=cv2.INTER_AREA)
    light = cv2.blur(joined, (_LIGHT_PX, _LIGHT_PX))
    return np.asarray(cv2.addWeighted(joined, _GAIN, light, -_GAIN, 128.0), np.uint8)


def _followed(before: Image, now: Image, at: Array) -> tuple[Array, Array]:
    """Where (N, 2) points of one picture are in another, and which (N,) were found there."""
    there, found, _ = cv2.calcOpticalFlowPyrLK(
        before, now, at, np.empty_like(at), winSize=_WINDOW, maxLevel=_LEVELS, criteria=_STOP
    )
    return np.asarray(there), found[:, 0] == 1


def _spread(rows: Array, columns: Array, strength: Array, most: int) -> list[int]:
    """The strongest, none nearer than `_APART_PX` to a stronger one."""
    chosen: list[int] = []
    order = np.argsort(-strength)[: 8 * most]
    down, right = rows + _REACH, columns + _REACH
    near = np.zeros((int(down.max(initial=0)) + _REACH + 1, int(right.max(initial=0)) + _REACH + 1), bool)
    for candidate, row, column in zip(
        order.tolist(), down[order].tolist(), right[order].tolist(), strict=True
    ):
        if len(chosen) == most:
            break
        if not near[row, column]:
            chosen.append(candidate)
            near[row - _REACH : row + _REACH + 1, column - _REACH : column + _REACH + 1] = True
    return chosen


def _agreeing(before: Array, after: Array) -> Array:
    """(N,) which points move as most others do: by one similarity, within `_AGREE_PX`."""
    if len(before) < _FEWEST:
        return np.zeros(len(before), bool)
    _, inside = cv2.estimateAffinePartial2D(
        before, after, method=cv2.RANSAC, ransacReprojThreshold=_AGREE_PX, maxIters=60
    )
    agree = np.zeros(len(before), bool) if inside is None else inside[:, 0] == 1
    return agree if np.count_nonzero(agree) >= max(_FEWEST, len(before) / 2) else np.zeros_like(agree)
