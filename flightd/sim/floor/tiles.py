"""Floor tiles at the resolution of the view, kept while they are of use.

Six resolutions, a factor of two apart.  The tiles under the view lie side by side in a canvas, which the
renderer looks up; it is laid anew when the view leaves it.
"""

from __future__ import annotations

import math
from collections import OrderedDict
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from flightd.core.types import Image
from flightd.sim.floor.floor import Floor
from flightd.sim.floor.texture import Patch
from flightd.sim.sensors.optics import Floats

TILE_PX = 256
FINEST_M = 0.001
LEVELS = 6
_TILES_KEPT = 320
"""60 MB of tiles."""
_CANVASES_KEPT = 2
"""Hovering between two resolutions changes the canvas often; both stay."""
_CANVAS_TILES = 8
"""Most tiles on one side of the canvas: 2048 texels; a view beyond is cut at the horizon."""


@dataclass(frozen=True, slots=True)
class _Area:
    """A rectangle of tiles, first and last of each axis included."""

    level: int
    left: int
    top: int
    right: int
    bottom: int

    @property
    def texel_m(self) -> float:
        return math.ldexp(FINEST_M, self.level)

    def contains(self, other: _Area) -> bool:
        across = self.left <= other.left and other.right <= self.right
        return across and self.top <= other.top and other.bottom <= self.bottom

    def tiles(self) -> Iterator[tuple[int, int, int]]:
        for row in range(self.top, self.bottom + 1):
            for column in range(self.left, self.right + 1):
                yield self.level, column, row


@dataclass(frozen=True, slots=True)
class Ahead:
    """Where the view will be a little later: moved by (x_m, y_m) and `growth` times as wide."""

    x_m: float
    y_m: float
    growth: float


class TiledFloor:
    """Looks floor points up in painted tiles."""

    def __init__(self, floor: Floor) -> None:
        self._floor = floor
        self._tiles: OrderedDict[tuple[int, int, int], Image] = OrderedDict()
        self._laid: dict[int, tuple[_Area, Image]] = {}

    def look(
        self, x_m: Floats, y_m: Floats, foot: tuple[float, float], footprint_m: float
    ) -> tuple[Image, Floats]:
        """A picture of the floor around the points (relative to `foot`, map axes), and the points in its
        pixels: (rows, columns, 2) of (column, row).  `footprint_m` is the size of a camera pixel there."""
        area = _area(x_m, y_m, foot, footprint_m)
        if area.level not in self._laid or not self._laid[area.level][0].contains(area):
            self._lay(area)
        laid, canvas = self._laid[area.level]
        texel_m = laid.texel_m
        cells = np.empty((*x_m.shape, 2), np.float32)
        np.multiply(x_m, 1.0 / texel_m, out=cells[..., 0])
        np.multiply(y_m, 1.0 / texel_m, out=cells[..., 1])
        cells[..., 0] += foot[0] / texel_m - laid.left * TILE_PX - 0.5
        cells[..., 1] += foot[1] / texel_m - laid.top * TILE_PX - 0.5
        return canvas, cells

    def prepare(
        self, x_m: Floats, y_m: Floats, foot: tuple[float, float], footprint_m: float, ahead: Ahead
    ) -> None:
        """Paint at most one tile that the view will need soon, so that no picture waits for a whole row."""
        there = (foot[0] + ahead.x_m, foot[1] + ahead.y_m)
        area = _area(x_m * ahead.growth, y_m * ahead.growth, there, footprint_m * ahead.growth)
        missing = next((key for key in area.tiles() if key not in self._tiles), None)
        if missing is not None:
            self._tile(*missing)

    def _lay(self, area: _Area) -> None:
        shape = ((area.bottom - area.top + 1) * TILE_PX, (area.right - area.left + 1) * TILE_PX, 3)
        canvas = self._laid.pop(area.level)[1] if area.level in self._laid else None
        if canvas is None or canvas.shape != shape:
            canvas = np.empty(shape, np.uint8)
        for key in area.tiles():
            row, column = (key[2] - area.top) * TILE_PX, (key[1] - area.left) * TILE_PX
            canvas[row : row + TILE_PX, column : column + TILE_PX] = self._tile(*key)
        self._laid[area.level] = (area, canvas)
        while len(self._laid) > _CANVASES_KEPT:
            self._laid.pop(next(iter(self._laid)))

    def _tile(self, level: int, column: int, row: int) -> Image:
        key = (level, column, row)
        tile = self._tiles.get(key)
        if tile is None:
            texel_m = math.ldexp(FINEST_M, level)
            side_m = texel_m * TILE_PX
            tile = self._floor.paint(Patch(column * side_m, row * side_m, texel_m, TILE_PX))
            self._tiles[key] = tile
            if len(self._tiles) > _TILES_KEPT:
                self._tiles.popitem(last=False)
        else:
            self._tiles.move_to_end(key)
        return tile


def _area(x_m: Floats, y_m: Floats, foot: tuple[float, float], footprint_m: float) -> _Area:
    """The tiles, of the resolution nearest to the camera's, under the points."""
    level = min(max(round(math.log2(footprint_m / FINEST_M)), 0), LEVELS - 1)
    side_m = math.ldexp(FINEST_M, level) * TILE_PX
    left, right = _span(x_m, foot[0], side_m)
    top, bottom = _span(y_m, foot[1], side_m)
    return _Area(level, left, top, right, bottom)


def _span(offsets_m: Floats, foot_m: float, side_m: float) -> tuple[int, int]:
    """First and last tile that the view needs on one axis, a rim for the bilinear look-up included, cut
    to what a canvas holds around the camera's foot."""
    reach_m = (_CANVAS_TILES - 1) / 2 * side_m
    low_m, high_m = float(offsets_m.min()) - 0.02 * side_m, float(offsets_m.max()) + 0.02 * side_m
    first = math.floor((foot_m + min(max(low_m, -reach_m), reach_m)) / side_m)
    last = math.floor((foot_m + min(max(high_m, -reach_m), reach_m)) / side_m)
    return first, last
