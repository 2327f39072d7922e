"""Whether the bars of a linear code end where its read ends, or may go on: what is beside it is blank paper.

A weakly checked code is easily read in a part of a longer one: half of an EAN-13 is a UPC-E by its bars, any
stretch of bars may be an ITF.  Its own quiet zones tell them apart.  Where a label is torn or covered beside
the part, no bars go on there either, but what is seen there is not the paper that the bars are printed on.
"""

from __future__ import annotations

from typing import Final, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from flightd.core.geometry import Matrix
from flightd.core.types import Image

_Values: TypeAlias = NDArray[np.float32]

_MODULES: Final = {"UPC-E": 51, "EAN-8": 67}
_QUIET: Final = {"UPC-E": (9.0, 7.0), "EAN-8": (7.0, 7.0)}
"""Blank modules on the code's own left and right.  Source: ISO/IEC 15420."""
_OTHERS_QUIET: Final = (10.0, 10.0)
"""ITF (ISO/IEC 16390), Code 39 (ISO/IEC 16388), Codabar (EN 798), in their narrow elements."""
_ELEMENT_MODULES: Final = {"ITF": 1.7}
_OTHERS_ELEMENT_MODULES: Final = 1.5
"""Mean width of a bar or space of these: 1.4 to 1.8 in ITF for wide ones of two to three modules, in the
others 1.3 to 1.6."""
_KEPT: Final = 0.8
"""Part of its quiet zone that a printed label must have kept."""
_SHORT_MODULES: Final = 2.0
"""So far behind the end that is told the last bar and its blur may still show: where it leans in a blurred
picture, one end is told up to a module and a half too short."""
_ROWS: Final = 7
_LEAST_TALL_MODULES: Final = 3.0
"""A read may be told as thin as one row, bars are much taller."""
_BLANK_ROWS: Final = 5
_LEAST_CONTRAST: Final = 12.0
_MOST_DIP: Final = 0.3
"""Part of the code's contrast: a box of the colour of cardboard beside white paper is a dip of 0.4 and more,
a bar of one module seen through the blur at which codes are still read one of 0.4."""
_NEAR_MODULES: Final = 35
"""How much of a code's end tells the paper's level beside it."""
_STEPS: Final = 4
"""Samples for each module."""


def ends_in_quiet_zones(grey: Image, corners: Matrix, symbology: str) -> bool:
    """Whether most rows across a linear code of `grey` (H, W) find its paper blank at both ends, as far as
    its symbology wants it.  `corners` (4, 2) px are from the code's own left top, clockwise; what is outside
    of the picture is not blank."""
    ends = _rows_ends(corners)
    width_px = float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).mean())
    if width_px < 1.0:
        return False
    modules = _MODULES.get(symbology) or _modules_of(grey, ends, width_px, symbology)
    if modules <= 0.0:
        return False
    ends = _rows_ends(corners, _LEAST_TALL_MODULES * width_px / modules)
    left, right = _QUIET.get(symbology, _OTHERS_QUIET)
    inside = _sampled(grey, ends, 0.0, 1.0, round(modules * _STEPS))
    near = round(min(_NEAR_MODULES, modules) * _STEPS)
    begins = _is_blank(_zone(grey, ends[:, ::-1], left, modules), inside[:, :near])
    stops = _is_blank(_zone(grey, ends, right, modules), inside[:, -near:])
    return bool(np.count_nonzero(begins & stops) >= _BLANK_ROWS)


def _rows_ends(corners: Matrix, least_tall_px: float = 0.0) -> Matrix:
    """(rows, 2, 2) px: the left and the right end of rows across the bars, from top to bottom."""
    top, bottom = corners[[0, 1]], corners[[3, 2]]
    middle, half = (top + bottom) / 2, (bottom - top) / 2
    tall_px = 2 * float(np.linalg.norm(half, axis=1).mean())
    if tall_px < least_tall_px:
        along = middle[1] - middle[0]
        half = np.array([[-along[1], along[0]]] * 2) / np.linalg.norm(along) * least_tall_px / 2
    return np.asarray(middle + np.linspace(-0.9, 0.9, _ROWS)[:, None, None] * half)


def _sampled(grey: Image, ends: Matrix, begin: float, end: float, count: int) -> _Values:
    """(rows, count) grey levels between two parts of each row's length; NaN outside of the picture."""
    parts = np.linspace(begin, end, count)[None, :, None]
    at = ends[:, :1] + parts * (ends[:, 1:] - ends[:, :1])
    x, y = at[..., 0].astype(np.float32), at[..., 1].astype(np.float32)
    found = cv2.remap(grey, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE).astype(np.float32)
    height, width = grey.shape
    found[(x < -0.5) | (y < -0.5) | (x > width - 0.5) | (y > height - 0.5)] = np.nan
    return np.asarray(found, np.float32)


def _zone(grey: Image, ends: Matrix, quiet: float, modules: float) -> _Values:
    """(rows, samples) of what is to be blank, outwards from the second end of each row."""
    wide = _KEPT * quiet
    return _sampled(grey, ends, 1.0, 1.0 + wide / modules, round(wide * _STEPS))


def _is_blank(zone: _Values, inside: _Values) -> NDArray[np.bool_]:
    """(rows,) whether a zone, its last bar aside, is nowhere darker than the paper between the bars beside
    it, nor dips."""
    dark, light = np.percentile(inside, (5, 95), axis=1)
    contrast = light - dark
    brightest = np.maximum(light, np.percentile(zone, 90, axis=1))
    # what lies outside of the picture is NaN, and no comparison with that holds
    is_paper = zone >= (brightest - _MOST_DIP * contrast)[:, None]
    begin = is_paper.argmax(axis=1)
    blank = is_paper.sum(axis=1) == zone.shape[1] - begin
    return np.asarray(blank & (begin <= _SHORT_MODULES * _STEPS) & (contrast >= _LEAST_CONTRAST))


def _modules_of(grey: Image, ends: Matrix, width_px: float, symbology: str) -> float:
    """About how many modules wide a code is by the number of its bars."""
    profile = np.median(_sampled(grey, ends, 0.0, 1.0, 2 * round(width_px)), axis=0)
    if np.isnan(profile).any():
        return 0.0
    dark, light = np.percentile(profile, (10, 90))
    smooth = cv2.blur(profile[None].astype(np.float32), (3, 1))[0]
    is_bar = smooth < (dark + light) / 2
    mean = _ELEMENT_MODULES.get(symbology, _OTHERS_ELEMENT_MODULES)
    return mean * (1 + np.count_nonzero(np.diff(is_bar.astype(np.int8))))
