"""Is there a painted band where a method says so?  Counts paint inside and floor beside each guess.

Everything is looked up in the small mask at stations along each guess's whole run through the picture, so
that a guess made from part of a band gets the band's true span, gaps included.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flightd.core.types import Image
from flightd.vision.plane import Plane
from flightd.vision.sampling import Grid
from flightd.vision.strip import Array, Strip

STATIONS = 64
_INSIDE = np.array([-0.42, -0.25, -0.08, 0.08, 0.25, 0.42])
"""Where the paint is looked for, in widths from the centre line."""


@dataclass(frozen=True, slots=True)
class Evidence:
    """A guess with its true span, and how much of a band it is.

    `length_px` is the length that shows paint inside and floor on both sides (one side counts half);
    `spread` is the least painted lane of the band against the mean.
    """

    strip: Strip
    length_px: float
    score: float


def weigh(strips: list[Strip], mask: Image, grid: Grid, plane: Plane) -> list[Evidence]:
    """The evidence for each guess that shows any paint."""
    if not strips:
        return []
    steep = np.array([s.steep for s in strips])[:, None]
    a = np.array([s.centre.a for s in strips])[:, None]
    b = np.array([s.centre.b for s in strips])[:, None]
    low = np.array([(s.low.a, s.low.b) for s in strips])
    high = np.array([(s.high.a, s.high.b) for s in strips])
    u0, u1 = _run(steep, a, b, plane)
    place = (np.arange(STATIONS) + 0.5) / STATIONS
    u = u0 + (u1 - u0) * place
    width = np.maximum(high[:, :1] - low[:, :1] + (high[:, 1:] - low[:, 1:]) * u, 0.5 * grid.step)
    norm = np.hypot(1.0, b)
    margin = 1.5 * grid.step * norm
    beside = margin + np.minimum(0.35 * width, 6.0 * grid.step * norm)
    offsets = np.concatenate(
        [
            _INSIDE * width[..., None],
            np.stack([-width / 2 - beside, -width / 2 - margin, width / 2 + margin, width / 2 + beside], -1),
        ],
        axis=-1,
    )
    v = (a + b * u)[..., None] + offsets
    painted, seen = _look_up(mask, grid, plane, steep[..., None], np.broadcast_to(u[..., None], v.shape), v)
    inside, inside_seen = painted[..., :6], seen[..., :6].sum(-1)
    filled = inside.sum(-1) >= 0.55 * np.maximum(inside_seen, 3)
    left = (painted[..., 6] + painted[..., 7]) == 0
    right = (painted[..., 8] + painted[..., 9]) == 0
    band = filled * (left * 0.5 + right * 0.5)
    found = []
    for k, strip in enumerate(strips):
        span = _span(filled[k], band[k])
        if span is None:
            continue
        first, last = span
        pitch = float(u1[k, 0] - u0[k, 0]) / STATIONS
        ends = float(u0[k, 0]) + pitch * first, float(u0[k, 0]) + pitch * last
        total = float(band[k, first:last].sum())
        lanes = inside[k, first:last][filled[k, first:last]].mean(axis=0)
        if lanes.min() < 0.3:
            continue
        length = total * pitch * float(norm[k, 0])
        support = float(filled[k, first:last].mean())
        new = replace(strip, u0=ends[0], u1=ends[1], support=support)
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
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Whether there is paint at each point, and whether the point is in the picture."""
    x, y = plane.raw(np.where(steep, v, u), np.where(steep, u, v))
    i = np.rint((x - float(grid.x(0))) / grid.step).astype(np.intp)
    j = np.rint((y - float(grid.y(0))) / grid.step).astype(np.intp)
    height, width = mask.shape
    seen = (i >= 0) & (i < width) & (j >= 0) & (j < height)
    painted = mask[np.clip(j, 0, height - 1), np.clip(i, 0, width - 1)] > 0
    return painted & seen, seen


def _span(filled: NDArray[np.bool_], band: Array) -> tuple[int, int] | None:
    """First and one past the last station of the band: its stations, and gaps no longer than its parts."""
    places = np.flatnonzero(filled)
    if len(places) == 0:
        return None
    breaks = np.flatnonzero(np.diff(places) > STATIONS // 4)
    starts = np.concatenate([[0], breaks + 1])
    ends = np.concatenate([breaks, [len(places) - 1]])
    sums = [float(band[places[s] : places[e] + 1].sum()) for s, e in zip(starts, ends, strict=True)]
    best = int(np.argmax(sums))
    if sums[best] <= 0:
        return None
    return int(places[starts[best]]), int(places[ends[best]]) + 1


def select(found: list[Evidence], shortest_px: float, known: list[Strip]) -> list[Strip]:
    """The bands that explain the paint: largest first, each one's paint counted once.

    Bands that `known` ones explain are left out.
    """
    kept: list[Strip] = []
    for evidence in sorted(found, key=lambda e: -e.score):
        strip = evidence.strip
        if evidence.length_px < max(shortest_px, 1.3 * strip.width_px):
            continue
        if _explained(strip, known + kept) <= 0.5:
            kept.append(strip)
    return kept


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


def shortest_length(plane: Plane) -> float:
    """Shortest band reported, in pixels."""
    return 0.08 * math.hypot(plane.width_px, plane.height_px)
