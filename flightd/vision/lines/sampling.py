"""The small picture on which lines are guessed: every k-th pixel, untouched.

Nearest-neighbour sampling costs next to nothing and keeps colours pure; averaging would mix paint with
floor and cost more than all the rest.  Sample i is raw pixel k i + k // 2.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from flightd.core.types import Image
from flightd.vision.lines.band import Array

TARGET_WIDTH_PX = 320
MAX_STEP = 6
"""A 6 px line must still leave a connected trace."""

PAINT, OUTSIDE = 255, 128
"""What a mask holds where there is paint, and what is looked up beyond its border."""
_MOST_ROWS = 32_000
"""OpenCV's remapping takes fewer than 2^15."""
_MANY = 240
"""Samples across from which every second one will do for what is larger than a line."""


@dataclass(frozen=True)
class Grid:
    """How samples lie in the frame."""

    frame_width: int
    frame_height: int
    step: int
    shift: int = 0
    """How far before the middle of its cell a sample was taken, in pixels."""

    @cached_property
    def offset(self) -> int:
        return self.step // 2 - self.shift

    @cached_property
    def width(self) -> int:
        return max(1, (self.frame_width - self.offset) // self.step)

    @cached_property
    def height(self) -> int:
        return max(1, (self.frame_height - self.offset) // self.step)

    @cached_property
    def first(self) -> tuple[float, float]:
        """Centred frame coordinates of the first sample."""
        return self.offset - (self.frame_width - 1) / 2, self.offset - (self.frame_height - 1) / 2

    def x(self, i: Array | NDArray[np.intp] | float) -> Array:
        """Centred frame coordinate of (fractional) sample column `i`."""
        return np.asarray(i, float) * self.step + self.first[0]

    def y(self, j: Array | NDArray[np.intp] | float) -> Array:
        return np.asarray(j, float) * self.step + self.first[1]

    def places(self, x: Array, y: Array) -> NDArray[np.float32]:
        """(..., 2) fractional sample columns and rows of centred frame coordinates."""
        places = np.empty((*np.shape(x), 2), np.float32)
        scale, (x0, y0) = 1 / self.step, self.first
        np.multiply(x - x0, scale, out=places[..., 0])
        np.multiply(y - y0, scale, out=places[..., 1])
        return places


def look_up(table: Image, places: NDArray[np.float32]) -> Image:
    """(A, B) values of a mask or of levels at the samples nearest to (A, B, 2) `places`; OUTSIDE beyond its
    border."""
    if len(places) > _MOST_ROWS:
        parts = [places[k : k + _MOST_ROWS] for k in range(0, len(places), _MOST_ROWS)]
        return np.concatenate([look_up(table, part) for part in parts])
    # No second map: the first holds both coordinates.
    found = cv2.remap(  # type: ignore[call-overload]
        table,
        places,
        None,
        cv2.INTER_NEAREST,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=OUTSIDE,
    )
    return np.asarray(found, np.uint8)


@lru_cache(maxsize=16)
def grid_for(width: int, height: int) -> Grid:
    """About 320 samples across the longer side, at most every 6th pixel."""
    return Grid(width, height, max(1, min(MAX_STEP, round(max(width, height) / TARGET_WIDTH_PX))))


def sample(bgr: Image, grid: Grid) -> Image:
    """(grid.height, grid.width, 3) of the frame's own pixels."""
    if grid.step == 1:
        return bgr
    o, k, w, h = grid.offset, grid.step, grid.width, grid.height
    # Rows are cropped so that the ratio is exactly k: then "nearest" takes pixel k i + o and no other.
    inside = bgr[o : o + h * k, o : o + w * k]
    if inside.shape[:2] != (h * k, w * k):
        return np.ascontiguousarray(bgr[o::k, o::k][:h, :w])
    return _every(inside, k)


def coarsened(small: Image, grid: Grid) -> tuple[Image, Grid]:
    """Every second of the samples, and how they lie in the frame; all of them where there are few."""
    if grid.width < _MANY:
        return small, grid
    coarse = Grid(grid.frame_width, grid.frame_height, 2 * grid.step, grid.step - grid.offset)
    return _every(small[: 2 * coarse.height, : 2 * coarse.width], 2), coarse


def _every(picture: Image, k: int) -> Image:
    """Every k-th pixel of a picture whose sides are multiples of k, from the first."""
    height, width = picture.shape[:2]
    return np.asarray(
        cv2.resize(picture, (width // k, height // k), interpolation=cv2.INTER_NEAREST), np.uint8
    )
