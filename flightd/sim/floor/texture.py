"""Endless, repeatable noise over the floor: the raw material of concrete, wear and dirt."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeAlias, cast

import cv2
import numpy as np
from numpy.typing import NDArray

Floats: TypeAlias = NDArray[np.float32]
Box: TypeAlias = tuple[float, float, float, float]
"""An upright rectangle of floor: x0, y0, x1, y1 on the map."""

_PERIOD = 256
_STEPS_PER_CELL = 4


@dataclass(frozen=True, slots=True)
class Patch:
    """A square of floor texels: texel (row, column) is centred on
    (x_m + (column + 0.5) * texel_m, y_m + (row + 0.5) * texel_m) in the map frame."""

    x_m: float
    y_m: float
    texel_m: float
    size: int

    def xs(self) -> Floats:
        """x of the texel centres from the patch's own corner, for precision."""
        centres: Floats = ((np.arange(self.size) + 0.5) * self.texel_m).astype(np.float32)
        return centres

    @property
    def side_m(self) -> float:
        return self.size * self.texel_m


class NoiseField:
    """Independent smooth noise fields, one for each name and cell size; mean 0, about unit variance.

    The same place has the same value on every patch; detail finer than the texels is left out, not
    aliased."""

    def __init__(self, seed: int) -> None:
        self._seed = seed
        self._lattices: dict[tuple[str, float], Floats] = {}

    def octave(self, patch: Patch, name: str, cell_m: float) -> Floats:
        """(size, size) noise whose bumps are about `cell_m` wide; zeros when texels are coarser."""
        if cell_m < patch.texel_m:
            return np.zeros((patch.size, patch.size), np.float32)
        lattice = self._lattice(name, cell_m)
        u0, v0 = patch.x_m / cell_m, patch.y_m / cell_m
        column, row = math.floor(u0) - 2, math.floor(v0) - 2
        count = math.ceil(patch.side_m / cell_m) + 5
        near = lattice.take(np.arange(row, row + count), axis=0, mode="wrap").take(
            np.arange(column, column + count), axis=1, mode="wrap"
        )
        step = patch.texel_m / cell_m
        shift = (u0 - column + step / 2 - 0.5, v0 - row + step / 2 - 0.5)
        # cv2's warps know 32 positions between two cells only: spread the cells first where that shows
        spread = _STEPS_PER_CELL if step < 1 / 16 else 1
        if spread > 1:
            wide = (near.shape[1] * spread, near.shape[0] * spread)
            near = cast("Floats", cv2.resize(near, wide, interpolation=cv2.INTER_CUBIC))
        matrix = np.array(
            [
                [step * spread, 0.0, (shift[0] + 0.5) * spread - 0.5],
                [0.0, step * spread, (shift[1] + 0.5) * spread - 0.5],
            ]
        )
        flags = cv2.WARP_INVERSE_MAP | (cv2.INTER_LINEAR if spread > 1 else cv2.INTER_CUBIC)
        return cast("Floats", cv2.warpAffine(near, matrix, (patch.size, patch.size), flags=flags))

    def mix(self, patch: Patch, name: str, cells: dict[float, float]) -> Floats:
        """Weighted sum of octaves, `cells` giving the weight of each cell size in metres."""
        total = np.zeros((patch.size, patch.size), np.float32)
        for cell_m, weight in cells.items():
            if cell_m >= patch.texel_m:
                total += np.float32(weight) * self.octave(patch, name, cell_m)
        return total

    def _lattice(self, name: str, cell_m: float) -> Floats:
        key = (name, cell_m)
        if key not in self._lattices:
            # seeded by text: the same on every machine and independent of the order of first use
            entropy = [self._seed, round(cell_m * 1e6), *name.encode()]
            rng = np.random.default_rng(entropy)
            self._lattices[key] = rng.standard_normal((_PERIOD, _PERIOD)).astype(np.float32)
        return self._lattices[key]
