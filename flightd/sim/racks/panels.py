"""Flat things that stand parallel to a rack's face, and drawing them as a camera sees them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np

from flightd.core.camera_view import CameraView
from flightd.core.geometry import Matrix
from flightd.core.types import Image

_NEAREST_M = 0.05
"""What reaches nearer to the camera's plane than this is left out."""
_LEAST_PX_PER_M = 60.0
"""Density in the picture, the coarser way, below which a panel is drawn in one tone."""
_MOST_TEXELS_PER_M = 1250.0
_MOST_SIDE_PX, _MOST_AREA_PX = 16_000, 12_000_000
"""A picture has no more: OpenCV warps none with a side of 2^15, and the memory is not without end."""
_HALF_SCALE = 0.4
"""Pixels to the texel below which the picture of half the size is drawn: no aliases from afar."""


@dataclass(frozen=True, slots=True)
class Panel:
    """A picture in the plane y = `y_m`: its left edge (as it is seen) at `left_m`, its right edge at
    `right_m`, from `low_m` to `high_m` above the floor; its upper edge is `lean_m` farther in x."""

    y_m: float
    left_m: float
    right_m: float
    low_m: float
    high_m: float
    lean_m: float = 0.0

    def corners(self) -> Matrix:
        """(4, 3) map points: top left, top right, bottom right, bottom left."""
        return np.array(
            [
                (self.left_m + self.lean_m, self.y_m, self.high_m),
                (self.right_m + self.lean_m, self.y_m, self.high_m),
                (self.right_m, self.y_m, self.low_m),
                (self.left_m, self.y_m, self.low_m),
            ]
        )


def texels_per_m(width_m: float, height_m: float) -> float:
    """The density of the picture of a panel of that size: 1250, and less for one of several metres."""
    side = _MOST_SIDE_PX / max(width_m, height_m)
    area = math.sqrt(_MOST_AREA_PX / (width_m * height_m))
    return min(_MOST_TEXELS_PER_M, side, area)


def texture_shape(width_m: float, height_m: float, density: float) -> tuple[int, int]:
    """Rows and columns of a panel's picture; at least two, so that there is half of them."""
    return max(round(height_m * density), 2), max(round(width_m * density), 2)


@dataclass(frozen=True, slots=True)
class Texture:
    """A panel's picture, and the same at half the size.  They have a fourth, unused channel: OpenCV warps
    four twice as fast as three."""

    full: Image
    half: Image

    @classmethod
    def of(cls, picture: Image) -> Texture:
        full = cv2.cvtColor(picture, cv2.COLOR_BGR2BGRA)
        half = cv2.resize(full, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
        return cls(np.asarray(full, np.uint8), np.asarray(half, np.uint8))

    @property
    def nbytes(self) -> int:
        return self.full.nbytes + self.half.nbytes


class Pane:
    """A (H, W, 4) picture being drawn with an ideal camera: panels and polygons, what is behind first."""

    def __init__(self, view: CameraView, picture: Image) -> None:
        self._picture = picture
        self._size = picture.shape[1], picture.shape[0]
        at = view.viewpoint
        image_from_map = at.map_from_image.T * (1.0, 1.0, -1.0)
        self._turn = (view.lens.matrix() @ image_from_map).T
        self._shift = np.array((at.x_m, at.y_m, at.height_m)) @ self._turn

    def footprint(self, points_m: Matrix) -> Matrix | None:
        """(N, 2) pixels of map points, or None where they cannot be drawn: all outside the picture, or
        one beside or behind the camera."""
        seen = points_m @ self._turn - self._shift
        depth = seen[:, 2:]
        if depth.min() < _NEAREST_M:
            return None
        pixels: Matrix = seen[:, :2] / depth
        low, high = pixels.min(axis=0), pixels.max(axis=0)
        if high.min() < 0.0 or low[0] > self._size[0] - 1 or low[1] > self._size[1] - 1:
            return None
        return pixels

    def polygon(self, points_m: Matrix, colour: tuple[float, float, float]) -> None:
        """Fill the convex polygon of (N, 3) map points."""
        pixels = self.footprint(points_m)
        if pixels is not None:
            self._fill(pixels, colour)

    def panel(self, panel: Panel, texture: Callable[[], Texture], tone: tuple[float, float, float]) -> None:
        """Draw a panel over what is there; from afar in one tone, without asking for its picture."""
        size_m = abs(panel.right_m - panel.left_m), panel.high_m - panel.low_m
        self.sheet(panel.corners(), size_m, texture, tone)

    def sheet(
        self,
        corners_m: Matrix,
        size_m: tuple[float, float],
        texture: Callable[[], Texture],
        tone: tuple[float, float, float],
    ) -> None:
        """Draw as `panel` what stands in any plane: a picture of this size (across, down) between (4, 3) map
        points, from its top left clockwise."""
        pixels = self.footprint(corners_m)
        if pixels is None:
            return
        width_m, height_m = size_m
        across = max(math.dist(pixels[0], pixels[1]), math.dist(pixels[3], pixels[2])) / width_m
        down = max(math.dist(pixels[0], pixels[3]), math.dist(pixels[1], pixels[2])) / height_m
        if min(across, down) < _LEAST_PX_PER_M:
            self._fill(pixels, tone)
            return
        full = texture().full
        rows, columns = full.shape[:2]
        picture = full
        if min(across * width_m / columns, down * height_m / rows) < _HALF_SCALE:
            picture = texture().half
            rows, columns = picture.shape[:2]
        low = np.maximum(np.floor(pixels.min(axis=0)), 0).astype(int)
        high = np.minimum(np.ceil(pixels.max(axis=0)) + 1, self._size).astype(int)
        # texel i is centred on i: the panel's edges are half a texel outside of the picture's
        edges = np.array(
            [(-0.5, -0.5), (columns - 0.5, -0.5), (columns - 0.5, rows - 0.5), (-0.5, rows - 0.5)]
        )
        place = cv2.getPerspectiveTransform(edges.astype(np.float32), (pixels - low).astype(np.float32))
        target = self._picture[low[1] : high[1], low[0] : high[0]]
        cv2.warpPerspective(
            picture,
            place,
            (target.shape[1], target.shape[0]),
            dst=target,
            flags=cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_TRANSPARENT,
        )

    def _fill(self, pixels: Matrix, colour: tuple[float, float, float]) -> None:
        bounded = np.clip(pixels, -20_000.0, 20_000.0)
        cv2.fillConvexPoly(self._picture, np.round(bounded * 16).astype(np.int32), colour, cv2.LINE_8, 4)
