"""Is a place on the shelf empty, are there goods, or is it covered?  From its cell in a picture.

Goods that stand in a place fill the core of its cell, so an empty one shows there what lies behind: the dark
of the rack.  But goods may be as dark as that.  So a place is empty only where, besides, there is something
to see in that dark (mesh, other goods' backs: a dark face shows nothing) and the deck is seen from the front
on to deep behind it (`deck`), which goods hide.
Goods have faces that catch the light, with edges; a cover (a sheet, foil) catches the light and is smooth.
Dark means dark against white paper in the same light, so exposure does not matter.  What fits no
case is `UNSURE`: an empty place is never guessed.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np

from flightd.core.scanning import Light, Occupancy
from flightd.core.types import Image

_SAMPLES = 96
"""Longer side at which a core is looked at: a few millimetres to the pixel."""
_SMALLEST_PX = 12
_WHITE_SHARE = 99.5
_LABEL_SHARE = 95.0
"""So much of a label is ink, or less light than its paper."""
_LEAST_WHITE = 110.0
"""A picture without anything lighter has no paper in it, and white is not known."""
_BURNT, _BURNT_PART = 250, 0.001
"""A place is burnt out where more than this part of its pixels is at least so light."""
_DARK = 0.23
"""Part of white below which a pixel is dark."""
_STEP = 0.035
"""Part of white by which neighbouring pixels on an edge differ at least."""
_EMPTY_DARK, _EMPTY_EDGES = 0.38, 0.10
_GOODS_DARK = 0.30
_COVER_EDGES = 0.01
_LEAST_GRAIN, _LEAST_GRAIN_LEVELS = 0.0115, 1.8
"""Finer structure that the dark of an empty place has at least, as a part of white and in grey levels: less
is a camera's noise."""
_GRAIN_SAMPLES = 9
"""Samples over which what is even is taken out of the grain."""


@dataclass(frozen=True, slots=True)
class CoreMeasures:
    """Shares of a core, 0..1: of `dark` pixels, and of pixels on `edges`; `grain` is the standard deviation
    of its finer structure as a part of white."""

    dark: float
    edges: float
    grain: float


def known_white(level: float) -> float:
    """The grey level of what is taken for white paper; NaN where it is too dark to tell anything by."""
    return level if level >= _LEAST_WHITE else float("nan")


def paper_level(code: Image) -> float:
    """The grey level of the paper on which a code, (H, W, 3) BGR, is printed."""
    return float(np.percentile(cv2.cvtColor(code, cv2.COLOR_BGR2GRAY), _LABEL_SHARE))


def lightest(picture: Image) -> float:
    """The grey level that hardly anything in a picture, (H, W, 3) BGR, is above."""
    grey = cv2.cvtColor(np.ascontiguousarray(picture[::4, ::4]), cv2.COLOR_BGR2GRAY)
    up_to = np.cumsum(cv2.calcHist([grey], [0], None, [256], [0, 256]).ravel())
    rank = (grey.size - 1) * _WHITE_SHARE / 100
    low, high = np.searchsorted(up_to, (math.floor(rank), math.ceil(rank)), side="right")
    return float(low + (high - low) * (rank % 1.0))


def light_on(cell: Image, white: float) -> Light:
    """How a cell, (H, W, 3) BGR, comes out in a picture of that white level."""
    if not white >= _LEAST_WHITE:
        return Light.DIM
    if not cell.size:
        return Light.FAIR
    burnt = cv2.countNonZero(cv2.inRange(cell, (_BURNT,) * 3, (255,) * 3))
    return Light.BURNT if burnt > _BURNT_PART * cell.shape[0] * cell.shape[1] else Light.FAIR


def measure(core: Image, white: float) -> CoreMeasures:
    """Measures of a core, (H, W, 3) BGR, in a picture of that white level."""
    grey = cv2.cvtColor(core, cv2.COLOR_BGR2GRAY)
    scale = min(1.0, _SAMPLES / max(grey.shape))
    size = max(1, round(grey.shape[1] * scale)), max(1, round(grey.shape[0] * scale))
    level = cv2.resize(grey, size, interpolation=cv2.INTER_AREA).astype(np.float32)
    gx, gy = cv2.Sobel(level, cv2.CV_32F, 1, 0, scale=1 / 8), cv2.Sobel(level, cv2.CV_32F, 0, 1, scale=1 / 8)
    steep = cv2.magnitude(gx, gy) > _STEP * white
    fine = level - cv2.blur(level, (_GRAIN_SAMPLES, _GRAIN_SAMPLES))
    dark = float((level < _DARK * white).mean())
    return CoreMeasures(dark, float(steep.mean()), float(fine.std()) / white)


def judge(core: Image, white: float, sees_deck: Callable[[], bool]) -> Occupancy:
    """What the core of one cell shows; `sees_deck`: the deck before it is seen (`deck.is_seen`), asked only
    where that matters."""
    if min(core.shape[:2]) < _SMALLEST_PX or not white >= _LEAST_WHITE:
        return Occupancy.UNSURE
    seen = measure(core, white)
    if seen.dark > _EMPTY_DARK and seen.edges < _EMPTY_EDGES:
        shows = seen.grain > max(_LEAST_GRAIN, _LEAST_GRAIN_LEVELS / white)
        return Occupancy.EMPTY if shows and sees_deck() else Occupancy.UNSURE
    if seen.dark < _GOODS_DARK and seen.edges < _COVER_EDGES:
        return Occupancy.COVERED
    return Occupancy.GOODS if seen.dark < _GOODS_DARK or seen.edges > 2 * _EMPTY_EDGES else Occupancy.UNSURE
