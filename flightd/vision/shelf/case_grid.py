"""How many cases are seen in the front of a regular stack: columns by rows, by the dark joints between them.

A joint is a line darker than both its sides.  Those between rows go through the whole front, those between
columns through every row, and both are evenly spaced.  Anything else (rows of different cases, one that is
not full, ribs of crates, a line that only some rows have) is no plain pattern, and nothing is told.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Final, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from flightd.core.inventory import CaseGrid
from flightd.core.types import Image
from flightd.vision.shelf.goods_front import equal_runs
from flightd.vision.shelf.opening_raster import BELOW_M, COLUMN_M, ROW_M

Floats: TypeAlias = NDArray[np.float32]
Mask: TypeAlias = NDArray[np.bool_]
Box: TypeAlias = tuple[float, float, float, float]

_LEAST_WIDTH_M, _LEAST_HEIGHT_M = 0.10, 0.12
"""Cases are no narrower and no lower; pallets are lower."""
_LEVEL_M: Final = 0.02
_LEAST_COLUMNS: Final = 4
"""A front's upper edge goes up and down by no more; what is narrower is a joint, or the edge of its end."""
_LEAST_TONE: Final = 0.25
"""Part of white below which joints are not told from what is beside them."""
_BLACK: Final = 0.01
_JOINT: Final = 0.15
_TRACE: Final = 0.06
"""Part by which a joint is darker than both its sides, and what may be one."""
_SIDES_PX: Final = (3, 7)
"""So far aside these are: joints are narrow or wide."""
_OFF_PX: Final = 5
"""Width in which a joint goes to and fro from case to case."""
_THROUGH, _FOOT, _STAIN, _FAINT = 0.62, 0.4, 0.45, 0.8
"""Parts of the front's width, or of a row's height: through which a joint goes at least, or the foot of the
lowest row; through which no other line does; and no trace of one."""
_SEEN_PART: Final = 0.3
_LEAST_ROWS: Final = 2
"""A joint's part that labels leave to be seen, and the rows in which it has to be."""
_APART_M: Final = 0.05
"""Lines that are closer to a joint are its own, or print along the edge of the cases."""
_SAME_PART, _SAME_M = 0.08, 0.012
"""Cases are of one size to this part of it, or to so much."""
_OFF_M: Final = 0.025
_POST_OFF_M: Final = 0.06
"""So far off may be where the front ends, and where an upright may hide its end."""
_PALLET_M: Final = (0.07, 0.17)
"""Heights at which the load on a pallet begins."""
_LABEL_M: Final = 0.02
"""A label's paper around its code."""


def case_grid(
    square: Image, white: float, tops_m: Floats, left: int, codes_m: Sequence[Box] = ()
) -> CaseGrid | None:
    """The cases in the front of what stands in an opening, None where they form no plain pattern.

    `square` is the opening's raster (`opening_raster`), `tops_m` the height of what stands in each of its
    columns after the first `left`, 0 for nothing; `codes_m` are the codes in it, whose labels hide joints."""
    front = _front(tops_m)
    if front is None:
        return None
    start, stop, top_m = front
    deck, wide = round(BELOW_M / ROW_M), round(COLUMN_M / ROW_M)
    x0_px = (start + left) * wide
    seen = square[deck : deck + round(top_m / ROW_M), x0_px : (stop + left) * wide]
    if min(seen.shape[:2]) < 2 * _LEAST_WIDTH_M / ROW_M:
        return None
    blue, green, red = cv2.split(seen)
    level = cv2.max(cv2.max(blue, green), red).astype(np.float32) / np.float32(white)
    if float(np.median(level)) < _LEAST_TONE:
        return None
    hidden = np.zeros(level.shape, np.bool_)
    for x0_m, low_m, x1_m, high_m in codes_m:
        x0, x1 = (round(x_m / ROW_M) - x0_px for x_m in (x0_m - _LABEL_M, x1_m + _LABEL_M))
        low, high = (round(z_m / ROW_M) for z_m in (low_m - _LABEL_M, high_m + _LABEL_M))
        hidden[max(low, 0) : max(high, 0), max(x0, 0) : max(x1, 0)] = True
    rows = _rows(_joints(level), hidden)
    if rows is None:
        return None
    columns = _columns(_joints(np.ascontiguousarray(level.T)), hidden.T, rows)
    return None if columns is None else CaseGrid(columns, len(rows))


def _front(tops_m: Floats) -> tuple[int, int, float] | None:
    """First column and the one after the last of the only front, and its height, where that is one; a wide
    joint may cut it in two."""
    stands = tops_m > 0.0
    if int(stands.sum()) < _LEAST_COLUMNS:
        return None
    top_m = float(np.median(tops_m[stands]))
    level = np.abs(tops_m - top_m) <= _LEVEL_M
    runs = [run for run in equal_runs(level.astype(np.intp)) if run[1] - run[0] >= _LEAST_COLUMNS]
    fronts = [run for run in runs if level[run[0]]]
    others = [run for run in runs if not level[run[0]] and stands[run[0] : run[1]].any()]
    return (fronts[0][0], fronts[-1][1], top_m) if fronts and not others else None


def _joints(level: Floats) -> Floats:
    """(rows, columns) by what part each pixel is darker than both what is above and below it, at the most
    nearby."""
    smooth = np.maximum(cv2.blur(level, (5, 1), borderType=cv2.BORDER_REPLICATE), np.float32(_BLACK))
    most = np.zeros(level.shape, np.float32)
    for aside in _SIDES_PX:
        sides = cv2.min(smooth[2 * aside :], smooth[: -2 * aside])
        drop = 1.0 - cv2.divide(smooth[aside:-aside], sides)
        most[aside:-aside] = cv2.max(most[aside:-aside], drop)
    return np.asarray(cv2.dilate(most, np.ones((_OFF_PX, 1), np.uint8)), np.float32)


def _through(drop: Floats, hidden: Mask, least: float) -> Floats:
    """(rows,) the part of each row, as far as it is not hidden, that is so much darker; NaN where too much of
    it is hidden."""
    free = ~hidden
    seen = free.sum(axis=1)
    part = ((drop >= least) & free).sum(axis=1) / np.maximum(seen, 1)
    return np.where(seen >= _SEEN_PART * drop.shape[1], part, np.nan).astype(np.float32)


def _peaks(part: Floats, least: float) -> list[int]:
    """The middles of where a profile is at least so high, of those close to each other the highest."""
    found: list[int] = []
    values = np.nan_to_num(part)
    reach = round(_APART_M / ROW_M)
    while float(values.max(initial=0.0)) >= least:
        at = int(values.argmax())
        top = values[at : at + 2 * _OFF_PX] >= values[at] - 0.02
        middle = at + (int(np.argmin(top)) if not top.all() else len(top)) // 2
        found.append(middle)
        values[max(middle - reach, 0) : middle + reach + 1] = 0.0
    return sorted(found)


def _alike(one: float, other: float) -> bool:
    return abs(one - other) <= max(_SAME_PART * max(one, other), _SAME_M / ROW_M)


def _rows(drop: Floats, hidden: Mask) -> list[tuple[int, int]] | None:
    """Lower and upper end of each row of cases, the highest first; None where they are no plain ones."""
    part = _through(drop, hidden, _JOINT)
    height, off = len(part), _OFF_M / ROW_M
    pallet = _PALLET_M[1] / ROW_M
    between = [at for at in _peaks(part, _THROUGH) if pallet < at < height - 2 * off]
    if not between:
        return None
    sizes = [float(upper - lower) for lower, upper in itertools.pairwise(between)]
    size = float(np.median(sizes)) if sizes else float(height - between[-1])
    even = all(_alike(other, size) for other in sizes)
    if size * ROW_M < _LEAST_HEIGHT_M or not even or abs(height - between[-1] - size) > off:
        return None
    foots: list[float] = [0, *(at for at in _peaks(part, _FOOT) if at <= pallet)]
    expected = between[0] - size
    foot = min(foots, key=lambda at: abs(at - expected))
    if abs(foot - expected) > off:
        if not sizes or not _PALLET_M[0] / ROW_M <= expected <= pallet:
            return None
        foot = expected  # on a pallet as light as they are
    edges = [round(foot), *between, height]
    if _is_faint(_through(drop, hidden, _TRACE)[edges[0] :], [at - edges[0] for at in edges]):
        return None
    return list(itertools.pairwise(edges))[::-1]


def _is_faint(trace: Floats, joints: Sequence[int]) -> bool:
    """Whether a line that may be one more joint goes all through between those that are known."""
    reach = round(_APART_M / ROW_M)
    rest = np.nan_to_num(trace)
    for at in joints:
        rest[max(at - reach, 0) : at + reach + 1] = 0.0
    return float(rest.max(initial=0.0)) >= _FAINT


def _columns(drop: Floats, hidden: Mask, rows: Sequence[tuple[int, int]]) -> int | None:
    """How many columns the rows have, None where they are not the same in all.  `drop` and `hidden` have a
    row for each column of the front."""
    width, margin = len(drop), round(_LEAST_WIDTH_M / 2 / ROW_M)
    inner = [slice(low + _SIDES_PX[0], high - _SIDES_PX[0]) for low, high in rows]
    known = np.array([_through(drop[:, row], hidden[:, row], _JOINT) for row in inner])
    near = np.ones((1, _OFF_PX + 2), np.uint8)
    spread = np.asarray(cv2.dilate(np.nan_to_num(known, nan=1.0), near), np.float32)
    seen = np.isfinite(known).sum(axis=0) >= _LEAST_ROWS
    joints = [at for at in _peaks(spread.min(axis=0) * seen, _THROUGH) if margin <= at < width - margin]
    if not joints or not np.isfinite(known[:, joints]).any(axis=1).all():
        return None  # a row of which labels hide every joint may have others
    reach = round(_APART_M / ROW_M)
    rest = np.nan_to_num(known).max(axis=0)
    rest[:margin] = rest[width - margin :] = 0.0
    for at in joints:
        rest[max(at - reach, 0) : at + reach + 1] = 0.0
    if float(rest.max()) >= _STAIN:
        return None
    traces = np.array([_through(drop[:, row], hidden[:, row], _TRACE) for row in inner])
    trace = np.nan_to_num(traces, nan=1.0).min(axis=0) * seen
    if _is_faint(trace.astype(np.float32), [0, *joints, width]):
        return None
    sizes = [float(right - left) for left, right in itertools.pairwise(joints)]
    outer = float(joints[0]), float(width - joints[-1])
    size = float(np.median(sizes)) if sizes else max(outer)
    if size * ROW_M < _LEAST_WIDTH_M or not all(_alike(other, size) for other in sizes):
        return None
    hidden_by_post, beyond = _POST_OFF_M / ROW_M, _OFF_M / ROW_M
    return len(joints) + 1 if all(-hidden_by_post <= end - size <= beyond for end in outer) else None
