"""Where a band's edges are on the full frame, to a fraction of a pixel, only where a band was guessed.

All bands' edges are measured at once: arrays are (edge, station, tap), a station being a whole pixel row
(steep band) or column (shallow band), a tap one pixel of it.  No interpolation: pixels are taken as
they are, projected on the colour difference between paint and floor, and an edge is located by area,
which is exact for any symmetric blur.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from flightd.core.types import Image
from flightd.vision.lines.band import Array, Band
from flightd.vision.lines.line_fit import row_medians, weighted_lines
from flightd.vision.lines.undistortion import Plane

Floats: TypeAlias = NDArray[np.float32]
Indices: TypeAlias = NDArray[np.intp]

STATIONS = 256
"""Shared among all edges of a frame."""
_MIN_CONTRAST, _CONTRAST_PART, _DARK_CONTRAST = 4.0, 0.04, 1.2
"""Grey levels between floor and paint below which there is no edge: less in a dark picture, whose paint
differs by as large a part, down to what rounding to whole levels leaves."""
CHROMA_VARIANCE = 3.0
"""How much noisier colour differences are than luma: sensors and codecs give them half the resolution."""
FINE = 4
"""Half width of the window in which an edge is located by area, in pixels."""

_LUMA = np.array([[0.114, 0.587, 0.299]])
_CHROMA = np.eye(3) - np.ones((3, 1)) @ _LUMA
_TRUST = (_LUMA.T @ _LUMA + _CHROMA.T @ _CHROMA / CHROMA_VARIANCE).astype(np.float32)
"""Inverse of the noise's covariance in BGR, luma's variance being one."""
_MIN_STATIONS, _MAX_STATIONS = 24, 112
_AGREE_PX = (4.0, 2.0)
_GOLDEN = 0.6180339887498949


@dataclass(frozen=True, slots=True)
class Taps:
    """Pixels across the guessed edges: (E, S) places, (E, S, T) taps from floor to paint.

    `row` counts along u and `base` along v in raw pixels; tap t of an edge is pixel base + sign (t - half).
    `seen` (E, S) tells which guessed places are in the picture; edges need `least_contrast` grey levels.
    `shade` (E, 3) is the paint's colour over the floor's, by channel.
    """

    steep: NDArray[np.bool_]
    sign: Indices
    row: Indices
    base: Indices
    half: int
    seen: NDArray[np.bool_]
    profile: Floats
    contrast: Array
    shade: Array
    least_contrast: float


@dataclass(frozen=True, slots=True)
class Edges:
    """Located edge points (E, S) in the distortion-free plane with their weights (0 where none), and how much
    (E,) of each edge's contrast lies within some pixels of it."""

    u: Array
    v: Array
    weight: Array
    sharpness: Array


def take(bgr: Image, strips: list[Band], plane: Plane, half: int) -> Taps:
    """Gather the pixels across every guessed edge."""
    height, width = bgr.shape[:2]
    count = len(strips)
    stations = max(_MIN_STATIONS, min(_MAX_STATIONS, STATIONS // (16 * count) * 8))
    half_x, half_y = (width - 1) / 2, (height - 1) / 2
    steep = np.repeat([s.steep for s in strips], 2)[:, None]
    sign = np.tile(np.array([1, -1]), count)[:, None]
    guess = np.array([(f.a, f.b, s.u0, s.u1) for s in strips for f in (s.low, s.high)])
    a, b, u0, u1 = (guess[:, k, None] for k in range(4))
    # Evenly spread but never in step with the picture's own grids (JPEG blocks, colour subsampling).
    order = np.arange(stations)
    u = u0 + (u1 - u0) * ((order + order * _GOLDEN % 1.0) / stations)
    v = a + b * u
    x, y = plane.raw(np.where(steep, v, u), np.where(steep, u, v))
    row = np.rint(np.where(steep, y + half_y, x + half_x)).astype(np.intp)
    base = np.rint(np.where(steep, x + half_x, y + half_y)).astype(np.intp)

    # Near the picture's border the taps are moved inwards: the edge is then not at their middle.
    rows: Indices = np.where(steep, np.full(1, height), width)
    columns: Indices = np.where(steep, np.full(1, width), height)
    half = min(half, (min(height, width) - 1) // 2)
    seen = (row >= 0) & (row < rows) & (base >= 0) & (base < columns)
    row, guessed = np.clip(row, 0, rows - 1), base
    base = np.clip(base, half, columns - 1 - half)
    # Inside a thin band the taps stop at its middle: beyond it the far edge would be seen.
    middles = np.array([(s.high.at(m) - s.low.at(m)) / 2 for s in strips for m in [(s.u0 + s.u1) / 2]])
    inner = np.repeat(np.maximum(1, middles.astype(np.intp)), 2)[:, None]
    stride_u, stride_v = np.where(steep, width, 1), np.where(steep, 1, width)
    if (moved := sign * (base - guessed)).any():
        inner = np.maximum(1, inner - moved)
    offset = (sign * stride_v)[..., None] * np.minimum(np.arange(-half, half + 1), inner[..., None])
    index = (row * stride_u + base * stride_v)[:, :, None] + offset
    pixels = bgr.reshape(-1, 3).take(index, axis=0).astype(np.float32)
    profile, contrast, shade = _project(pixels, seen)
    least = min(max(_CONTRAST_PART * float(pixels.mean()), _DARK_CONTRAST), _MIN_CONTRAST)
    return Taps(steep, sign, row, base, half, seen, profile, contrast, shade, least)


def rough(taps: Taps) -> tuple[Array, Array]:
    """Lines through the steepest rise towards the paint at each station, in raw pixels: v = a + b u."""
    p = taps.profile
    rise = p[..., 3:] + p[..., 2:-1] - p[..., 1:-2] - p[..., :-3]
    best = rise.argmax(axis=-1)
    strength = np.take_along_axis(rise, best[..., None], axis=-1)[..., 0]
    found = (strength > np.maximum(0.5 * taps.contrast[:, None], 2 * taps.least_contrast)) & taps.seen
    shift = best + (1.5 - taps.half)
    # The guess is nearly parallel: the edge is where most stations agree on the shift from it.
    agreed = row_medians(shift, found)[:, None]
    u, v = taps.row.astype(float), taps.base + taps.sign * shift
    near = found & (np.abs(shift - agreed) <= _AGREE_PX[0])
    for reach_px in _AGREE_PX[1:]:
        a, b = weighted_lines(u, v, near.astype(float))
        near = found & (np.abs(v - a[:, None] - b[:, None] * u) <= reach_px)
    a, b = weighted_lines(u, v, near.astype(float))
    return a[:, None], b[:, None]


def locate(taps: Taps, rough_a: Array, rough_b: Array, plane: Plane) -> Edges:
    """Edge points by area, in a window centred on the rough lines."""
    expected = (rough_a + rough_b * taps.row - taps.base) * taps.sign
    middle = np.rint(expected).astype(np.intp) + taps.half
    window = middle[..., None] + np.arange(-FINE, FINE + 1)
    length = taps.profile.shape[-1]
    usable = (window[..., 0] >= 0) & (window[..., -1] < length)
    window = np.clip(window, 0, length - 1)
    p = np.take_along_axis(taps.profile, window, axis=-1)
    usable &= taps.seen
    floor, paint = p[..., :2].mean(axis=-1), p[..., -2:].mean(axis=-1)
    step = paint - floor
    usable &= step > np.maximum(0.35 * taps.contrast[:, None], taps.least_contrast)
    painted = (p - floor[..., None]).sum(axis=-1) / np.where(usable, step, 1.0)
    position = middle - taps.half + FINE + 0.5 - painted
    usable &= np.abs(position - expected) <= 2.5
    edge = taps.base + taps.sign * np.where(usable, position, expected)
    x = np.where(taps.steep, edge, taps.row) - (plane.width_px - 1) / 2
    y = np.where(taps.steep, taps.row, edge) - (plane.height_px - 1) / 2
    x, y = plane.ideal(x, y)
    weight = usable.astype(float)
    sharpness = (step * weight).sum(axis=1) / np.maximum(taps.contrast * weight.sum(axis=1), 1e-6)
    return Edges(np.where(taps.steep, y, x), np.where(taps.steep, x, y), weight, sharpness)


def _project(pixels: Floats, valid: NDArray[np.bool_]) -> tuple[Floats, Array, Array]:
    """Profiles (E, S, T) along the colour direction from floor to paint, each edge's contrast (E,), and the
    paint's colour over the floor's (E, 3)."""
    weight = valid / np.maximum(np.count_nonzero(valid, axis=1), 1)[:, None].astype(np.float32)
    floor, paint = pixels[:, :, 0] + pixels[:, :, 1], pixels[:, :, -1] + pixels[:, :, -2]
    floor, paint = (np.einsum("es,esc->ec", weight.astype(np.float32), side) / 2 for side in (floor, paint))
    direction = paint - floor
    shade = np.asarray(paint / np.maximum(floor, 1.0), np.float64)
    projection = direction @ _TRUST
    contrast = np.sqrt(np.einsum("ec,ec->e", direction, projection))
    projection /= np.maximum(contrast, 1e-6)[:, None]
    edges, stations, taps, _ = pixels.shape
    profile = np.matmul(pixels.reshape(edges, -1, 3), projection[:, :, None]).reshape(edges, stations, taps)
    return np.asarray(profile, np.float32), contrast.astype(float), shade
