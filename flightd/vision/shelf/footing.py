"""Where the deck of an opening ends, column by column: at the foot of what stands in it, or deep in the rack.

A front hides the deck from its foot on, at one depth all along; the side of goods stands on the deck from
the front on to deep behind it, so that its foot rises to the side on which the camera is; where nothing
stands the deck goes on to where no light reaches, or to the opening's end.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, TypeAlias

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from flightd.core.scanning import PlaceOpening
from flightd.vision.shelf.opening_raster import BELOW_M, ROW_M, deck_strip_m, largest

Floats: TypeAlias = NDArray[np.float32]
Flags: TypeAlias = NDArray[np.bool_]

_FREE_M: Final = 0.33
"""Where the deck is seen so deep no front stands."""
_WALL_M: Final = 0.55
_OFF_M: Final = 0.03
"""Deeper than the first it is never lit, and its edge is known to the second: what goes on farther up is a
front."""
_LEAST_STRIP_M: Final = 0.02
"""Height of the strip up to the depth of which nothing stands below which the deck is not looked at."""
_SAME: Final = 0.06
"""Part of white by which the deck's colours differ."""
_DECK: Final = (0.2, 0.52)
"""Parts of white between which the brightness of a lit deck is."""
_LEAST_ROWS: Final = 3
_LATE_ROWS: Final = 3
"""Rows in which the deck is seen at least to be taken for it, and by which its edge may be late."""
_SHORT_ROWS, _LONG_ROWS = 2, 8
"""Rows by which the deck may end before, or behind, where it does by the pose."""
_RISE_ROWS: Final = 5
"""By so many rows in four columns the foot of a front rises at most; that of a side rises more."""


@dataclass(frozen=True, slots=True)
class Footing:
    """(columns,) of an opening each: whether the front of something `stands` there, and whether the deck is
    seen so deep that no front does (`is_free`); neither where that is not seen."""

    stands: Flags
    is_free: Flags


def footing(
    colours: Floats, opening: PlaceOpening, edge_m: float | None, ends_m: NDArray[np.float64]
) -> Footing:
    """What stands on the deck, by an opening's raster, (rows, columns, 3) as parts of white, in which the
    deck's edge is seen `edge_m` above its place; the line of sight leaves the opening at `ends_m`, (columns,)
    metres behind the face, at one of its ends.  Nothing is told where the edge is not seen (None), or the
    deck from too low."""
    columns = colours.shape[1]
    nothing = np.zeros(columns, np.bool_)
    if edge_m is None:
        return Footing(nothing, nothing)
    first = round((BELOW_M + edge_m) / ROW_M) + 1
    most = round((deck_strip_m(opening, _WALL_M) + _OFF_M) / ROW_M)
    if deck_strip_m(opening, _FREE_M) < _LEAST_STRIP_M or first + most + 2 > len(colours):
        return Footing(nothing, nothing)
    strip = colours[first : first + most + 2]
    tone = _tone(strip, most)
    if tone is None:  # goods hide it from end to end
        return Footing(~nothing, nothing)
    rows = _rows_of(strip, tone)
    _, eye_m, before_m = opening.eye_m
    least, most_rows = (
        eye_m * np.minimum(ends_m, deep_m) / (before_m + np.minimum(ends_m, deep_m)) / ROW_M
        for deep_m in (_FREE_M, _WALL_M)
    )
    is_free = (rows >= np.maximum(least - _SHORT_ROWS, _LEAST_ROWS)) & (rows <= most_rows + _LONG_ROWS)
    usual = np.median(sliding_window_view(np.pad(rows, 4, mode="edge"), 5), axis=1)
    is_level = np.abs(usual[4:] - usual[:-4]) <= _RISE_ROWS
    is_near = rows < deck_strip_m(opening, _FREE_M) / ROW_M - _SHORT_ROWS
    return Footing(is_level & is_near & ~is_free, is_free)


def _tone(strip: Floats, most: int) -> Floats | None:
    """The lit deck's colour, None where it is seen nowhere."""
    own = strip[1]
    brightness = own.max(axis=1)
    rows = _run(largest(np.abs(strip - own)) < _SAME)
    known = (rows >= _LEAST_ROWS) & (rows <= most) & (brightness > _DECK[0]) & (brightness < _DECK[1])
    if not known.any():
        return None
    own, rows = own[known], rows[known]
    alike = np.abs(own[:, None] - own[None]).max(axis=2) < _SAME
    most_seen = int((alike @ rows).argmax())
    return np.asarray(np.median(own[alike[most_seen]], axis=0), np.float32)


def _rows_of(strip: Floats, tone: Floats) -> Floats:
    """(columns,) rows of the strip that are of the deck."""
    is_deck = largest(np.abs(strip - tone)) < _SAME
    begins = is_deck[:_LATE_ROWS].any(axis=0)
    from_there = is_deck.copy()
    from_there[:_LATE_ROWS] |= begins
    return np.where(begins, _run(from_there), 0).astype(np.float32)


def _run(flags: Flags) -> NDArray[np.intp]:
    """(columns,) how many rows from the lowest on are set, single ones left out."""
    ends = np.ones(flags.shape, np.bool_)
    ends[:-1] = ~(flags[:-1] | flags[1:])
    return np.asarray(ends.argmax(axis=0), np.intp)
