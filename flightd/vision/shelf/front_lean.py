"""How far a front leans to a side, by its two upright edges.

Each edge is where the brightness or the colour changes across the picture at the same place of the front all
the way up.  Both have to be seen, and to lean alike; else it is not known.
"""

from __future__ import annotations

import itertools
from typing import Final, TypeAlias

import cv2
import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from flightd.core.types import Image
from flightd.vision.shelf.opening_raster import BELOW_M, ROW_M

Floats: TypeAlias = NDArray[np.float32]

_BANDS: Final = 10
"""Parts of a front's height in each of which its edges are looked for."""
_PART: Final = (0.08, 0.92)
"""Of its height: nearer to its ends may be what these are off by."""
_LEAST_HEIGHT_M, _LEAST_WIDTH_M = 0.12, 0.08
"""A front that is lower or narrower has no edges to speak of."""
_LEAST_BAND_M: Final = 2 * ROW_M
"""A band that is lower may have no row of its own."""
_REACH_M: Final = 0.07
"""So far an edge is looked for from where the front is taken to end, and so far a top is aside at most."""
_STEP_M: Final = 0.0075
"""Half the distance over which a change counts."""
_LEAST_CHANGE: Final = 0.05
"""Part of white by which an edge changes at least, all its height taken together."""
_LEAST_BANDS: Final = 9
_SAME_PART: Final = 0.35
"""In so many bands the change has to be this part of that of all together."""
_ALIKE_M: Final = 0.01
"""The two edges of a front lean by no more differently."""


def front_lean_m(
    square: Image, white: float, ends_m: tuple[float, float], heights_m: tuple[float, float]
) -> float | None:
    """How far the top of a front is to the right of its foot, metres as it is seen; None where its edges do
    not tell.  `square` is the opening's raster (`opening_raster`), in which the front reaches from one of
    `ends_m` to the other, and from the first of `heights_m` above the deck to the second."""
    foot_m, top_m = heights_m
    if top_m < _LEAST_HEIGHT_M or top_m - foot_m < _LEAST_BAND_M * _BANDS:
        return None
    if ends_m[1] - ends_m[0] < _LEAST_WIDTH_M:
        return None
    change = _change(square, white, heights_m)
    found = [_edge(change, end_m) for end_m in ends_m]
    known = [lean for lean in found if lean is not None]
    if len(known) < len(found) or abs(known[0] - known[1]) > _ALIKE_M:
        return None
    return sum(known) / len(known) / (_PART[1] - _PART[0])


def _change(square: Image, white: float, heights_m: tuple[float, float]) -> Floats:
    """(bands, columns, 3) change to the right, as parts of white, in each band of the front's height."""
    deck, step = round(BELOW_M / ROW_M), round(_STEP_M / ROW_M)
    foot_m, top_m = heights_m
    low, high = (deck + round((foot_m + part * (top_m - foot_m)) / ROW_M) for part in _PART)
    rows = np.linspace(low, min(high, len(square)), _BANDS + 1).round().astype(int)
    bands = [
        cv2.reduce(square[begin:end], 0, cv2.REDUCE_AVG, dtype=cv2.CV_32F)[0]
        for begin, end in itertools.pairwise(rows.tolist())
    ]
    level = cv2.blur(np.array(bands, np.float32) / np.float32(white), (3, 1))
    padded = np.pad(level, ((0, 0), (step, step), (0, 0)), mode="edge")
    return np.asarray(padded[:, 2 * step :] - padded[:, : -2 * step], np.float32)


def _edge(change: Floats, end_m: float) -> float | None:
    """How far the edge near `end_m` is to the right in the highest band from where it is in the lowest."""
    reach = round(_REACH_M / ROW_M)
    leans = np.arange(-reach, reach + 1)
    # (leans, bands) how far aside of its middle an edge that leans so is in each band
    aside = np.round(leans[:, None] * ((np.arange(_BANDS) + 0.5) / _BANDS - 0.5)).astype(int)
    padded = np.pad(change, ((0, 0), (2 * reach, 3 * reach), (0, 0)))
    near = padded[:, round(end_m / ROW_M) :][:, : 4 * reach + 1]
    windows = sliding_window_view(near, len(leans), axis=1)  # (bands, leans, 3, columns)
    together = sum(windows[band, aside[:, band] + reach] for band in range(_BANDS)) / np.float32(_BANDS)
    size = np.sqrt((together**2).sum(axis=1))
    best, column = np.unravel_index(size.argmax(), size.shape)
    if size[best, column] < _LEAST_CHANGE or abs(int(leans[best])) == reach:
        return None
    direction = together[best, :, column] / size[best, column]
    seen = windows[np.arange(_BANDS), aside[best] + reach, :, column]
    alike = seen @ direction >= _SAME_PART * size[best, column]
    return float(leans[best]) * ROW_M if int(alike.sum()) >= _LEAST_BANDS else None
