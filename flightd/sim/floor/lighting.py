"""Light on the floor: lamp rows, shelf shadows, skylights; and the lamps' mirror images in the floor."""

from __future__ import annotations

from typing import TypeAlias, cast

import cv2
import numpy as np
from numpy.typing import NDArray

from flightd.sim.appearance import Appearance
from flightd.sim.floor.texture import Patch
from flightd.sim.floor.wear_marks import MARGIN_M
from flightd.site.site import Site

Floats: TypeAlias = NDArray[np.float32]

_CELL_M = 0.05
_LAMP_BELOW_CEILING_M = 0.5
_GLARE_REACH_M = 8.0


class Lighting:
    """The static light of one hall: a map of brightness over the floor, and the lamps above it."""

    def __init__(self, site: Site, look: Appearance, seed: int) -> None:
        rng = np.random.default_rng([seed, 0x6C616D70])
        x0, y0, x1, y1 = site.bounds()
        self._x_m, self._y_m = x0 - MARGIN_M, y0 - MARGIN_M
        xs = np.arange(self._x_m, x1 + MARGIN_M, _CELL_M, dtype=np.float32)
        ys = np.arange(self._y_m, y1 + MARGIN_M, _CELL_M, dtype=np.float32)
        self._lamp_height_m = max(site.ceiling_m - _LAMP_BELOW_CEILING_M, 1.0)
        self._lamps = _lamp_rows(rng, site)
        self._glare = look.glare
        level = _lamp_light(self._lamps, self._lamp_height_m, xs, ys)
        light = 1.0 + look.lamps * (level - 1.0)
        if look.shadows > 0.0:
            light *= _shelf_shadows(site, look.shadows, xs, ys)
        if look.sun > 0.0:
            light += look.sun * _skylights(rng, light.shape)
        self._map: Floats = np.ascontiguousarray(light, dtype=np.float32)

    def on(self, patch: Patch) -> Floats:
        """(size, size) brightness, 1 on average; beyond the hall as at its edge."""
        step = patch.texel_m / _CELL_M
        matrix = np.array(
            [
                [step, 0.0, (patch.x_m - self._x_m + patch.texel_m / 2) / _CELL_M],
                [0.0, step, (patch.y_m - self._y_m + patch.texel_m / 2) / _CELL_M],
            ]
        )
        flags = cv2.WARP_INVERSE_MAP | cv2.INTER_LINEAR
        size = (patch.size, patch.size)
        light = cv2.warpAffine(self._map, matrix, size, flags=flags, borderMode=cv2.BORDER_REPLICATE)
        return cast("Floats", light)

    def glare(self, x_m: Floats, y_m: Floats, foot: tuple[float, float], height_m: float) -> Floats | None:
        """Brightness (0..255) that lamps mirror from the floor points (x, y relative to the camera's
        foot) into the camera; None where there is none."""
        if self._glare <= 0.0:
            return None
        share = height_m / (height_m + self._lamp_height_m)
        offsets = (self._lamps[:, :2] - np.array(foot)) * share
        near = np.hypot(offsets[:, 0], offsets[:, 1]) < _GLARE_REACH_M * share
        if not near.any():
            return None
        # a rough floor smears a tube into a soft bar: longer along the tube and with the way of the light
        along, across = 0.75 * share + 0.06 * height_m, 0.1 * share + 0.08 * height_m
        shine = np.zeros_like(x_m)
        for (px, py), strength in zip(offsets[near], self._lamps[near, 2], strict=True):
            u, v = (x_m - np.float32(px)) / np.float32(along), (y_m - np.float32(py)) / np.float32(across)
            shine += np.float32(strength) / (1.0 + (u * u + v * v) ** 2)
        return np.float32(110.0 * self._glare) * shine


def _lamp_rows(rng: np.random.Generator, site: Site) -> NDArray[np.float64]:
    """(N, 3) x, y and strength of the tubes: a row over each aisle, one lamp in twenty dead."""
    rows = []
    for aisle in site.aisles:
        step, y_m = rng.uniform(2.6, 4.0), aisle.y_m + rng.uniform(-0.5, 0.5)
        for x_m in np.arange(aisle.x_m - 2.0 + rng.uniform(0.0, 2.0), aisle.end_x_m + 2.0, step):
            strength = 0.0 if rng.random() < 0.05 else rng.uniform(0.8, 1.1)
            rows.append((float(x_m), y_m, strength))
    return np.array(rows)


def _lamp_light(lamps: NDArray[np.float64], height_m: float, xs: Floats, ys: Floats) -> Floats:
    # shelves keep a lamp's light in its aisle: narrower across than along
    reach_x, reach_y = np.float32(0.45 * height_m), np.float32(0.3 * height_m)
    level = np.zeros((len(ys), len(xs)), np.float32)
    for x_m, y_m, strength in lamps:
        ux, uy = (xs - np.float32(x_m)) / reach_x, (ys - np.float32(y_m)) / reach_y
        level += np.float32(strength) * np.outer(1.0 / (1.0 + uy * uy), 1.0 / (1.0 + ux * ux)).astype(
            np.float32
        )
    mean = float(level[level > np.median(level) / 2].mean())
    normal: Floats = np.clip(level / mean, 0.45, 1.6)
    return normal


def _shelf_shadows(site: Site, depth: float, xs: Floats, ys: Floats) -> Floats:
    """Dark below the shelves, a soft edge in front, and the uprights' slim shadows into the aisle."""
    light = np.ones((len(ys), len(xs)), np.float32)
    for shelf in site.shelves:
        behind = (ys - shelf.y_m) * shelf.inward
        edge = np.clip(0.5 + (behind - 0.05) / 0.2, 0.0, 1.0) * (behind < 1.2)
        before = 0.35 * np.exp(-np.clip(-behind, 0.0, None) / 0.3) * (behind <= 0.0)
        span = np.clip((xs - shelf.x0_m) / 0.2 + 0.5, 0, 1) * np.clip((shelf.x1_m - xs) / 0.2 + 0.5, 0, 1)
        light *= 1.0 - depth * np.outer(0.75 * edge + before, span).astype(np.float32)
        for upright in np.arange(shelf.x0_m, shelf.x1_m, 1.9):
            lean = xs[None, :] - upright + 0.45 * behind[:, None]
            bar = np.exp(-((lean / 0.09) ** 2)) * np.exp(behind / 0.5)[:, None] * (behind <= 0.0)[:, None]
            light *= 1.0 - np.float32(0.45 * depth) * bar.astype(np.float32)
    return light


def _skylights(rng: np.random.Generator, shape: tuple[int, ...]) -> Floats:
    """Slanted bright panes with soft rims, one for about 30 m² of floor."""
    panes = np.zeros(shape, np.float32)
    lean = rng.uniform(-0.6, 0.6)
    for _ in range(max(1, round(shape[0] * shape[1] * _CELL_M**2 / 30.0))):
        x, y = rng.uniform(0, shape[1]), rng.uniform(0, shape[0])
        long, wide = rng.uniform(0.8, 2.2) / _CELL_M, rng.uniform(0.3, 0.8) / _CELL_M
        corners = np.array(
            [
                [x, y],
                [x + wide, y + lean * wide],
                [x + wide - lean * long, y + long],
                [x - lean * long, y + long],
            ]
        )
        cv2.fillPoly(panes, [np.round(corners).astype(np.int32)], (float(rng.uniform(0.6, 1.2)),))
    return cast("Floats", cv2.GaussianBlur(panes, (0, 0), 1.2))
