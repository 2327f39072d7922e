"""Painted floors: coverage of bands and arcs by sub-pixel distance, floor texture, worn paint.

A pixel's coverage falls from 1 to 0 over one pixel along the edge's normal, centred on the edge, so the
edge of a drawn band lies where the scene says, to a few thousandths of a pixel.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from flightd.sim.dataset.scenes import Arc, Scene, SceneBand

Plane: TypeAlias = NDArray[np.float32]
"""(H, W) float32."""
Picture: TypeAlias = NDArray[np.float32]
"""(H, W, 3) float32, BGR, 0..255."""

PAINT_HSV: dict[str, tuple[float, float, float]] = {
    "yellow": (47.0, 0.84, 224.0),
    "white": (50.0, 0.03, 228.0),
    "red": (1.0, 0.80, 188.0),
    "blue": (212.0, 0.78, 168.0),
    "green": (138.0, 0.68, 142.0),
    "black": (40.0, 0.10, 26.0),
    "orange": (22.0, 0.88, 216.0),
}
"""Hue (degrees), saturation (0..1) and value (0..255) of fresh paint under neutral light."""

_HUE_SPREAD = {
    "yellow": 4.0,
    "white": 30.0,
    "red": 4.0,
    "blue": 9.0,
    "green": 12.0,
    "black": 180.0,
    "orange": 4.0,
}

FLOORS_HSV = ((45.0, 0.06), (30.0, 0.14), (210.0, 0.07), (90.0, 0.06), (0.0, 0.02), (36.0, 0.20))
"""Hue and saturation of concrete, screed, grey and greenish epoxy, asphalt and dusty beige."""

COLOURED_FLOORS_HSV = ((130.0, 0.45), (215.0, 0.40), (12.0, 0.45), (28.0, 0.40))
"""Green and blue epoxy, brick and wood."""

_FLOOR_VALUE = {"white": (55.0, 130.0), "black": (110.0, 205.0)}
_OTHER_FLOOR_VALUE = (60.0, 175.0)
_FADED = 0.35
_APART_DEG = 75.0


@dataclass(frozen=True, slots=True)
class Bend:
    """Residual lens distortion: an ideal point p appears at p / (1 + k |p|^2) (all about the centre)."""

    k: float = 0.0

    def apparent(self, x: float, y: float) -> tuple[float, float]:
        factor = 1.0
        for _ in range(4):
            factor = 1.0 / (1.0 + self.k * (x * x + y * y) * factor * factor)
        return x * factor, y * factor


def bgr_of(hue_deg: float, saturation: float, value: float) -> NDArray[np.float32]:
    """(3,) BGR, 0..255, of a colour given in HSV."""
    pixel = np.array([[[hue_deg % 360.0, np.clip(saturation, 0, 1), np.clip(value, 0, 255)]]], np.float32)
    bgr: NDArray[np.float32] = cv2.cvtColor(pixel, cv2.COLOR_HSV2BGR)[0, 0].astype(np.float32)
    return bgr


def paint_bgr(rng: np.random.Generator, colour: str, spread: float) -> NDArray[np.float32]:
    """A paint of the named colour; `spread` 0 is the standard tone, 1 the whole range of the trade, from
    fresh to bleached and dusty."""
    hue, saturation, value = PAINT_HSV[colour]
    hue += spread * rng.uniform(-1, 1) * _HUE_SPREAD[colour]
    saturation *= 1.0 + spread * rng.uniform(-0.1, 0.15)
    value *= 1.0 + spread * rng.uniform(-0.12, 0.1)
    faded = spread * rng.uniform(0, _FADED) * (rng.random() < 0.5)
    dust = 110.0 if colour == "black" else value * 0.85
    fresh = bgr_of(hue, saturation, value)
    return fresh + np.float32(faded) * (np.float32(dust) - fresh)


def floor_bgr(rng: np.random.Generator, line_colour: str, spread: float) -> NDArray[np.float32]:
    """A floor on which lines of `line_colour` would be painted: dark under white, bright under black, of
    another hue under the others."""
    low, high = _FLOOR_VALUE.get(line_colour, _OTHER_FLOOR_VALUE)
    middle = (low + high) / 2
    value = middle + spread * rng.uniform(low - middle, high - middle)
    floors: tuple[tuple[float, float], ...] = FLOORS_HSV
    if rng.random() < 0.4 * spread:
        floors = tuple(floor for floor in COLOURED_FLOORS_HSV if _differs(floor[0], line_colour))
    hue, saturation = floors[int(rng.integers(len(floors)))]
    return bgr_of(hue, saturation * spread, value)


def _differs(hue_deg: float, line_colour: str) -> bool:
    if line_colour in ("white", "black"):
        return True
    return abs((hue_deg - PAINT_HSV[line_colour][0] + 180.0) % 360.0 - 180.0) > _APART_DEG


def axes(width: int, height: int) -> tuple[Plane, Plane]:
    """(1, W) x and (H, 1) y of the pixel centres about the image centre."""
    x = (np.arange(width, dtype=np.float32) - (width - 1) / 2)[None, :]
    y = (np.arange(height, dtype=np.float32) - (height - 1) / 2)[:, None]
    return x, y


def coverage(scene: Scene, bend: Bend) -> Plane:
    """(H, W) share of each pixel that is inside a band or arc of the scene, 0..1."""
    x, y = axes(scene.width, scene.height)
    if bend.k:
        factor = 1.0 + np.float32(bend.k) * (x * x + y * y)
        x, y = x * factor, y * factor
    covered = np.zeros((scene.height, scene.width), np.float32)
    for band in scene.bands:
        np.maximum(covered, _inside_band(band, x, y), out=covered)
    for arc in scene.arcs:
        np.maximum(covered, _inside_arc(arc, x, y), out=covered)
    return covered


def _inside_band(band: SceneBand, x: Plane, y: Plane) -> Plane:
    c, s = np.float32(math.cos(band.theta)), np.float32(math.sin(band.theta))
    inside: Plane = np.float32(band.thickness / 2 + 0.5) - np.abs(x * c + (y * s - np.float32(band.rho)))
    if band.taper or abs(band.start) < 1e4 or abs(band.end) < 1e4:
        along = y * c - x * s
        if band.taper:
            inside += np.float32(band.taper / 2) * along
        inside = np.minimum(inside, along - np.float32(band.start - 0.5))
        inside = np.minimum(inside, np.float32(band.end + 0.5) - along)
    return np.clip(inside, 0.0, 1.0, out=inside)


def _inside_arc(arc: Arc, x: Plane, y: Plane) -> Plane:
    dx, dy = x - np.float32(arc.x), y - np.float32(arc.y)
    radius = np.hypot(dx, dy)
    inside: Plane = np.float32(arc.thickness / 2 + 0.5) - np.abs(radius - np.float32(arc.radius))
    angle = (np.arctan2(dy, dx) - np.float32(arc.start)) % np.float32(math.tau)
    inside[angle > arc.end - arc.start] = 0.0
    clipped: Plane = np.clip(inside, 0.0, 1.0)
    return clipped


def smooth_noise(rng: np.random.Generator, width: int, height: int, grain_px: float) -> Plane:
    """(H, W) smooth random field of unit standard deviation; blobs of about `grain_px`."""
    cells = (max(int(height / grain_px), 1) + 3, max(int(width / grain_px), 1) + 3)
    field = rng.standard_normal(cells, dtype=np.float32)
    grown: Plane = cv2.resize(field, (width, height), interpolation=cv2.INTER_CUBIC).astype(np.float32)
    grown /= np.float32(max(float(grown.std()), 1e-6))
    return grown


def floor_texture(rng: np.random.Generator, width: int, height: int, contrast: float) -> Plane:
    """(H, W) factor about 1 of a mottled floor; `contrast` is its standard deviation."""
    scale = width / 1920
    coarse = smooth_noise(rng, width, height, 220 * scale)
    fine = smooth_noise(rng, width, height, max(9 * scale, 2.5))
    return 1.0 + np.float32(contrast) * (np.float32(0.75) * coarse + np.float32(0.65) * fine)


def wear(rng: np.random.Generator, covered: Plane, share: float, grain_px: float) -> Plane:
    """The coverage with about `share` of the paint rubbed off in ragged patches."""
    height, width = covered.shape
    field = smooth_noise(rng, width, height, grain_px) + np.float32(0.6) * smooth_noise(
        rng, width, height, max(grain_px / 5, 2.0)
    )
    threshold = np.float32(np.quantile(field[::8, ::8], share))
    left = np.clip((field - threshold) * np.float32(4.0) + np.float32(0.5), 0.0, 1.0)
    worn: Plane = covered * left
    return worn


def break_band(rng: np.random.Generator, covered: Plane, band: SceneBand, span: tuple[float, float]) -> Plane:
    """The coverage with a few clean gaps across one band, at most a third of its span."""
    x, y = axes(covered.shape[1], covered.shape[0])
    along = y * np.float32(math.cos(band.theta)) - x * np.float32(math.sin(band.theta))
    across = np.abs(x * np.float32(math.cos(band.theta)) + y * np.float32(math.sin(band.theta)) - band.rho)
    length = span[1] - span[0]
    for _ in range(int(rng.integers(1, 4))):
        gap = rng.uniform(0.03, 0.11) * length
        middle = rng.uniform(span[0] + gap, span[1] - gap)
        inside = (np.abs(along - np.float32(middle)) < gap / 2) & (across < band.thickness / 2 + 1.5)
        covered[inside] = 0.0
    return covered
