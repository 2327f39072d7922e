"""How full a place on the shelf is, from one picture of its opening.

The area of the goods' fronts (`goods_front`), each in its true size: one that stands deep in the rack looks
smaller than the opening, one that stands out looks larger (`front_depth`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from flightd.core.inventory import PlaceFill
from flightd.core.scanning import PlaceOpening
from flightd.core.types import Image
from flightd.vision.shelf.case_grid import case_grid
from flightd.vision.shelf.deck_sight import deck_sight, sight_ends_m
from flightd.vision.shelf.footing import footing
from flightd.vision.shelf.front_depth import FrontDepths, deck_edge_m
from flightd.vision.shelf.front_lean import front_lean_m
from flightd.vision.shelf.goods_front import CLEAR_M, LOW_M, SIDE_DEPTH_M, equal_runs, fronts_m
from flightd.vision.shelf.opening_raster import (
    BELOW_M,
    COLUMN_M,
    ROW_M,
    brightest,
    deck_strip_m,
    in_columns,
    opening_raster,
)

Floats: TypeAlias = NDArray[np.float32]
Box: TypeAlias = tuple[float, float, float, float]
"""Left, lower, right and upper end, metres from the opening's left end and above its deck."""

_BURNT, _BURNT_MORE = 250.0, 1.3
"""White that is so light may be lighter than the picture can say: so much is taken for it."""
_POST_M: Final = 0.05
"""So far an upright may reach into the opening."""
_LEAST_COLUMNS: Final = 4
"""An opening of which uprights may hide all but that is too narrow."""
_AROUND_M: Final = (0.035, 0.08)
"""Around a code its label ends at the first, and the goods go on to the second."""
_LEAST_TONE: Final = 0.30
"""Goods that are darker are not told from the dark behind them."""
_LEAST_STRIP_M: Final = 0.02
"""Height of the lit deck, as it is seen, below which it is not looked at."""
_LIT: Final = 0.22
"""Part of white that an empty deck has at least."""
_TOP_STEP: Final = 0.05
_TOP_PART: Final = 0.85
_TOP_HUE: Final = 0.05
"""Part of white by which a front's upper edge is a step; the most that its top has of its brightness, or the
least by which a part of its colour differs."""
_DOUBT_PART: Final = 0.07
"""The part of the opening of which it is not known whether it is front or top may be no greater."""
_UNLIT_PART: Final = 0.12
_BLANK_PART: Final = 0.05
"""Parts of the opening, without a lit deck and blank in the dark, up to which it is as empty as it seems."""
_DARK: Final = 0.28
"""Part of white below which goods are as dark as the rack."""
_BACK_ROWS: Final = 17
_LEAST_SHOWN: Final = 0.0055
"""Rows over which what is even is taken out of the dark, and the structure, as a part of white, that is left
of what is seen there: mesh, the backs of other goods."""
_SEAM_M: Final = 0.03
"""So near to a front's end nothing is looked for in the dark above it."""
_LOOKED_M: Final = 0.3
"""So deep an empty deck has to be lit."""
_LEAST_ROOM_M: Final = 0.1
"""Of a lower opening it is not told how full it is."""
_GOODS_M: Final = 0.05
_GOODS_COLUMNS: Final = 4
"""A front that is lower, or narrower, may be the deck itself or a stripe of light: goods are larger."""


_LEANS_M: Final = 0.02
"""A front that leans so much surely does."""


@dataclass(frozen=True, slots=True)
class OpeningLook:
    """What one picture tells of an opening: how full it is, and whether it `is_clear`: its front is seen from
    end to end, and goods are seen nowhere in it."""

    fill: PlaceFill
    is_clear: bool = False


UNKNOWN: Final = OpeningLook(PlaceFill(None))


def fill_level(
    picture: Image, opening: PlaceOpening, white: float, codes_m: Sequence[Box] = ()
) -> OpeningLook:
    """How full a place is, from one picture, (H, W, 3) BGR, of that white level; `codes_m` are the codes in
    it."""
    square = opening_raster(picture, opening) if white > 0.0 else None
    if square is None:
        return UNKNOWN
    is_burnt = white >= _BURNT
    look = measure(square, opening, white * _BURNT_MORE if is_burnt else white, codes_m, is_burnt=is_burnt)
    is_whole = all(abs(x) <= picture.shape[1] / 2 for x, _ in opening.front_px)
    is_known = not is_burnt and opening.height_m >= _LEAST_ROOM_M
    return OpeningLook(look.fill if is_known else PlaceFill(None), look.is_clear and is_whole)


def measure(
    square: Image,
    opening: PlaceOpening,
    white: float,
    codes_m: Sequence[Box] = (),
    *,
    is_burnt: bool = False,
) -> OpeningLook:
    """The same from the opening's raster, which is all in the picture.  Where the white is a guess, as
    `is_burnt` says, an opening is clear only if its deck is seen all over."""
    raster = in_columns(square)
    left, right = (round(_POST_M / COLUMN_M) if post else 0 for post in opening.posts)
    if raster.shape[1] - left - right < _LEAST_COLUMNS:
        return UNKNOWN
    columns = slice(left, raster.shape[1] - right)
    whole = brightest(raster).astype(np.float32) / np.float32(white)
    deck = round(BELOW_M / ROW_M)
    seen = np.maximum(raster[:, columns], 1).astype(np.float32) / np.float32(white)
    sight_m = sight_ends_m(raster.shape[1], opening)[columns]
    foot = footing(seen, opening, deck_edge_m(raster[:, columns]), sight_m)
    colours = seen[deck + round(CLEAR_M / ROW_M) :]
    tops_m = fronts_m(colours, opening, left, foot)
    if any(_is_lost(code, whole[deck:], tops_m, left) for code in codes_m):
        return UNKNOWN
    room = whole[deck:, columns]
    if _unlit_part(room, tops_m, opening) > _UNLIT_PART or _blank_part(room, tops_m, opening) > _BLANK_PART:
        return UNKNOWN
    sight = deck_sight(raster, white, opening)
    goods = (tops_m >= _GOODS_M) & ~sight.past[columns]
    if is_burnt:
        goods |= ~sight.lit[columns]
    is_clear = int(goods.sum()) < _GOODS_COLUMNS
    depths = FrontDepths(raster[:, columns], whole[:, columns], opening, tops_m < LOW_M)
    _, eye_m, before_m = opening.eye_m
    area, doubt, out_m = 0.0, 0.0, 0.0
    leans_m: list[float | None] = []
    cases = case_grid(square, white, np.where(tops_m >= _GOODS_M, tops_m, 0.0), left, codes_m)
    runs = equal_runs(tops_m)
    for number, (start, stop) in enumerate(runs):
        if tops_m[start] < LOW_M:
            continue
        top_m, perhaps_m = _without_top(colours[:, start:stop], float(tops_m[start]), opening)
        top_m -= depths.edge_m
        width = stop - start + left / 2 * (number == 0) + right / 2 * (number == len(runs) - 1)
        depth_m = depths.of(start, stop)
        depth_m = 0.0 if depth_m is None else depth_m
        out_m = max(out_m, -depth_m)
        scale = (before_m + depth_m) / before_m
        high_m = min(eye_m + (top_m - eye_m) * scale, opening.height_m)
        area += width * COLUMN_M * scale * max(high_m, 0.0)
        ends_m = (start + left) * COLUMN_M, (stop + left) * COLUMN_M
        foot_m = max(deck_strip_m(opening, depth_m), 0.0)
        if top_m >= _GOODS_M and stop - start >= _GOODS_COLUMNS:
            lean_m = front_lean_m(square, white, ends_m, (foot_m, top_m + depths.edge_m))
            leans_m.append(None if lean_m is None else abs(lean_m) * scale)
        doubt += width * COLUMN_M * perhaps_m
    whole_m2 = opening.width_m * opening.height_m
    if doubt > _DOUBT_PART * whole_m2:
        return OpeningLook(PlaceFill(None, cases=cases), is_clear)
    share = min(area / whole_m2, 1.0)
    fill = PlaceFill(round(share, 3), round(out_m, 3) or None, _most_m(leans_m), cases)
    return OpeningLook(fill, is_clear)


def _most_m(leans_m: Sequence[float | None]) -> float | None:
    """How much the front leans that leans most; None where none is known to lean and one may."""
    known = [lean_m for lean_m in leans_m if lean_m is not None]
    if not known or (len(known) < len(leans_m) and max(known) < _LEANS_M):
        return None
    return round(max(known), 3)


def _without_top(colours: Floats, top_m: float, opening: PlaceOpening) -> tuple[float, float]:
    """Where a front, (rows, columns, 3) as parts of white, ends that seems to end at `top_m`, and how much of
    it may be its top for all that.  What is above an edge, less bright or of another colour, and no higher
    than a top face is seen, is the top of the goods."""
    _, eye_m, before_m = opening.eye_m
    far = before_m / (before_m + SIDE_DEPTH_M)
    rows = round((top_m - CLEAR_M) / ROW_M)
    if top_m - LOW_M >= eye_m or rows < 8:
        return top_m, 0.0
    profile = np.median(colours[:rows], axis=1)
    splits = np.arange(4, rows - 3)
    split_m = CLEAR_M + splits * ROW_M
    step = np.abs(profile[splits - 2] - profile[splits + 1]).max(axis=1)
    reach_m = split_m + (eye_m - split_m) * (1.0 - far)
    fits = (step > _TOP_STEP) & (split_m < eye_m) & (reach_m >= top_m - CLEAR_M)
    edges = sorted(np.flatnonzero(fits).tolist(), key=lambda number: -float(step[number]))
    for number in edges:
        split = int(splits[number])
        front, top = (np.median(part, axis=0) for part in (profile[:split], profile[split:]))
        other = np.abs(front / front.sum() - top / top.sum()).max() > _TOP_HUE
        if other or float(top.max()) < _TOP_PART * float(front.max()):
            return float(split_m[number]), 0.0
    return top_m, top_m - float(split_m[edges[0]]) if edges else 0.0


def _is_lost(code: Box, level: Floats, tops_m: Floats, left: int) -> bool:
    """Whether a code hangs on a front that was not told from the dark: it is above what was found, or what is
    around its label is hardly lighter than the dark."""
    x0_m, low_m, x1_m, high_m = code
    column = min(max(int((x0_m + x1_m) / 2 / COLUMN_M) - left, 0), len(tops_m) - 1)
    if tops_m[column] < (low_m + high_m) / 2:
        return True
    around = np.zeros(level.shape, np.bool_)
    for room_m, value in ((_AROUND_M[1], True), (_AROUND_M[0], False)):
        x0, x1 = (max(round(x_m / COLUMN_M), 0) for x_m in (x0_m - room_m, x1_m + room_m))
        low, high = (max(round(z_m / ROW_M), 0) for z_m in (low_m - room_m, high_m + room_m))
        around[low:high, x0:x1] = value
    columns = slice(left, left + len(tops_m))
    around[:, columns] &= np.arange(len(level))[:, None] * ROW_M < tops_m
    return bool(around.any()) and float(np.median(level[around])) < _LEAST_TONE


def _unlit_part(level: Floats, tops_m: Floats, opening: PlaceOpening) -> float:
    """The part of the opening of which it is not known whether it is as empty as it seems."""
    strip = round(deck_strip_m(opening, _LOOKED_M) / ROW_M)
    clear = round(CLEAR_M / ROW_M)
    if strip * ROW_M < _LEAST_STRIP_M or strip - clear < 2:
        lit = np.zeros(len(tops_m), np.bool_)
    else:
        lit = np.median(level[clear:strip], axis=0) > _LIT
    unlit = (tops_m < LOW_M) & ~lit
    return float(unlit.mean())


def _blank_part(level: Floats, tops_m: Floats, opening: PlaceOpening) -> float:
    """The part of the opening that is dark above fronts and shows nothing of the back: goods as dark as that
    may stand there."""
    _, eye_m, before_m = opening.eye_m
    far = before_m / (before_m + SIDE_DEPTH_M)
    top_m = eye_m + (opening.height_m - eye_m) * far  # above is the roof, which shows nothing
    rows = np.arange(len(level))[:, None] * ROW_M
    shows = np.abs(level - cv2.blur(level, (1, _BACK_ROWS)))
    behind = (rows > tops_m + _SEAM_M) & (rows < top_m) & (tops_m >= LOW_M)
    dark = behind & (level < _DARK)
    blank = cv2.blur(np.where(dark, shows, 1.0).astype(np.float32), (3, 2 * _BACK_ROWS)) < _LEAST_SHOWN
    return float((blank & dark).sum()) * ROW_M / (opening.height_m * len(tops_m))
