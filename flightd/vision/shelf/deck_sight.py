"""Where the deck of an opening is seen from its edge to deep behind it: no goods stand there, for they would
hide it.

Whoever stands in the middle looks past an end of the opening at its far columns.  Where the deck is seen all
the way to that end, what shows above it is the hall, or stands in the next places.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from flightd.core.scanning import PlaceOpening
from flightd.core.types import Image
from flightd.vision.shelf.opening_raster import BELOW_M, COLUMN_M, ROW_M, brightest, deck_strip_m

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
    ends_m = sight_ends_m(columns, opening)
    tone = _tone(raster, white, opening, ends_m)
    if tone is None:
        return DeckSight(np.zeros(columns, np.bool_), np.zeros(columns, np.bool_))
    colours = raster.astype(np.float32) / np.float32(white)
    off = cv2.split(np.abs(colours - tone))
    is_deck = cv2.max(cv2.max(off[0], off[1]), off[2]) < _SAME
    is_dark = is_deck | (brightest(raster) / np.float32(white) < _DARK * tone.max())
    lit_m, all_m = (_needed_m(opening, np.minimum(ends_m, deep_m)) for deep_m in (_LIT_M, _DARK_M))
    wall_m = deck_strip_m(opening, _WALL_M) + _OFF_M
    edge, has_edge = _edge(is_deck)
    strip_m, whole_m = (_run(flags, edge) * ROW_M for flags in (is_deck, is_dark))
    is_lit = np.where(
        has_edge,
        (lit_m <= strip_m) & (strip_m <= wall_m),
        lit_m <= 0.0,  # the end is too near for any deck
    )
    return DeckSight(is_lit, has_edge & is_lit & (ends_m < _BEHIND_M) & (whole_m >= all_m))


def sight_ends_m(columns: int, opening: PlaceOpening) -> Floats:
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


def _edge(is_deck: Flags) -> tuple[NDArray[np.intp], Flags]:
    """(columns,) the first row of the deck, and whether it is near its place at all."""
    deck, off = round(BELOW_M / ROW_M), round(_OFF_M / ROW_M)
    near = is_deck[deck - off : deck + off + 1]
    both = near[:-1] & near[1:]
    return both.argmax(axis=0) + deck - off, np.asarray(both.any(axis=0))


def _run(flags: Flags, start: NDArray[np.intp]) -> NDArray[np.intp]:
    """(columns,) how many rows from there on are set, single ones left out."""
    rows = np.arange(len(flags))[:, None]
    ends = np.ones(flags.shape, np.bool_)  # the last row always is one
    ends[:-1] = ~(flags[:-1] | flags[1:])
    return np.asarray((ends & (rows >= start)).argmax(axis=0) - start, np.intp)
