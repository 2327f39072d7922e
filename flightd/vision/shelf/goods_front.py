"""Up to where goods stand in an opening, column by column, from its raster.

Fronts show the aisle's light; what lies behind them, beside them and on top of them (the deck, the goods'
own sides, the mesh, the roof) is in the shade.  So a front goes from the deck up to where it is brighter
below than above, columns beside each other alike unless the picture says otherwise.  Dim fronts are told from
sides by where sides can be seen, from the hall past the rack by their structure and by where the deck is seen
(`footing`), and from what is behind by their outline (`dim_fronts`).
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Final, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from flightd.core.scanning import PlaceOpening
from flightd.vision.shelf.dim_fronts import risen
from flightd.vision.shelf.footing import Footing
from flightd.vision.shelf.opening_raster import COLUMN_M, ROW_M, deck_strip_m, largest

Floats: TypeAlias = NDArray[np.float32]
Indices: TypeAlias = NDArray[np.intp]

CLEAR_M: Final = 0.015
"""The first rows above the deck may be the beam, by what the pose is off."""
LOW_M: Final = 0.03
"""A front of less than this is none."""
SIDE_DEPTH_M: Final = 0.9
"""Sides and tops of goods are seen up to so far behind the rack's face."""
_BRIGHT: Final = 0.46
"""Part of white from which a pixel is surely of a front: nothing in the shade comes back so bright."""
_DIM: Final = (0.41, 0.34, 0.28)
"""Parts of white from which a pixel may be of a dim front, or of what stands in the shade."""
_SOFT: Final = 0.06
"""Part of white over which either is in doubt."""
_CHANGE_M: Final = 0.05
"""A front of another height beside this one has to gain so much, for a column."""
_SAME_M: Final = 0.04
"""Heights that differ by less are the same."""
_OPEN_PART: Final = 0.5
"""Part of a dim front's columns in which nothing but a front can be, for it to count as one."""
_OPEN_MORE: Final = 0.15
"""And of those in which it would be higher than what is known."""
_DECK_DEPTH_M: Final = 0.5
"""So deep the deck may be lit."""
_FINE_ROWS: Final = 17
"""Rows over which what is even is taken out of a surface's structure."""
_LEAST_FINE: Final = 0.0045
_FINE_PART: Final = 0.35
"""Structure as a part of white, and the part of the rows that show it on goods."""
_EDGE_M: Final = 0.025
"""So far from an edge it looks like structure."""


def fronts_m(colours: Floats, opening: PlaceOpening, left: int, foot: Footing) -> Floats:
    """(columns,) metres above the deck at which the front ends in each column of the opening, as it is seen;
    `left` columns are left out before the first.  `colours`, (rows, columns, 3), are of the rows from
    `CLEAR_M` above the deck on as parts of white, `foot` is what is seen of the deck."""
    level = largest(colours)
    bright, *dims = (tops.astype(np.intp) for tops in _tops(level, (_BRIGHT, *_DIM)))
    x_m = (np.arange(len(bright)) + left + 0.5) * COLUMN_M - opening.width_m / 2
    fine = np.abs(level - cv2.blur(level, (1, _FINE_ROWS)))
    beside = _beside(x_m, opening)
    for start, stop in equal_runs(bright):
        if beside[start:stop].mean() > _OPEN_PART:
            bright[start:stop] = _structured(fine[:, start:stop], 0, int(bright[start]))
    sides = _sides(bright, x_m, opening)
    fronts = bright.copy()
    low = round((max(deck_strip_m(opening, _DECK_DEPTH_M), 0.0) + _SAME_M - CLEAR_M) / ROW_M)
    high = len(level) - round(_SAME_M / ROW_M)
    for dim in dims:
        for start, stop in equal_runs(dim):
            top = int(dim[start])
            if not low <= top <= high:
                continue  # the deck, or what goes on behind the beam above
            shaded = beside[start:stop] | (sides[start:stop] >= top)
            if shaded.mean() > 1.0 - _OPEN_PART:
                continue
            more = start + np.flatnonzero(fronts[start:stop] < top)
            alike = (fronts[start:stop] < top) | (np.abs(fronts[start:stop] - top) * ROW_M <= _SAME_M)
            if not more.size or shaded[alike].mean() > 1.0 - _OPEN_MORE:
                continue
            known = int(np.median(fronts[more]))
            if _structured(fine[:, more], known, top) > known:
                fronts[more] = top
    fronts[foot.is_free & beside] = 0  # it is the hall, or stands in the next places
    fronts = risen(fronts, colours, foot.stands, (low, high))
    return np.where(fronts > 0, fronts * np.float32(ROW_M) + np.float32(CLEAR_M), np.float32(0.0)).astype(
        np.float32
    )


def _structured(fine: Floats, low: int, high: int) -> int:
    """Up to which row between two rows a surface has any structure, `low` where it has none: the hall's walls
    and floor, far out of focus, have none."""
    edge = round(_EDGE_M / ROW_M)
    if high - low <= 2 * edge:
        return high
    has = fine[low : high - edge].mean(axis=1) > _LEAST_FINE
    part = cv2.blur(has.astype(np.float32)[:, None], (1, 2 * edge))[:, 0]
    if has.mean() >= _FINE_PART and part[-edge:].max() >= _FINE_PART:
        return high
    found = np.flatnonzero(part >= _OPEN_PART)
    return low + int(found[-1]) + 1 if found.size else low


def _beside(x_m: Floats, opening: PlaceOpening) -> NDArray[np.bool_]:
    """(columns,) whether a side of what stands in the next places may be seen, or the hall past them."""
    half_m = opening.width_m / 2
    return _behind(x_m, -half_m, opening) | _behind(x_m, half_m, opening)


def _behind(x_m: Floats, end_m: float, opening: PlaceOpening) -> NDArray[np.bool_]:
    """(columns,) whether what goes straight into the rack from there is seen in that column."""
    eye_x, _, eye_y = opening.eye_m
    far = eye_y / (eye_y + SIDE_DEPTH_M)
    low, high = sorted((end_m, eye_x + (end_m - eye_x) * far))
    return np.asarray((x_m > low - COLUMN_M) & (x_m < high + COLUMN_M))


def _sides(bright: Indices, x_m: Floats, opening: PlaceOpening) -> Indices:
    """(columns,) up to which row a side of the goods in the place may be seen there, 0 for none."""
    sides = np.zeros(len(x_m), np.intp)
    _, eye_m, eye_y = opening.eye_m
    far = eye_y / (eye_y + SIDE_DEPTH_M)
    for start, stop in equal_runs(bright):
        top_m = bright[start] * ROW_M + CLEAR_M
        if top_m < LOW_M:
            continue
        reach_m = max(top_m, eye_m + (top_m - eye_m) * far) + _SAME_M
        for end_m in (float(x_m[start]) - COLUMN_M / 2, float(x_m[stop - 1]) + COLUMN_M / 2):
            seen = _behind(x_m, end_m, opening) & (bright * ROW_M + CLEAR_M < LOW_M)
            sides[seen] = np.maximum(sides[seen], round((reach_m - CLEAR_M) / ROW_M))
    return sides


def _tops(level: Floats, least: Sequence[float]) -> Indices:
    """(N, columns) rows from the lowest up that belong to a front whose pixels have one of `least` parts of
    white, 0 for none."""
    columns, pairs = level.shape[1], level.shape[0] // 2
    coarse = level[: 2 * pairs].reshape(pairs, 2, columns).mean(axis=1).T
    score = np.zeros((columns, len(least), pairs + 1), np.float32)
    for number, part in enumerate(least):
        np.cumsum(np.clip((coarse - part) / _SOFT, -1.0, 1.0), axis=1, out=score[:, number, 1:])
    change = np.float32(_CHANGE_M / (2 * ROW_M))
    stays = np.zeros(score.shape, np.bool_)
    comes = np.zeros(score.shape[:2], np.intp)
    total = score[0].copy()
    rows = np.arange(len(least))
    for column in range(1, columns):
        comes[column] = total.argmax(axis=1)
        other = (total[rows, comes[column]] - change)[:, None]
        stays[column] = total >= other
        total = np.maximum(total, other) + score[column]
    tops = np.zeros((len(least), columns), np.intp)
    tops[:, -1] = here = total.argmax(axis=1)
    for column in range(columns - 1, 0, -1):
        here = np.where(stays[column, rows, here], here, comes[column])
        tops[:, column - 1] = here
    return 2 * tops


def equal_runs(tops_m: Floats | Indices) -> list[tuple[int, int]]:
    """Start and stop of each run of equal heights."""
    cuts = [0, *(np.flatnonzero(np.diff(tops_m)) + 1).tolist(), len(tops_m)]
    return list(itertools.pairwise(cuts))
