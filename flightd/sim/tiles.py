"""Floor tiles at the resolution of the view, kept while they are of use.

Five resolutions, a factor of two apart.  The tiles under the view lie side by side in a canvas, which the
renderer looks up; it is laid anew when the view leaves it.
"""

from __future__ import annotations

import math
from collections import OrderedDict

import numpy as np

from flightd.core.types import Image
from flightd.sim.floor import Floor
from flightd.sim.optics import Floats
from flightd.sim.texture import Patch

TILE_PX = 256
FINEST_M = 0.001
LEVELS = 6
_TILES_KEPT = 320
"""60 MB of tiles."""
_CANVAS_TILES = 8
"""Most tiles on one side of the canvas: 2048 texels; a view beyond is cut at the horizon."""


class TiledFloor:
    """Looks floor points up in painted tiles."""

    def __init__(self, floor: Floor) -> None:
        self._floor = floor
        self._tiles: OrderedDict[tuple[int, int, int], Image] = OrderedDict()
        self._canvas: Image = np.empty((0, 0, 3), np.uint8)
        self._laid: tuple[int, int, int, int, int] | None = None

    def look(
        self, x_m: Floats, y_m: Floats, foot: tuple[float, float], footprint_m: float
    ) -> tuple[Image, Floats]:
        """A picture of the floor around the points (relative to `foot`, map axes), and the points in its
        pixels: (rows, columns, 2) of (column, row).  `footprint_m` is the size of a camera pixel there."""
        level = min(max(round(math.log2(footprint_m / FINEST_M)), 0), LEVELS - 1)
        texel_m = FINEST_M * 2**level
        side_m = texel_m * TILE_PX
        first_x, last_x = _span(float(x_m.min()) + foot[0], float(x_m.max()) + foot[0], foot[0], side_m)
        first_y, last_y = _span(float(y_m.min()) + foot[1], float(y_m.max()) + foot[1], foot[1], side_m)
        if not self._covers(level, first_x, first_y, last_x, last_y):
            self._lay(level, first_x, first_y, last_x, last_y)
        assert self._laid is not None
        _, left, top, _, _ = self._laid
        cells = np.empty((*x_m.shape, 2), np.float32)
        np.multiply(x_m, 1.0 / texel_m, out=cells[..., 0])
        np.multiply(y_m, 1.0 / texel_m, out=cells[..., 1])
        cells += np.array(
            [foot[0] / texel_m - left * TILE_PX - 0.5, foot[1] / texel_m - top * TILE_PX - 0.5], np.float32
        )
        return self._canvas, cells

    def _covers(self, level: int, first_x: int, first_y: int, last_x: int, last_y: int) -> bool:
        if self._laid is None:
            return False
        laid_level, left, top, right, bottom = self._laid
        return (
            laid_level == level
            and left <= first_x
            and top <= first_y
            and last_x <= right
            and last_y <= bottom
        )

    def _lay(self, level: int, first_x: int, first_y: int, last_x: int, last_y: int) -> None:
        rows, columns = last_y - first_y + 1, last_x - first_x + 1
        shape = (rows * TILE_PX, columns * TILE_PX, 3)
        if self._canvas.shape != shape:
            self._canvas = np.empty(shape, np.uint8)
        for row in range(rows):
            for column in range(columns):
                self._canvas[
                    row * TILE_PX : (row + 1) * TILE_PX, column * TILE_PX : (column + 1) * TILE_PX
                ] = self._tile(level, first_x + column, first_y + row)
        self._laid = (level, first_x, first_y, last_x, last_y)

    def _tile(self, level: int, column: int, row: int) -> Image:
        key = (level, column, row)
        tile = self._tiles.get(key)
        if tile is None:
            texel_m = FINEST_M * 2**level
            side_m = texel_m * TILE_PX
            tile = self._floor.paint(Patch(column * side_m, row * side_m, texel_m, TILE_PX))
            self._tiles[key] = tile
            if len(self._tiles) > _TILES_KEPT:
                self._tiles.popitem(last=False)
        else:
            self._tiles.move_to_end(key)
        return tile


def _span(low_m: float, high_m: float, foot_m: float, side_m: float) -> tuple[int, int]:
    """First and last tile that the view needs on one axis, a tile's margin for bilinear look-up
    included, cut to what a canvas holds around the camera's foot."""
    reach_m = (_CANVAS_TILES - 1) / 2 * side_m
    first = math.floor(max(low_m - 0.02 * side_m, foot_m - reach_m) / side_m)
    last = math.floor(min(high_m + 0.02 * side_m, foot_m + reach_m) / side_m)
    return min(first, last), max(first, last)
