"""Is a place on the shelf empty, are there goods, or is it covered?  From the core of its cell in a picture.

Goods that stand in a place fill the core of its cell, so an empty one shows there what lies behind: the dark
of the rack.  Goods have faces that catch the light, with edges; a cover (a sheet, foil) catches the light
and is smooth.  Dark means dark against the white of paper in the same picture, so exposure does not matter.
What fits no case is `UNSURE`: an empty place is never guessed.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from flightd.core.scanning import Occupancy
from flightd.core.types import Image

_SAMPLES = 96
"""Longer side at which a core is looked at: a few millimetres to the pixel."""
_SMALLEST_PX = 12
_WHITE_SHARE = 99.5
_LEAST_WHITE = 110.0
"""A picture without anything lighter has no paper in it, and white is not known."""
_DARK = 0.23
"""Part of white below which a pixel is dark."""
_STEP = 0.035
"""Part of white by which neighbouring pixels on an edge differ at least."""
_EMPTY_DARK, _EMPTY_EDGES = 0.38, 0.10
_GOODS_DARK = 0.30
_COVER_EDGES = 0.01


@dataclass(frozen=True, slots=True)
class CoreMeasures:
    """Shares of a core, 0..1: of `dark` pixels, and of pixels on `edges`."""

    dark: float
    edges: float


def white_level(picture: Image) -> float:
    """The grey level of white paper in a picture, (H, W, 3) BGR; NaN where nothing is so light."""
    grey = cv2.cvtColor(np.ascontiguousarray(picture[::4, ::4]), cv2.COLOR_BGR2GRAY)
    white = float(np.percentile(grey, _WHITE_SHARE))
    return white if white >= _LEAST_WHITE else float("nan")


def measure(core: Image, white: float) -> CoreMeasures:
    """Measures of a core, (H, W, 3) BGR, in a picture of that white level."""
    grey = cv2.cvtColor(core, cv2.COLOR_BGR2GRAY)
    scale = min(1.0, _SAMPLES / max(grey.shape))
    size = max(1, round(grey.shape[1] * scale)), max(1, round(grey.shape[0] * scale))
    level = cv2.resize(grey, size, interpolation=cv2.INTER_AREA).astype(np.float32)
    gx, gy = cv2.Sobel(level, cv2.CV_32F, 1, 0, scale=1 / 8), cv2.Sobel(level, cv2.CV_32F, 0, 1, scale=1 / 8)
    steep = cv2.magnitude(gx, gy) > _STEP * white
    return CoreMeasures(float((level < _DARK * white).mean()), float(steep.mean()))


def judge(core: Image, white: float) -> Occupancy:
    """What the core of one cell shows."""
    if min(core.shape[:2]) < _SMALLEST_PX or not white >= _LEAST_WHITE:
        return Occupancy.UNSURE
    seen = measure(core, white)
    if seen.dark > _EMPTY_DARK and seen.edges < _EMPTY_EDGES:
        return Occupancy.EMPTY
    if seen.dark < _GOODS_DARK and seen.edges < _COVER_EDGES:
        return Occupancy.COVERED
    return Occupancy.GOODS if seen.dark < _GOODS_DARK or seen.edges > 2 * _EMPTY_EDGES else Occupancy.UNSURE
