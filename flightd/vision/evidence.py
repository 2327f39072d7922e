"""Is there a painted band where a method says so?  Counts paint inside and floor beside each guess.

Everything is looked up in the small mask at stations along each guess's whole run through the picture, so
that a guess made from part of a band gets the band's true span, gaps included.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from flightd.core.types import Image
from flightd.vision.colour import STRONG, Levels, has_seeds
from flightd.vision.plane import Plane, shortest_length
from flightd.vision.sampling import Grid
from flightd.vision.strip import Array, Strip

STATIONS = 48
_INSIDE = np.array([-0.42, -0.25, -0.08, 0.08, 0.25, 0.42])
"""Where the paint is looked for, in widths from the centre line."""
_PARTS = np.zeros((10, 3), np.float32)
_PARTS[:6, 0] = _PARTS[6:8, 1] = _PARTS[8:, 2] = 1.0
"""Which of the points across a band lie inside it, and which on its one and other side."""
_BOTH_SIDES = np.ones(2, np.float32)
_PLACES = (np.arange(STATIONS) + 0.5) / STATIONS
_FAINT_STRONG, _FAINT_FILLED, _FAINT_LENGTH = 0.12, 0.8, 0.3
"""Less than the first part of a band is strong and less than the second weak or strong: it is faint.  One
that is shorter than this part of the picture's diagonal is then something of a similar colour."""


@dataclass(frozen=True, slots=True)
class Evidence:
    """A guess with its true span, and how much of a band it is.

    `length_px` is the length that shows paint inside and floor on both sides (one side counts half);
    `score` is the area of that.
    """

    strip: Strip
    length_px: float
    score: float


def weigh(strips: list[Strip], mask: Image, grid: Grid, plane: Plane) -> list[Evidence]:
    """The evidence for each guess that shows any paint."""
    if not strips:
        return []
    steep = np.array([s.steep for s in strips])[:, None]
    fits = np.array([(s.centre.a, s.centre.b, s.low.a, s.low.b, s.high.a, s.high.b) for s in strips])
    a, b, low_a, low_b, high_a, high_b = (fits[:, k, None] for k in range(6))
    norm = np.hypot(1.0, b)
    u0, u1 = _run(steep, a, b, plane)
    pitch = (u1 - u0) / STATIONS
    u = u0 + (u1 - u0) * _PLACES
    width = np.maximum(high_a - low_a + (high_b - low_b) * u, 0.5 * grid.step)
    margin = 1.5 * grid.step * norm
    beside = margin + np.minimum(0.35 * width, 6.0 * grid.step * norm)
    v = np.empty((len(strips), STATIONS, len(_INSIDE) + 4))
    # Samples on the very edge may be either: look half a sample inside it.
    v[..., :6] = _INSIDE * np.maximum(width - grid.step * norm, 0.25 * width)[..., None]
    v[..., 6], v[..., 7] = -width / 2 - beside, -width / 2 - margin
    v[..., 8], v[..., 9] = width / 2 + margin, width / 2 + beside
    v += (a + b * u)[..., None]
    painted, seen = _look_up(mask, grid, plane, steep[..., None], u[..., None], v)
    counts = painted @ _PARTS
    filled = counts[..., 0] >= 0.55 * np.maximum(seen @ _PARTS[:, 0], 3)
    band = filled * (1.0 - 0.5 * np.minimum(counts[..., 1:], 1.0) @ _BOTH_SIDES)
    found = []
    for k, strip in enumerate(strips):
        span = _span(filled[k], band[k])
        if span is None:
            continue
        stretch = slice(*span)
        places = filled[k, stretch].astype(np.float32)
        count = int(places.sum())
        if (places @ painted[k, stretch, :6]).min() < 0.3 * count:
            continue
        first, pace = float(u0[k, 0]), float(pitch[k, 0])
        stations = span[1] - span[0]
        clear = float(np.add.reduce(band[k, stretch])) / stations
        length = clear * stations * pace * float(norm[k, 0])
        new = replace(
            strip, u0=first + pace * span[0], u1=first + pace * span[1], support=count / stations, clear=clear
        )
        found.append(Evidence(new, length, length * min(new.width_px, length)))
    return found


def _run(steep: NDArray[np.bool_], a: Array, b: Array, plane: Plane) -> tuple[Array, Array]:
    """From where to where each centre line runs inside the picture."""
    half_u = np.where(steep, plane.height_px / 2, plane.width_px / 2)
    half_v = np.where(steep, plane.width_px / 2, plane.height_px / 2)
    slope = np.where(np.abs(b) < 1e-9, 1e-9, b)
    one, other = (-half_v - a) / slope, (half_v - a) / slope
    u0 = np.maximum(-half_u, np.minimum(one, other))
    u1 = np.minimum(half_u, np.maximum(one, other))
    return u0, np.maximum(u0 + 1.0, u1)


def _look_up(
    mask: Image, grid: Grid, plane: Plane, steep: NDArray[np.bool_], u: Array, v: Array
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """1 where there is paint, and 1 where the point is in the picture; 0 elsewhere."""
    height, width = mask.shape
    if plane.is_identity:
        # Along and across the bands: u is one for all points of a station.
        start_u, start_v = (np.where(steep, *pair) for pair in (grid.corner[::-1], grid.corner))
        place_u = np.floor((u - start_u) * (1 / grid.step)).astype(np.int32)
        place_v = np.floor((v - start_v) * (1 / grid.step)).astype(np.int32)
        seen = (place_v >= 0) & (place_v < np.where(steep, width, height))
        seen &= (place_u >= 0) & (place_u < np.where(steep, height, width))
        index = place_u * np.where(steep, width, 1) + place_v * np.where(steep, 1, width)
    else:
        x, y = plane.raw(np.where(steep, v, u), np.where(steep, u, v))
        i, j = grid.column(x), grid.row(y)
        seen = (i >= 0) & (i < width) & (j >= 0) & (j < height)
        index = j * width + i
    there = seen.astype(np.float32)
    return (mask.ravel().take(index * seen) != 0) * there, there


def _span(filled: NDArray[np.bool_], band: Array) -> tuple[int, int] | None:
    """First and one past the last station of the band: its stations, and gaps no longer than its parts."""
    places = np.flatnonzero(filled)
    if len(places) == 0:
        return None
    breaks = np.flatnonzero(places[1:] - places[:-1] > STATIONS // 4)
    if len(breaks) == 0:
        return int(places[0]), int(places[-1]) + 1
    starts, ends = [0, *(breaks + 1)], [*breaks, len(places) - 1]
    parts = [(int(places[s]), int(places[e]) + 1) for s, e in zip(starts, ends, strict=True)]
    return max(parts, key=lambda part: float(band[part[0] : part[1]].sum()))


def select(found: list[Evidence], shortest_px: float, known: list[Strip]) -> list[Strip]:
    """The bands that explain the paint: largest first, each one's paint counted once.

    Bands that `known` ones explain are left out.
    """
    kept: list[Strip] = []
    for evidence in sorted(found, key=lambda e: -e.score):
        strip = evidence.strip
        if strip.length_px < 1.3 * strip.width_px:
            continue
        if evidence.length_px < max(shortest_px, 0.6 * strip.width_px):
            continue
        if _explained(strip, known + kept) <= 0.5:
            kept.append(strip)
    return kept


def is_paint_left(mask: Image, strips: list[Strip], grid: Grid, plane: Plane) -> bool:
    """Whether beside the strips there is as much paint as in the shortest band, one sample wide."""
    left = mask.copy()
    for strip in strips:
        margin = 1.5 * grid.step / strip.cosine
        # Where the border cuts a slanted band, twice its width says nothing of it.
        reach = margin + 2 * strip.width_px
        first, last = strip.u0 - reach, strip.u1 + reach
        u = np.array((first, last, last, first))
        edges = (strip.low, strip.low, strip.high, strip.high)
        v = np.array([fit.at(at) for fit, at in zip(edges, u.tolist(), strict=True)])
        v += (-margin, -margin, margin, margin)
        x, y = plane.raw(*((v, u) if strip.steep else (u, v)))
        corners = np.stack((grid.column(x), grid.row(y)), axis=-1)
        cv2.fillConvexPoly(left, corners, 0)
    return cv2.countNonZero(left) * grid.step >= shortest_length(plane)


def without_faint(strips: list[Strip], levels: Levels, grid: Grid, plane: Plane) -> list[Strip]:
    """The strips without short ones of a colour that is only like the paint's: lettering, dirt, goods.

    Worn paint is strong between its holes, and what bad light leaves of a line is long.  Where next to no
    paint is strong, that says nothing.
    """
    enough = _FAINT_LENGTH * math.hypot(plane.width_px, plane.height_px)
    faint = [s for s in strips if s.length_px < enough and _is_faint(s, levels, grid, plane)]
    return [s for s in strips if s not in faint] if faint and has_seeds(levels) else strips


def _is_faint(strip: Strip, levels: Levels, grid: Grid, plane: Plane) -> bool:
    u = strip.u0 + (strip.u1 - strip.u0) * _PLACES
    width = strip.high.a - strip.low.a + (strip.high.b - strip.low.b) * u
    v = (strip.centre.a + strip.centre.b * u)[:, None] + width[:, None] * _INSIDE
    steep = np.full((1, 1), strip.steep)
    marked, seen = _look_up(levels, grid, plane, steep, u[:, None], v)
    strong, _ = _look_up((levels == STRONG).view(np.uint8), grid, plane, steep, u[:, None], v)
    count = max(float(seen.sum()), 1.0)
    return bool(strong.sum() < _FAINT_STRONG * count and marked.sum() < _FAINT_FILLED * count)


def _explained(strip: Strip, others: list[Strip]) -> float:
    """The part of the strip's centre line that lies in the others' bands."""
    u = strip.u0 + (strip.u1 - strip.u0) * ((np.arange(16) + 0.5) / 16)
    v = strip.centre.a + strip.centre.b * u
    covered = np.zeros(16, np.bool_)
    for other in others:
        s, t = (u, v) if strip.steep == other.steep else (v, u)
        reach = 0.6 * other.width_px / other.cosine + 4.0
        covered |= (
            (np.abs(t - other.centre.a - other.centre.b * s) <= reach)
            & (s >= other.u0 - reach)
            & (s <= other.u1 + reach)
        )
    return float(covered.mean())
