"""Where the deck of an opening is seen from its edge to deep behind it: no goods stand there, for they would
hide it.

Whoever stands in the middle looks past an end of the opening at its far columns.  Where the deck is seen all
the way to that end, what shows above it is the hall, or stands in the next places.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from flightd.core.scanning import PlaceOpening
from flightd.core.types import Image
from flightd.vision.shelf.opening_raster import BELOW_M, COLUMN_M, ROW_M, deck_strip_m

Floats: TypeAlias = NDArray[np.float64]
Flags: TypeAlias = NDArray[np.bool_]

_LIT_M: Final = 0.25
"""So deep the deck is lit for sure; what it looks like is taken from its deeper half, which the beam does not
reach wherever the pose has it."""
_DARK_M: Final = 0.6
"""So deep it is followed in the dark."""
_WALL_M: Final = 0.55
"""Deeper than this it is never lit: what looks like it farther up is none."""
_BEHIND_M: Final = 0.9
"""Depth of a rack."""
_OFF_M: Final = 0.03
"""So far the deck's edge is looked for from its place."""
_ASIDE_M: Final = 0.02
_SHORT_M: Final = 0.01
"""What the pose may be off along the rack, and in height."""
_SAME: Final = 0.06
"""Part of white by which the deck's colours differ."""
_DARK: Final = 0.6
"""Part of the lit deck's brightness that it has no more in the dark."""
_LEAST_COLUMNS: Final = 4


@dataclass(frozen=True, slots=True)
class DeckSight:
    """(columns,) of an opening's raster each: `lit` where the deck is seen, lit, as deep as light reaches or
    up to the opening's end, and `past` where it is seen up to that end, and so is what lies past it."""

    lit: Flags
    past: Flags


def deck_sight(raster: Image, white: float, opening: PlaceOpening) -> DeckSight:
    """What is seen of the deck in an opening's raster, (rows, columns, 3) BGR, of a picture of that white
    level."""
    columns = raster.shape[1]
    ends_m = _ends_m(columns, opening)
    tone = _tone(raster, white, opening, ends_m)
    is_lit, past = np.zeros(columns, np.bool_), np.zeros(columns, np.bool_)
    if tone is None:
        return DeckSight(is_lit, past)
    colours = raster.astype(np.float32) / np.float32(white)
    is_deck = np.abs(colours - tone).max(axis=2) < _SAME
    is_dark = is_deck | (colours.max(axis=2) < _DARK * tone.max())
    lit_m, all_m = (_needed_m(opening, np.minimum(ends_m, deep_m)) for deep_m in (_LIT_M, _DARK_M))
    wall_m = deck_strip_m(opening, _WALL_M) + _OFF_M
    for column in range(columns):
        edge = _edge(is_deck[:, column])
        if edge is None:
            is_lit[column] = lit_m[column] <= 0.0  # the end is too near for any deck
            continue
        is_lit[column] = lit_m[column] <= _run(is_deck[:, column], edge) * ROW_M <= wall_m
        whole_m = _run(is_dark[:, column], edge) * ROW_M
        past[column] = is_lit[column] and ends_m[column] < _BEHIND_M and whole_m >= all_m[column]
    return DeckSight(is_lit, past)


def _ends_m(columns: int, opening: PlaceOpening) -> Floats:
    """(columns,) metres behind the rack's face at which the line of sight leaves the opening at one of its
    ends, as near as the pose may have it."""
    eye_m, _, before_m = opening.eye_m
    half_m = opening.width_m / 2
    at_m = (np.arange(columns) + 0.5) * COLUMN_M - half_m
    end_m = np.where(at_m < eye_m, -half_m, half_m)
    near_m = np.clip(at_m + np.sign(end_m) * _ASIDE_M, -half_m, half_m) - eye_m
    away = np.abs(near_m) > 1e-6
    deep_m = before_m * ((end_m - eye_m) / np.where(away, near_m, 1.0) - 1.0)
    return np.asarray(np.where(away, np.clip(deep_m, 0.0, _BEHIND_M), _BEHIND_M), np.float64)


def _tone(raster: Image, white: float, opening: PlaceOpening, ends_m: Floats) -> NDArray[np.float32] | None:
    """The lit deck's colour as parts of white, None where it is seen too flat."""
    deck = round(BELOW_M / ROW_M)
    low, high = (deck + int(deck_strip_m(opening, part * _LIT_M) / ROW_M) for part in (0.6, 1.0))
    inner = ends_m > _LIT_M
    if high - low < 2 or high > len(raster) or inner.sum() < _LEAST_COLUMNS:
        return None
    strip = raster[low:high, inner].reshape(-1, 3).astype(np.float32)
    return np.asarray(np.median(strip, axis=0) / white, np.float32)


def _needed_m(opening: PlaceOpening, deep_m: Floats) -> Floats:
    """How high the strip of the deck is up to there, at least."""
    _, eye_m, before_m = opening.eye_m
    return np.asarray(eye_m * deep_m / (before_m + deep_m) - _SHORT_M, np.float64)


def _edge(is_deck: Flags) -> int | None:
    """The first row of the deck, None where it is not near its place."""
    deck, off = round(BELOW_M / ROW_M), round(_OFF_M / ROW_M)
    near = is_deck[deck - off : deck + off + 1]
    both = np.flatnonzero(near[:-1] & near[1:])
    return int(both[0]) + deck - off if both.size else None


def _run(flags: Flags, start: int) -> int:
    """How many rows from there on are set, single ones left out."""
    pairs = flags[start:-1] | flags[start + 1 :]
    ends = np.flatnonzero(~pairs)
    return int(ends[0]) if ends.size else len(pairs)
