"""Bands with their edges found on the full frame, and whether those edges are a painted line's."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from flightd.core.types import Image
from flightd.vision.lines.band import Array, Band, LinearFit, bisector
from flightd.vision.lines.edge_refinement import FINE, Edges, Taps, locate, rough, take
from flightd.vision.lines.line_fit import RobustLines, robust_lines
from flightd.vision.lines.undistortion import Plane

_CUTS_PX = (1.5, 0.7, 0.3)
_MIN_POINTS = 6.0
_MIN_WIDTH_PX = 2.5
_MIN_SHARE = 0.46
"""Of the stations that show paint between floor, the part at which the edges are where they should be."""
_WORST_CLEAR = 0.62
"""Crossings and gaps excuse missing edges down to this clear part; a chain of blobs has less."""
_COMPACT_ASPECT, _COMPACT_SHARE, _COMPACT_CLEAR, _COMPACT_FRAYED = 5.0, 0.14, 0.015, 0.4
"""Below this length to width a blob may pass for a band: each unit less asks for that much more share,
less excuse by its clear part, and edges as sharp as a short line's are."""
_USUAL_SCATTER_PX, _FRAYED_SHARE, _SHARP_SHARE = 0.7, 0.5, 0.2
"""A pixel of scatter more asks for so much more share, one less for so much less; points all over the
window, on no edge at all, have 1.4."""
_NO_EDGE, _SHARP_OF_NONE = 0.8, 0.5
"""Points that scatter so far where the other edge's do so by that part of it less are on no edge."""
_STEP, _GREY_STEP, _SAME = 0.06, 0.12, 0.03
"""Less than the first part of the one edge's contrast on the other one, or of a black or white band the
second: no band.  Nor is a black one that is lighter than the floor on one side and darker on the other by
more than the third."""
_SOFT, _DARKEST_SHADOW, _DARKEST_MARK, _GREY = 0.66, 0.55, 0.68, 1.2
"""Less than the first part of the contrast close to an edge is a penumbra, or paint blurred by motion; but
paint that is called black keeps less than the second part of the floor's light.  More than the third part is
what rubber and joints leave, however sharp, and no black paint.  Both take all channels alike, to within the
last."""
_MAX_BOW = 0.006
_MIN_BOW_PX = 1.2
_BOW_OF_WIDTH = 0.06
"""A short wide band whose middle is off by so small a part of its width is as straight as one can tell."""
_PLAIN_ASPECT, _PLAIN_LENGTH, _PLAIN_SUPPORT = 8.0, 0.45, 0.85
_PLAIN_CLEAR, _PARTLY_CLEAR, _PLAIN_SHARE = 0.8, 0.5, 0.3
"""A band is believed for its paint alone where it is so clear, or less where a part of its edges shows."""
_LENS_BOW = 0.004
_BOW_RMS = math.sqrt(4 / 45)
"""Root mean square of a parabola of sagitta one about its straight line."""


def refine(bgr: Image, strips: list[Band], plane: Plane, colour: str, reach_px: float) -> list[Band | None]:
    """Each band of the named colour with its edges located on the frame, or None where they are not a line's.

    `reach_px` is how far the guess may be off, measured along v.
    """
    if not strips:
        return []
    taps = take(bgr, strips, plane, math.ceil(reach_px) + FINE + 1)
    found = locate(taps, *rough(taps), plane)
    lines = robust_lines(found.u, found.v, found.weight, _CUTS_PX)
    stations = taps.row.shape[1]
    # An edge that leaves the picture is judged by the part of it that could be seen.
    visible = np.maximum(np.count_nonzero(taps.seen, axis=1), stations / 2)
    refined: list[Band | None] = []
    for k, strip in enumerate(strips):
        if _is_step(taps, 2 * k, colour) or _is_shadow(taps, found, 2 * k, colour):
            refined.append(None)
            continue
        edges = [
            e if taps.contrast[e] > taps.least_contrast and lines.points[e] >= _MIN_POINTS else None
            for e in (2 * k, 2 * k + 1)
        ]
        band = _judged(strip, lines, visible, edges)
        if band is None and (sharp := _without_none(edges, lines)) != edges:
            band = _judged(strip, lines, visible, sharp)
        if band is not None:
            refined.append(band if band.width_px >= _MIN_WIDTH_PX else None)
        elif _is_curve(strip, lines, edges):
            refined.append(None)
        else:
            refined.append(_unrefined(strip, _share(edges, lines, visible), plane))
    return refined


def _share(edges: list[int | None], lines: RobustLines, visible: Array) -> float:
    """The part of both edges that was found where it could be seen."""
    return sum(float(lines.points[e] / visible[e]) for e in edges if e is not None) / 2


def _judged(strip: Band, lines: RobustLines, visible: Array, edges: list[int | None]) -> Band | None:
    """The band between those edges, or None when they are no line's."""
    low, high = (None if e is None else lines.fit(e) for e in edges)
    band = _assemble(strip, low, high)
    if band is None:
        return None
    # Guessed or located: the wider is what it must not be, a blob.
    widest = max(strip.width_px, band.width_px)
    return band if _is_line(strip, widest, lines, _share(edges, lines, visible), edges) else None


def _is_step(taps: Taps, e: int, colour: str) -> bool:
    """Whether a band has floor of its own colour on one side, or is black and between two floors' light: the
    border of a shadow, or of another floor."""
    low, high = float(taps.contrast[e]), float(taps.contrast[e + 1])
    grey = colour in ("black", "white") and _is_grey(taps, e)
    shade = taps.shade[e : e + 2].mean(axis=1)
    between = grey and colour == "black" and shade.min() < 1.0 - _SAME and shade.max() > 1.0 + _SAME
    if not between and min(low, high) >= (_GREY_STEP if grey else _STEP) * max(low, high):
        return False
    return bool(np.count_nonzero(taps.seen[e : e + 2], axis=1).min() > taps.row.shape[1] / 2)


def _is_shadow(taps: Taps, found: Edges, e: int, colour: str) -> bool:
    """Whether a band is only darker than the floor, of no other colour: a shadow, soft at both edges, or for
    a black line too pale, the mark of a tyre or a joint."""
    shade = taps.shade[e : e + 2]
    is_soft = found.sharpness[e : e + 2].max() < _SOFT
    if not is_soft and colour != "black":
        return False
    if shade.min() <= (_DARKEST_SHADOW if is_soft else _DARKEST_MARK) or shade.max() >= 1.0:
        return False
    return _is_grey(taps, e)


def _is_grey(taps: Taps, e: int) -> bool:
    """Whether a band takes all of the floor's channels alike."""
    shade = taps.shade[e : e + 2]
    return bool((shade.max(axis=1) <= _GREY * shade.min(axis=1)).all())


def _without_none(edges: list[int | None], lines: RobustLines) -> list[int | None]:
    """The edges without one that is on nothing where the other is sharp: worn away, covered, or a join."""
    scatter = [math.inf if e is None else float(lines.scatter[e]) for e in edges]
    best, worst = min(scatter), max(scatter)
    if worst < _NO_EDGE or best > _SHARP_OF_NONE * worst:
        return edges
    return [e if of == best else None for e, of in zip(edges, scatter, strict=True)]


def _unrefined(strip: Band, share: float, plane: Plane) -> Band | None:
    """A long clear band is believed even where its edges are not straight: a lens nobody calibrated bends
    them, and chalk on grass has none.  It keeps the guess, good to what such a lens does."""
    shortest = max(_PLAIN_ASPECT * strip.width_px, _PLAIN_LENGTH * min(plane.width_px, plane.height_px))
    clear = _PLAIN_CLEAR if share < _PLAIN_SHARE else _PARTLY_CLEAR
    solid = strip.support >= _PLAIN_SUPPORT and strip.clear >= clear
    if not solid or strip.length_px < shortest or strip.width_px < _MIN_WIDTH_PX:
        return None
    off, turn = _LENS_BOW * strip.length_px, 2 * _LENS_BOW
    c = strip.centre
    return replace(strip, centre=replace(c, var_a=c.var_a + off * off, var_b=c.var_b + turn * turn))


def _is_curve(strip: Band, lines: RobustLines, edges: list[int | None]) -> bool:
    """Whether both edges bend the same way by more than a lens bends them.  They are followed only some
    pixels from a straight line: what bends further shows no more than that."""
    bows = [float(lines.bow[e]) for e in edges if e is not None]
    least = min(bows, key=abs, default=0.0)
    return len({bow > 0 for bow in bows}) == 1 and abs(least) > max(_MIN_BOW_PX, _LENS_BOW * strip.length_px)


def _is_line(strip: Band, width_px: float, lines: RobustLines, share: float, edges: list[int | None]) -> bool:
    """Two straight edges, or one that is seen all along; `share` is the part of both that was found."""
    seen = [e for e in edges if e is not None]
    aspect = strip.length_px / max(width_px, 1.0)
    bows = [float(lines.bow[e]) for e in seen]
    # A lens bends both edges the same way, which frays neither.
    bent = _BOW_RMS * min(map(abs, bows)) if len({b > 0 for b in bows}) == 1 else 0.0
    scatter = max(float(lines.scatter[e]) for e in seen)
    rough = math.sqrt(max(0.0, scatter * scatter - bent * bent)) - _USUAL_SCATTER_PX
    compact = max(0.0, _COMPACT_ASPECT - aspect)
    need = _MIN_SHARE + _COMPACT_SHARE * compact + _SHARP_SHARE * min(rough, 0.0)
    # Edges where there is no paint are something else's: then gaps are no excuse.
    if share <= strip.support:
        need *= max(_WORST_CLEAR + _COMPACT_CLEAR * compact, strip.clear)
    # Nor are they one for what is frayed where it is seen.
    need += (_FRAYED_SHARE + _COMPACT_FRAYED * compact) * max(rough, 0.0)
    if share < need:
        return False
    # A curve bends both edges the same way.
    bow = sum(bows) / len(bows)
    return abs(bow) <= max(_MIN_BOW_PX, _MAX_BOW * strip.length_px, _BOW_OF_WIDTH * width_px)


def _assemble(strip: Band, low: LinearFit | None, high: LinearFit | None) -> Band | None:
    """The band between its located edges; with one edge only, the guessed width stands in for the other;
    None with neither."""
    if low is not None and high is not None:
        centre = bisector(low, high)
    else:
        width = strip.high.at(0.0) - strip.low.at(0.0)
        spread = strip.low.var_a + strip.high.var_a
        if low is not None:
            high, centre = low.shifted(width, spread), low.shifted(width / 2, spread / 4)
        elif high is not None:
            low, centre = high.shifted(-width, spread), high.shifted(-width / 2, spread / 4)
        else:
            return None
    return replace(strip, centre=centre, low=low, high=high)
