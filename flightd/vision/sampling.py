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


@dataclass(frozen=True, slots=True)
class Grid:
    """How samples lie in the frame."""

    frame_width: int
    frame_height: int
    step: int

    @property
    def offset(self) -> int:
        return self.step // 2

    @property
    def width(self) -> int:
        return max(1, (self.frame_width - self.offset) // self.step)

    @property
    def height(self) -> int:
        return max(1, (self.frame_height - self.offset) // self.step)

    def x(self, i: Array | NDArray[np.intp] | float) -> Array:
        """Centred frame coordinate of (fractional) sample column `i`."""
        return np.asarray(i, float) * self.step + (self.offset - (self.frame_width - 1) / 2)

    def y(self, j: Array | NDArray[np.intp] | float) -> Array:
        return np.asarray(j, float) * self.step + (self.offset - (self.frame_height - 1) / 2)

    def column(self, x: Array) -> NDArray[np.int32]:
        """Sample column that stands for centred frame coordinate `x`; may lie outside the grid."""
        left = self.offset - self.step / 2 - (self.frame_width - 1) / 2
        return np.floor((x - left) * (1 / self.step)).astype(np.int32)

    def row(self, y: Array) -> NDArray[np.int32]:
        top = self.offset - self.step / 2 - (self.frame_height - 1) / 2
        return np.floor((y - top) * (1 / self.step)).astype(np.int32)


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
    small = cv2.resize(inside, (w, h), interpolation=cv2.INTER_NEAREST)
    return np.asarray(small, np.uint8)
