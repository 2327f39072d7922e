"""Is there a painted band where a method says so?  Counts paint inside and floor beside each guess.

Everything is looked up in the small mask at stations along each guess's whole run through the picture, so
that a guess made from part of a band gets the band's true span, gaps included.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from flightd.core.types import Image
from flightd.vision.lines.band import Array, Band
from flightd.vision.lines.colour_profile import STRONG, WEAK, Levels, has_seeds
from flightd.vision.lines.sampling import OUTSIDE, PAINT, Grid, look_up
from flightd.vision.lines.undistortion import Plane, shortest_length

STATIONS = 48
_INSIDE = np.array([-0.42, -0.25, -0.08, 0.08, 0.25, 0.42])
"""Where the paint is looked for, in widths from the centre line."""
_TAPS = np.zeros((4, 10))
_TAPS[0] = 1.0
_TAPS[1, :6] = _INSIDE
_TAPS[2, 6:] = -1.0, 0.0, 0.0, 1.0
_TAPS[3, 6:] = 0.0, -1.0, 1.0, 0.0
"""The points across a band, from its centre line, the width inside which paint is looked for, and the farther
and the nearer distance at which floor is: six points inside, two on its one side, two on its other."""
_PARTS = np.zeros((10, 3), np.float32)
_PARTS[:6, 0] = _PARTS[6:8, 1] = _PARTS[8:, 2] = 1.0
"""Which of the points across a band lie inside it, and which on its one and other side."""
_BOTH_SIDES = np.ones(2, np.float32)
_PLACES = ((np.arange(STATIONS) + 0.5) / STATIONS).astype(np.float32)
_FAR = 1e4
"""Samples from the first beyond which a lens model may put anything."""
_SHARED = 16
"""Stations at which a guess is asked whether it is another's."""
_GAP = bytes(STATIONS // 4)
"""So many stations without paint, or more, part a band in two, of which the larger one counts."""
_FAINT_STRONG, _FAINT_FILLED, _FAINT_LENGTH = 0.12, 0.8, 0.3
"""Less than the first part of a band is strong and less than the second weak or strong: it is faint.  One
that is shorter than this part of the picture's diagonal is then something of a similar colour."""


_Run: TypeAlias = tuple[float, float]
"""From where to where along u a band is looked at."""
_Law: TypeAlias = tuple[float, float]
_Laws: TypeAlias = tuple[_Law, _Law, _Law, _Law]


@dataclass(frozen=True, slots=True)
class Evidence:
    """A guess with its true span, and how much of a band it is.

    `length_px` is the length that shows paint inside and floor on both sides (one side counts half);
    `score` is the area of that.
    """

    strip: Band
    length_px: float
    score: float


def weigh(strips: list[Band], mask: Image, grid: Grid, plane: Plane) -> list[Evidence]:
    """The evidence for each guess that shows any paint."""
    if not strips:
        return []
    runs = [strip.run(plane.width_px, plane.height_px) for strip in strips]
    laws = [_across(strip, grid.step, run) for strip, run in zip(strips, runs, strict=True)]
    found = _looks(mask, strips, runs, laws, grid, plane)
    looks = np.empty((2, *found.shape), np.float32)
    looks[0], looks[1] = found == PAINT, found != OUTSIDE
    painted = looks[0]
    counts, points = looks @ _PARTS
    filled = counts[..., 0] >= 0.55 * np.maximum(points[..., 0], 3)
    band = filled * (1.0 - 0.5 * np.minimum(counts[..., 1:], 1.0) @ _BOTH_SIDES)
    evidence = []
    for k, strip in enumerate(strips):
        span = _span(filled[k], band[k])
        if span is None:
            continue
        stretch = slice(*span)
        places = filled[k, stretch].astype(np.float32)
        each = (places @ painted[k, stretch, :6]).tolist()
        count = int(np.add.reduce(places))
        if min(each) < 0.3 * count:
            continue
        first, last = runs[k]
        pace, stations = (last - first) / STATIONS, span[1] - span[0]
        clear = float(np.add.reduce(band[k, stretch])) / stations
        u0, u1 = first + pace * span[0], first + pace * span[1]
        new = Band(strip.steep, strip.centre, strip.low, strip.high, u0, u1, count / stations, clear)
        length = clear * stations * pace / strip.cosine
        evidence.append(Evidence(new, length, length * min(new.width_px, length)))
    return evidence


def _across(strip: Band, step: int, run: _Run) -> _Laws:
    """What `_TAPS` are taken of, each as (a, b) of v = a + b u: the centre line, the width inside which paint
    is looked for, and the farther and the nearer distance at which floor is."""
    a, b = strip.high.a - strip.low.a, strip.high.b - strip.low.b
    middle = max(a + b * (strip.u0 + strip.u1) / 2, 0.5 * step)
    if min(a + b * run[0], a + b * run[1]) < 0.5 * step:
        a, b = middle, 0.0  # the edges would cross
    sample = step / strip.cosine
    margin = 1.5 * sample
    # Samples on the very edge may be either: look half a sample inside it.
    inner = (a - sample, b) if middle - sample > 0.25 * middle else (0.25 * a, 0.25 * b)
    beside = (0.35 * a, 0.35 * b) if 0.35 * middle < 6.0 * sample else (6.0 * sample, 0.0)
    near = (a / 2 + margin, b / 2)
    return (strip.centre.a, strip.centre.b), inner, (near[0] + beside[0], near[1] + beside[1]), near


def _looks(
    table: Image, strips: list[Band], runs: list[_Run], laws: list[_Laws], grid: Grid, plane: Plane
) -> Image:
    """(N, STATIONS, 10) values of a mask or of levels at the stations of each run, at all taps."""
    parts = [_parts(*each) for each in zip(strips, runs, laws, strict=True)]
    taps = _TAPS.T @ np.array(parts).reshape(-1, 2, 4, 2)
    if plane.is_identity:
        taps[:, 0] -= grid.first
        taps *= 1 / grid.step
    begin, way = taps.astype(np.float32).swapaxes(0, 1)[:, :, None]
    places = begin + _PLACES[:, None, None] * way
    if not plane.is_identity:
        places = grid.places(*plane.raw(places[..., 0], places[..., 1]))
    count = len(strips)
    return look_up(table, places.reshape(count * STATIONS, 10, 2)).reshape(count, STATIONS, 10)


def _parts(strip: Band, run: _Run, laws: _Laws) -> tuple[float, ...]:
    """(2, 4, 2), flat: x and y of the four laws at the beginning of the run, and how far they go to its
    end."""
    u, length = run[0], run[1] - run[0]
    (a0, b0), (a1, b1), (a2, b2), (a3, b3) = laws
    v0, v1, v2, v3 = a0 + b0 * u, a1 + b1 * u, a2 + b2 * u, a3 + b3 * u
    d0, d1, d2, d3 = b0 * length, b1 * length, b2 * length, b3 * length
    if strip.steep:
        return v0, u, v1, 0.0, v2, 0.0, v3, 0.0, d0, length, d1, 0.0, d2, 0.0, d3, 0.0
    return u, v0, 0.0, v1, 0.0, v2, 0.0, v3, length, d0, 0.0, d1, 0.0, d2, 0.0, d3


def _span(filled: NDArray[np.bool_], band: Array) -> tuple[int, int] | None:
    """First and one past the last station of the band: its stations, and gaps no longer than its parts."""
    marks = filled.tobytes()
    first, last = marks.find(1), marks.rfind(1) + 1
    if last == 0:
        return None
    if marks.find(_GAP, first, last) < 0:
        return first, last
    places = np.flatnonzero(filled)
    breaks = np.flatnonzero(places[1:] - places[:-1] > len(_GAP))
    starts, ends = [0, *(breaks + 1)], [*breaks, len(places) - 1]
    parts = [(int(places[s]), int(places[e]) + 1) for s, e in zip(starts, ends, strict=True)]
    return max(parts, key=lambda part: float(band[part[0] : part[1]].sum()))


def select(found: list[Evidence], shortest_px: float, known: list[Band]) -> list[Band]:
    """The bands that explain the paint: largest first, each one's paint counted once.

    Bands that `known` ones explain are left out.
    """
    kept: list[Band] = []
    for evidence in sorted(found, key=lambda e: -e.score):
        strip = evidence.strip
        if strip.length_px < 1.3 * strip.width_px:
            continue
        if evidence.length_px < max(shortest_px, 0.6 * strip.width_px):
            continue
        if _explained(strip, known + kept) <= 0.5:
            kept.append(strip)
    return kept


def is_paint_left(mask: Image, strips: list[Band], grid: Grid, plane: Plane) -> bool:
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
        corners = np.rint(np.clip(grid.places(x, y), -_FAR, _FAR)).astype(np.int32)
        cv2.fillConvexPoly(left, corners, 0)
    return cv2.countNonZero(left) * grid.step >= shortest_length(plane)


def without_faint(strips: list[Band], levels: Levels, grid: Grid, plane: Plane) -> list[Band]:
    """The strips without short ones of a colour that is only like the paint's: lettering, dirt, goods.

    Worn paint is strong between its holes, and what bad light leaves of a line is long.  Where next to no
    paint is strong, that says nothing.
    """
    enough = _FAINT_LENGTH * math.hypot(plane.width_px, plane.height_px)
    faint = [s for s in strips if s.length_px < enough and _is_faint(s, levels, grid, plane)]
    return [s for s in strips if s not in faint] if faint and has_seeds(levels) else strips


def _is_faint(strip: Band, levels: Levels, grid: Grid, plane: Plane) -> bool:
    low, high, centre = strip.low, strip.high, strip.centre
    laws = ((centre.a, centre.b), (high.a - low.a, high.b - low.b), (0.0, 0.0), (0.0, 0.0))
    found = _looks(levels, [strip], [(strip.u0, strip.u1)], [laws], grid, plane)[..., : len(_INSIDE)]
    count = max(int(np.count_nonzero(found != OUTSIDE)), 1)
    strong, weak = np.count_nonzero(found == STRONG), np.count_nonzero(found == WEAK)
    return bool(strong < _FAINT_STRONG * count and strong + weak < _FAINT_FILLED * count)


def _explained(strip: Band, others: list[Band]) -> float:
    """The part of the strip's centre line that lies in the others' bands."""
    if not others:
        return 0.0
    a, b, pace = strip.centre.a, strip.centre.b, (strip.u1 - strip.u0) / _SHARED
    u = strip.u0 + 0.5 * pace
    covered: set[int] = set()
    for other in others:
        reach = 0.6 * other.width_px / other.cosine + 4.0
        middle, slope = other.centre.a, other.centre.b
        # The strip's stations in the other's own axes: s along it and off across it, both linear in k.
        (s, s_pace), (t, t_pace) = (u, pace), (a + b * u, b * pace)
        if strip.steep != other.steep:
            (s, s_pace), (t, t_pace) = (t, t_pace), (s, s_pace)
        along = _between(s, s_pace, other.u0 - reach, other.u1 + reach)
        across = _between(t - middle - slope * s, t_pace - slope * s_pace, -reach, reach)
        covered.update(range(max(along[0], across[0]), min(along[1], across[1])))
    return len(covered) / _SHARED


def _between(first: float, pace: float, least: float, most: float) -> tuple[int, int]:
    """The stations k, from and to before, at which first + k pace lies in [least, most]."""
    if abs(pace) < 1e-9:
        return (0, _SHARED) if least <= first <= most else (0, 0)
    one, other = (least - first) / pace, (most - first) / pace
    if pace < 0:
        one, other = other, one
    return max(math.ceil(one), 0), min(math.floor(other) + 1, _SHARED)
