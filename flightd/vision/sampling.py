"""The small picture on which lines are guessed: every k-th pixel, untouched.

Nearest-neighbour sampling costs next to nothing and keeps colours pure; averaging would mix paint with
floor and cost more than all the rest.  Sample i is raw pixel k i + k // 2.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from flightd.core.types import Image
from flightd.vision.strip import Array

TARGET_WIDTH_PX = 320
MAX_STEP = 6
"""A 6 px line must still leave a connected trace."""

_FAR = 1e6
_MANY = 240
"""Samples across from which every second one will do for what is larger than a line."""


@dataclass(frozen=True, slots=True)
class Grid:
    """How samples lie in the frame."""

    frame_width: int
    frame_height: int
    step: int
    shift: int = 0
    """How far before the middle of its cell a sample was taken, in pixels."""

    @property
    def offset(self) -> int:
        return self.step // 2 - self.shift

    @property
    def width(self) -> int:
        return max(1, (self.frame_width - self.offset) // self.step)

    @property
    def height(self) -> int:
        return max(1, (self.frame_height - self.offset) // self.step)

    @property
    def corner(self) -> tuple[float, float]:
        """Centred frame coordinates of the first cell's outer corner."""
        before = self.offset - self.step / 2
        return before - (self.frame_width - 1) / 2, before - (self.frame_height - 1) / 2

    def x(self, i: Array | NDArray[np.intp] | float) -> Array:
        """Centred frame coordinate of (fractional) sample column `i`."""
        return np.asarray(i, float) * self.step + (self.offset - (self.frame_width - 1) / 2)

    def y(self, j: Array | NDArray[np.intp] | float) -> Array:
        return np.asarray(j, float) * self.step + (self.offset - (self.frame_height - 1) / 2)

    def column(self, x: Array) -> NDArray[np.int32]:
        """Sample column that stands for centred frame coordinate `x`; may lie outside the grid."""
        return _whole((x - self.corner[0]) * (1 / self.step))

    def row(self, y: Array) -> NDArray[np.int32]:
        return _whole((y - self.corner[1]) * (1 / self.step))


def _whole(places: Array) -> NDArray[np.int32]:
    """Rounded down; far outside the picture a lens model may put points anywhere, even beyond an int32."""
    return np.clip(np.floor(places), -_FAR, _FAR).astype(np.int32)


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
