"""What years of work leave on a warehouse floor: stains, tyre marks, cracks, and the slab's joints."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Generic, TypeAlias, TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from flightd.sim.appearance import Appearance
from flightd.sim.floor.texture import Box, NoiseField, Patch
from flightd.site.site import Site

Floats: TypeAlias = NDArray[np.float32]

MARGIN_M = 4.0
"""Floor with marks around the site; beyond it the concrete is bare."""
_JOINT_WIDTH_M = 0.005
_SUBPIXEL_BITS = 4


@dataclass(frozen=True, slots=True)
class Stain:
    """A blot: an ellipse with ragged edge; `depth` 0..1 darkens, below 0 it is a pale (washed) spot."""

    x_m: float
    y_m: float
    long_m: float
    short_m: float
    turn_rad: float
    depth: float

    def box(self) -> Box:
        reach = self.long_m * 1.6
        return self.x_m - reach, self.y_m - reach, self.x_m + reach, self.y_m + reach


@dataclass(frozen=True, slots=True)
class Trail:
    """A curve of constant width: rubber from a tyre or a crack."""

    points_m: NDArray[np.float64]
    width_m: float
    depth: float

    def box(self) -> Box:
        low, high = self.points_m.min(axis=0) - self.width_m, self.points_m.max(axis=0) + self.width_m
        return float(low[0]), float(low[1]), float(high[0]), float(high[1])


class FloorMarks:
    """All marks of one floor, scattered by the seed; multiplies a patch's reflectance."""

    def __init__(self, site: Site, look: Appearance, seed: int) -> None:
        x0, y0, x1, y1 = site.bounds()
        area = (x0 - MARGIN_M, y0 - MARGIN_M, x1 + MARGIN_M, y1 + MARGIN_M)
        rng = np.random.default_rng([seed, 0x6D61726B])
        self._noise = NoiseField(seed)
        self._joint_depth = 0.55 * look.joints
        self._joint_xs = _joints(rng, area[0], area[2])
        self._joint_ys = _joints(rng, area[1], area[3])
        self._stains: _Near[Stain] = _Near(_stains(rng, area, look.stains))
        self._tyres: _Near[Trail] = _Near(_tyre_marks(rng, site, area, look.tyre_marks))
        self._cracks: _Near[Trail] = _Near(_cracks(rng, area, look.cracks))

    def shade(self, patch: Patch) -> Floats:
        """(size, size) factor 0..1 (a little above 1 on washed spots) for the patch's reflectance."""
        shade = np.ones((patch.size, patch.size), np.float32)
        for stain in self._stains.on(patch):
            self._blot(shade, patch, stain)
        tyres = self._tyres.on(patch)
        if tyres:
            streaks = self._noise.mix(patch, "rubber", {0.25: 0.35, 0.05: 0.3, 0.012: 0.35})
            rubber = np.clip(0.6 + streaks, 0.0, 1.2)
            for trail in tyres:
                shade *= 1.0 - trail.depth * rubber * _stroke(patch, trail)
        for crack in self._cracks.on(patch):
            shade *= 1.0 - crack.depth * _stroke(patch, crack)
        if self._joint_depth > 0.0:
            self._cut(shade, patch)
        return shade

    def _blot(self, shade: Floats, patch: Patch, stain: Stain) -> None:
        xs = patch.xs()
        dx, dy = (
            xs[None, :] + np.float32(patch.x_m - stain.x_m),
            xs[:, None] + np.float32(patch.y_m - stain.y_m),
        )
        c, s = math.cos(stain.turn_rad), math.sin(stain.turn_rad)
        radius = np.hypot((dx * c + dy * s) / stain.long_m, (dy * c - dx * s) / stain.short_m)
        ragged = self._noise.mix(patch, "stain", {0.2: 0.16, 0.06: 0.08, 0.02: 0.05})
        amount = np.clip((1.0 - radius + ragged) * 2.2, 0.0, 1.0)
        shade *= 1.0 - np.float32(stain.depth) * amount

    def _cut(self, shade: Floats, patch: Patch) -> None:
        across = _slit(patch.x_m, patch, self._joint_xs)
        along = _slit(patch.y_m, patch, self._joint_ys)
        if across.any():
            shade *= 1.0 - self._joint_depth * across[None, :]
        if along.any():
            shade *= 1.0 - self._joint_depth * along[:, None]


Mark = TypeVar("Mark", bound="Stain | Trail")


class _Near(Generic[Mark]):
    """Finds the marks that touch a patch."""

    def __init__(self, marks: Sequence[Mark]) -> None:
        self._marks = marks
        self._boxes = np.array([mark.box() for mark in marks]).reshape(-1, 4)

    def on(self, patch: Patch) -> list[Mark]:
        b = self._boxes
        touched = (b[:, 0] < patch.x_m + patch.side_m) & (b[:, 2] > patch.x_m)
        touched &= (b[:, 1] < patch.y_m + patch.side_m) & (b[:, 3] > patch.y_m)
        return [self._marks[i] for i in np.flatnonzero(touched).tolist()]


def _joints(rng: np.random.Generator, low: float, high: float) -> NDArray[np.float64]:
    step = rng.uniform(4.0, 6.5)
    return np.arange(low + rng.uniform(0.3, 1.0) * step, high, step)


def _slit(origin_m: float, patch: Patch, centres_m: NDArray[np.float64]) -> Floats:
    """Share of each texel's width that lies in a saw cut."""
    share = np.zeros(patch.size, np.float32)
    for centre in centres_m:
        at = centre - origin_m
        if -1.0 < at < patch.side_m + 1.0:
            xs, half = patch.xs(), patch.texel_m / 2
            inside = np.minimum(xs + half, at + _JOINT_WIDTH_M / 2) - np.maximum(
                xs - half, at - _JOINT_WIDTH_M / 2
            )
            share = np.maximum(share, np.clip(inside / patch.texel_m, 0.0, 1.0))
    return share


def _stroke(patch: Patch, trail: Trail) -> Floats:
    """Coverage 0..1 of a trail, anti-aliased; a trail thinner than a texel covers it in part."""
    width = trail.width_m / patch.texel_m
    scale = 1 << _SUBPIXEL_BITS
    pixels = (trail.points_m - (patch.x_m, patch.y_m)) / patch.texel_m - 0.5
    corners = np.round(pixels * scale).astype(np.int32).reshape(-1, 1, 2)
    mask = np.zeros((patch.size, patch.size), np.uint8)
    value = round(255 * min(1.0, width))
    thick = max(1, round(width))
    cv2.polylines(mask, [corners], False, (value,), thick, cv2.LINE_AA, _SUBPIXEL_BITS)
    coverage: Floats = mask.astype(np.float32) / np.float32(255.0)
    return coverage


def _area_m2(area: Box) -> float:
    return (area[2] - area[0]) * (area[3] - area[1])


def _stains(rng: np.random.Generator, area: Box, strength: float) -> list[Stain]:
    found = []
    for _ in range(round(0.35 * strength * _area_m2(area))):
        size = float(rng.lognormal(math.log(0.07), 0.7))
        washed = rng.random() < 0.2
        found.append(
            Stain(
                float(rng.uniform(area[0], area[2])),
                float(rng.uniform(area[1], area[3])),
                min(size, 0.6),
                min(size, 0.6) * float(rng.uniform(0.5, 1.0)),
                float(rng.uniform(0.0, math.pi)),
                -0.18 * strength if washed else float(rng.uniform(0.15, 0.6)) * (0.5 + 0.5 * strength),
            )
        )
    return found


def _tyre_marks(rng: np.random.Generator, site: Site, area: Box, strength: float) -> list[Trail]:
    """Pairs of tracks along the aisles, and arcs where trucks turn or brake."""
    found: list[Trail] = []
    if strength <= 0.0:
        return found
    for aisle in site.aisles:
        for _ in range(rng.poisson(2.0 * strength)):
            start, length = rng.uniform(aisle.x_m - 1.0, aisle.end_x_m), rng.uniform(1.5, 8.0)
            middle, drift = aisle.y_m + rng.normal(0.0, 0.25), rng.normal(0.0, 0.05)
            s = np.linspace(0.0, 1.0, 24)
            sway = 0.05 * np.sin(s * rng.uniform(2.0, 7.0) + rng.uniform(0.0, 6.0))
            for half_gauge in (-0.36, 0.36):
                points = np.stack(
                    [start + s * length, middle + half_gauge + sway + drift * s * length], axis=1
                )
                found.append(
                    Trail(points, float(rng.uniform(0.05, 0.11)), float(rng.uniform(0.08, 0.3)) * strength)
                )
    for _ in range(round(0.06 * strength * _area_m2(area))):
        centre = np.array([rng.uniform(area[0], area[2]), rng.uniform(area[1], area[3])])
        radius, begin, sweep = rng.uniform(0.6, 2.5), rng.uniform(0.0, math.tau), rng.uniform(0.3, 1.6)
        angles = begin + np.linspace(0.0, sweep, 32)
        for r in (radius, radius + 0.72)[: rng.integers(1, 3)]:
            points = centre + r * np.stack([np.cos(angles), np.sin(angles)], axis=1)
            found.append(
                Trail(points, float(rng.uniform(0.05, 0.12)), float(rng.uniform(0.1, 0.45)) * strength)
            )
    return found


def _cracks(rng: np.random.Generator, area: Box, strength: float) -> list[Trail]:
    found = []
    for _ in range(round(0.05 * strength * _area_m2(area))):
        steps = int(rng.integers(20, 90))
        heading = rng.uniform(0.0, math.tau) + np.cumsum(rng.normal(0.0, 0.25, steps))
        walk = np.cumsum(0.03 * np.stack([np.cos(heading), np.sin(heading)], axis=1), axis=0)
        start = np.array([rng.uniform(area[0], area[2]), rng.uniform(area[1], area[3])])
        found.append(Trail(start + walk, float(rng.uniform(0.0008, 0.0025)), 0.5))
    return found
