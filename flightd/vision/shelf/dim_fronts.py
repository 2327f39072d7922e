"""Fronts that are no lighter than what stands in the shade: black boxes beside white ones, green crates on a
light pallet.  Where the deck shows that a front stands (`footing`), its outline tells how high.

Its upper edge is level.  Below that it is lit, more than anything at the back; its ends are upright edges,
all the way up from the deck or beside a front as high; and what is known of it does not end as high as what
stands beside it, for then that is its top, and the level edge above is behind it.
"""

from __future__ import annotations

from typing import Final, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from flightd.vision.shelf.opening_raster import ROW_M, largest

Floats: TypeAlias = NDArray[np.float32]
Flags: TypeAlias = NDArray[np.bool_]
Indices: TypeAlias = NDArray[np.intp]

_STEP: Final = 0.035
"""Part of white by which colours differ on both sides of an edge."""
_MOST_STEP: Final = 0.1
"""A greater step counts as this."""
_LIT: Final = 0.19
_LEAST_LEVEL: Final = 0.225
"""Parts of white that most of a front's pixels have, and half of them: goods at the back have less."""
_PART: Final = 0.7
"""Part of a front that has to be so lit."""
_UPRIGHT_PART: Final = 0.6
"""Part of an upright edge that has to be seen, in its lower half and in its upper one."""
_BELOW_ROWS: Final = round(0.03 / ROW_M)
"""Rows below the upper edge that are looked at for themselves, and by which a front rises at least."""
_FOOT_ROWS: Final = 4
_LEAST_ROWS: Final = 8
"""Rows above the deck from which an upright edge is looked for, and how high it is at least."""
_ALIKE_ROWS: Final = 4
"""Fronts are as high as each other up to this difference."""
_LEAST_COLUMNS: Final = 4
_GAP_COLUMNS: Final = 3
_WIDE_PART: Final = 0.6
"""Fronts are not narrower than the first, gaps in an edge narrower than the second; a front of the third part
of the opening may be hidden by its end."""
_HOLE_COLUMNS: Final = 13
"""Narrower gaps between the columns in which a front stands, and in which goods are seen, are its own."""
_BESIDE_COLUMNS: Final = 5
_GOES_ON_COLUMNS: Final = 3
"""A front goes on where so many of the columns next to it end as high."""


def risen(fronts: Indices, colours: Floats, stands: Flags, reach: tuple[int, int]) -> Indices:
    """(columns,) rows up to which fronts go, of which `fronts` are known; `colours`, (rows, columns, 3), are
    of the rows above the deck as parts of white, `stands` are the columns in which a front is seen to stand,
    and the tops of dim ones are looked for from the first row of `reach` up to the second."""
    if not stands.any():
        return fronts
    holes = cv2.morphologyEx(
        stands.astype(np.uint8)[None], cv2.MORPH_CLOSE, np.ones((1, _HOLE_COLUMNS), np.uint8)
    )
    stands = stands | ((holes[0] > 0) & (fronts > 0))
    outlines = _Outlines(colours)
    found = fronts.copy()
    for row in outlines.edge_rows(stands, reach):
        free = stands & (found < row - _BELOW_ROWS)
        if int(free.sum()) < _LEAST_COLUMNS:
            continue
        for start, stop in _segments(outlines.is_level[row] & free, free):
            known = int(np.median(fronts[start:stop]))
            if (
                outlines.is_lit(known, row, start, stop)
                and outlines.has_ends(found, known, row, start, stop)
                and not outlines.goes_on(fronts, known, start, stop)
            ):
                found[start:stop] = row
    return found


class _Outlines:
    """The edges in an opening, and how lit it is, of (rows, columns, 3) parts of white."""

    def __init__(self, colours: Floats) -> None:
        self._step = np.zeros(colours.shape[:2], np.float32)
        smooth = cv2.blur(colours, (1, 3))
        self._step[2:-2] = largest(np.abs(smooth[4:] - smooth[:-4]))
        most = cv2.dilate(self._step, np.ones((5, 1), np.uint8))
        peak = (self._step >= _STEP) & (self._step >= most)
        near = cv2.dilate(peak.astype(np.uint8), np.ones((3, 1), np.uint8))
        self.is_level: Flags = np.asarray(near > 0, np.bool_)
        """(rows, columns) where a level edge is."""
        smooth = cv2.blur(colours, (1, 5))
        self._upright = np.zeros(colours.shape[:2], np.bool_)
        self._upright[:, 1:-1] = largest(np.abs(smooth[:, 2:] - smooth[:, :-2])) >= _STEP
        self._level = largest(colours)

    def edge_rows(self, stands: Flags, reach: tuple[int, int]) -> list[int]:
        """The rows in which the edges are strongest, the highest first."""
        strength = np.where(stands, np.minimum(self._step, _MOST_STEP), np.float32(0.0)).sum(axis=1)
        most = cv2.dilate(strength[:, None], np.ones((3, 1), np.uint8))[:, 0]
        many = (self.is_level & stands).sum(axis=1) >= _LEAST_COLUMNS
        strong = np.flatnonzero(many & (strength >= most) & (strength >= _LEAST_COLUMNS * _STEP))
        low = max(reach[0], _BELOW_ROWS + _FOOT_ROWS)
        return [row for row in strong[::-1].tolist() if low <= row < reach[1]]

    def is_lit(self, known: int, row: int, start: int, stop: int) -> bool:
        """Whether columns are lit as a front from where they are known to be one up to a row."""
        level = self._level[min(known, row - _BELOW_ROWS) : row, start:stop]
        lit = level > _LIT
        if lit[-_BELOW_ROWS:].mean() < _PART or lit.mean() < _PART:
            return False
        return float(np.median(level[:-1])) >= _LEAST_LEVEL

    def has_ends(self, found: Indices, known: int, row: int, start: int, stop: int) -> bool:
        """Whether a front up to a row ends on both sides by upright edges."""
        columns = len(found)
        if stop - start >= _WIDE_PART * columns and (start <= 1 or stop >= columns - 1):
            return True
        for end, beside in ((start, start - 1), (stop, stop)):
            if end <= 1 or end >= columns - 1:
                return False
            as_high = found[beside] >= row - _ALIKE_ROWS
            low = min(known, row - _LEAST_ROWS) if as_high else _FOOT_ROWS
            near = self._upright[low:row, max(end - 3, 0) : end + 3]
            seen = np.asarray(near.any(axis=1), np.bool_)
            half = len(seen) // 2
            if min(seen[:half].mean(), seen[half:].mean()) < _UPRIGHT_PART:
                return False
        return True

    def goes_on(self, fronts: Indices, known: int, start: int, stop: int) -> bool:
        """Whether what is known of a front is seen to end as high in the columns beside it."""
        beside = np.r_[
            max(start - _BESIDE_COLUMNS, 0) : start, stop : min(stop + _BESIDE_COLUMNS, len(fronts))
        ]
        alike = beside[np.abs(fronts[beside] - known) <= _ALIKE_ROWS]
        tops = np.minimum(fronts[alike], len(self.is_level) - 1)
        return known > 0 and int(self.is_level[tops, alike].sum()) >= _GOES_ON_COLUMNS


def _segments(has: Flags, free: Flags) -> list[tuple[int, int]]:
    """Start and stop of the free columns that an edge goes through but for small gaps."""
    gap = np.ones((1, _GAP_COLUMNS), np.uint8)
    closed = cv2.morphologyEx(has.astype(np.uint8)[None], cv2.MORPH_CLOSE, gap)[0] > 0
    cuts = np.flatnonzero(np.diff(np.concatenate([[False], closed & free, [False]]).astype(np.int8)))
    return [(int(start), int(stop)) for start, stop in cuts.reshape(-1, 2) if stop - start >= _LEAST_COLUMNS]
