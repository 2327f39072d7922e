"""Whether the bars of a linear code end where its read ends, or may go on: what is beside it is blank paper.

A weakly checked code is easily read in a part of a longer one: half of an EAN-13 is a UPC-E by its bars, any
stretch of bars may be an ITF.  Its own quiet zones tell them apart.  Where a label is torn or covered beside
the part, no bars go on there either, but what is seen there is not the paper that the bars are printed on.
Where a level line leaves tilted bars by their tips it meets blank paper, too: what is beside a code is looked
for across its bars.
"""

from __future__ import annotations

import math
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
"""ITF (ISO/IEC 16390), Codabar (EN 798), in their narrow elements."""
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
_LEAST_TALL_PX: Final = 9.0
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
    along = (corners[1] + corners[2] - corners[0] - corners[3]) / 2
    width_px = float(np.linalg.norm(along))
    if width_px < 1.0:
        return False
    across = _across_bars(grey, corners)
    across *= np.sign(across @ along) or 1.0
    begins, ends = _rows(corners, across)
    modules = _MODULES.get(symbology) or _modules_of(grey, begins, ends, symbology)
    if modules <= 0.0:
        return False
    module_px = float(across @ along) / modules
    inside = _sampled(grey, begins, ends - begins, round(modules * _STEPS))
    near = round(min(_NEAR_MODULES, modules) * _STEPS)
    left, right = (_KEPT * quiet for quiet in _QUIET.get(symbology, _OTHERS_QUIET))
    before = _sampled(grey, begins, -left * module_px * across, round(left * _STEPS))
    behind = _sampled(grey, ends, right * module_px * across, round(right * _STEPS))
    is_blank = _is_blank(before, inside[:, :near]) & _is_blank(behind, inside[:, -near:])
    return bool(np.count_nonzero(is_blank) >= _BLANK_ROWS)


def _across_bars(grey: Image, corners: Matrix) -> Matrix:
    """(2,) of length 1: the direction of most change where the code is."""
    (x0, y0), (x1, y1) = np.floor(corners.min(axis=0)) - 2, np.ceil(corners.max(axis=0)) + 3
    part = grey[max(int(y0), 0) : max(int(y1), 0), max(int(x0), 0) : max(int(x1), 0)]
    if min(part.shape) < 1:
        return np.array([1.0, 0.0])
    gx, gy = cv2.Scharr(part, cv2.CV_32F, 1, 0), cv2.Scharr(part, cv2.CV_32F, 0, 1)
    angle = math.atan2(2.0 * float((gx * gy).sum()), float((gx * gx - gy * gy).sum())) / 2
    return np.array([math.cos(angle), math.sin(angle)])


def _rows(corners: Matrix, across: Matrix) -> tuple[Matrix, Matrix]:
    """(rows, 2) px each: where rows of the read begin and end, from its upper to its lower edge."""
    (left, right), (low_left, low_right) = corners[[0, 1]], corners[[3, 2]]
    tall = (low_left + low_right - left - right) / 2
    if float(np.linalg.norm(tall)) < _LEAST_TALL_PX:
        tall = np.array([-across[1], across[0]]) * _LEAST_TALL_PX
        low_left, low_right = (left + low_left + tall) / 2, (right + low_right + tall) / 2
        left, right = low_left - tall, low_right - tall
    parts = np.linspace(0.05, 0.95, _ROWS)[:, None]
    return left + parts * (low_left - left), right + parts * (low_right - right)


def _sampled(grey: Image, starts: Matrix, ways: Matrix, count: int) -> _Values:
    """(rows, count) grey levels along each row's way, (rows, 2) or (2,) px; NaN outside of the picture."""
    at = starts[:, None] + np.linspace(0.0, 1.0, count)[None, :, None] * np.atleast_2d(ways)[:, None]
    x, y = at[..., 0].astype(np.float32), at[..., 1].astype(np.float32)
    found = cv2.remap(grey, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE).astype(np.float32)
    height, width = grey.shape
    found[(x < -0.5) | (y < -0.5) | (x > width - 0.5) | (y > height - 0.5)] = np.nan
    return np.asarray(found, np.float32)


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


def _modules_of(grey: Image, begins: Matrix, ends: Matrix, symbology: str) -> float:
    """About how many modules wide a code is by the number of its bars."""
    wide_px = float(np.linalg.norm(ends - begins, axis=1).mean())
    profile = np.median(_sampled(grey, begins, ends - begins, 2 * round(wide_px)), axis=0)
    if np.isnan(profile).any():
        return 0.0
    dark, light = np.percentile(profile, (10, 90))
    smooth = cv2.blur(profile[None].astype(np.float32), (3, 1))[0]
    is_bar = smooth < (dark + light) / 2
    mean = _ELEMENT_MODULES.get(symbology, _OTHERS_ELEMENT_MODULES)
    return mean * (1 + np.count_nonzero(np.diff(is_bar.astype(np.int8))))
