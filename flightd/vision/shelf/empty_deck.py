"""Is the deck of a place on the shelf seen?  Then nothing stands there, dark as its goods may be.

From above, an empty place shows its deck as an even, lit strip from the front's edge up to where it is lost
in the dark.  How high the strip is tells how deep the deck is seen, which a pallet's boards or a bare front
do not come up to.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from flightd.core.scanning import Quad
from flightd.core.types import Image

Floats: TypeAlias = NDArray[np.float32]

_COLUMNS = 48
"""Samples across the deck."""
_LEAST_PX = 20.0
"""Expected height of the strip below which it is not looked for: the deck is seen too flat."""
_LEAST_PART = 0.95
"""Part of the expected height that must be seen as one strip: an empty deck is seen deeper than expected."""
_FOOT_PART = 0.175
"""Part of the core's height up to which a strip may be the front of something low: a tray, a pallet's board,
and what of the deck lies before it."""
_MISPLACED_PART = 0.2
"""How far the strip's near end may be from where it is expected, as a part of the core's height: the place is
known to a few centimetres."""
_MARGIN = 0.1
_LIT = 0.07
"""Part of white by which the deck is lighter than the core at least."""
_UNEVEN = 0.10
"""Part of white by which the pixels of one row of the strip may differ (nine tenths of them)."""
_STEP = 0.06
"""Part of white by which the colours of a strip's rows next but one to each other may differ."""


def would_show(deck: Quad, core_px: float) -> bool:
    """Whether the deck of an empty place can be told: the part of it in `deck`, as in `Place`, is seen from
    well enough above, beside the core, which is so high in the picture."""
    return bool(deck) and _height_px(deck) >= max(_LEAST_PX, _FOOT_PART * core_px)


def is_seen(picture: Image, deck: Quad, core: Image, white: float) -> bool:
    """Whether a picture, (H, W, 3) BGR of that white level, shows the deck of a place from its front to deep
    behind it.  `deck` is where that part of the deck is expected, `core` the core of the place's cell."""
    if not deck or not white > 0.0:
        return False
    centre = np.array(picture.shape[1::-1]) / 2 - 0.5
    corners = np.array(deck) + centre
    near, height_px = float(corners[2:, 1].mean()), _height_px(deck)
    if height_px < _LEAST_PX:
        return False
    span = float(corners[[0, 3], 0].max()), float(corners[[1, 2], 0].min())
    misplaced_px = _MISPLACED_PART * core.shape[0]
    colours, spread, top = _rows(picture, span, (near - 2.0 * height_px - misplaced_px, near + misplaced_px))
    least_px = max(_LEAST_PART * height_px, _FOOT_PART * core.shape[0])
    if len(colours) < least_px:
        return False
    dark = np.median(core.reshape(-1, 3), axis=0)
    lit = (colours - dark).mean(axis=1) > _LIT * white
    even = lit & (spread < _UNEVEN * white)
    even[1:-1] &= np.abs(colours[2:] - colours[:-2]).max(axis=1) < _STEP * white
    return any(
        stop - start + 2 >= least_px and abs(top + stop - near) <= misplaced_px for start, stop in _runs(even)
    )


def _height_px(deck: Quad) -> float:
    (_, far_left), (_, far_right), (_, near_right), (_, near_left) = deck
    return (near_left + near_right - far_left - far_right) / 2


def _rows(
    picture: Image, span: tuple[float, float], reach: tuple[float, float]
) -> tuple[Floats, Floats, int]:
    """(N, 3) colours of the rows within `reach`, (N,) spreads of their grey levels, and the first row."""
    margin = _MARGIN * (span[1] - span[0])
    x0, x1 = (int(np.clip(x, 0, picture.shape[1])) for x in (span[0] + margin, span[1] - margin))
    y0, y1 = (int(np.clip(y, 0, picture.shape[0])) for y in reach)
    if x1 - x0 < _COLUMNS // 4 or y1 - y0 < 3:
        return np.empty((0, 3), np.float32), np.empty(0, np.float32), y0
    columns = min(_COLUMNS, x1 - x0)
    strip = cv2.resize(picture[y0:y1, x0:x1], (columns, y1 - y0), interpolation=cv2.INTER_AREA)
    grey = cv2.cvtColor(strip, cv2.COLOR_BGR2GRAY).astype(np.float32)
    low, high = np.percentile(grey, (5.0, 95.0), axis=1)
    colours = np.median(strip, axis=1).astype(np.float32)
    return colours, (high - low).astype(np.float32), y0


def _runs(flags: NDArray[np.bool_]) -> Iterator[tuple[int, int]]:
    """First index of each run of true, and the first behind it."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    yield from ((int(start), int(stop)) for start, stop in edges.reshape(-1, 2))
