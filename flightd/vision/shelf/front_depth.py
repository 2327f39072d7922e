"""How deep in the rack a front stands, or how far out over its face, by where its foot is seen.

The strip of the deck between the deck's edge and a front's foot is as high in the picture as the front stands
deep; goods that stand out hide the upper part of the beam.
"""

from __future__ import annotations

from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from flightd.core.scanning import PlaceOpening
from flightd.core.types import Image
from flightd.vision.shelf.opening_raster import BELOW_M, ROW_M, deck_strip_m

Floats: TypeAlias = NDArray[np.float32]

_FOOT_DEPTH_M: Final = 0.45
_LEAST_FOOT_M: Final = 0.02
"""How deep fronts are looked for, and the strip of the deck up to there below which none is."""
_OFF_M: Final = 0.03
_FAR_OFF_M: Final = 0.05
"""So far the deck's edge is looked for from its place, and where only a coarse look at it is taken."""
_SAME_HUE: Final = 0.06
"""Parts of red, green and blue in a colour that differ by no more are those of one thing."""
_EDGE_PART: Final = 0.75
"""The deck's edge is where the beam ends in the columns in which nothing stands out over it: so many of them
end lower."""
_LEAST_COLUMNS: Final = 3
_OUT_M: Final = 0.008
"""Goods that hide less of the beam do not stand out."""
_FOOT_STEP: Final = 0.04
"""Part of white by which the deck is darker than the beam before it and the front behind it."""
_DECK: Final = (0.2, 0.52)
"""Parts of white between which the lit part of a deck is."""
_LEAST_EYE_M: Final = 0.12
"""A camera that is less above the deck does not see how deep a front stands."""


class FrontDepths:
    """Where the fronts of one opening stand, from its raster, (rows, columns, 3) BGR, and `level`, its
    brightness as a part of white; `empty` are the columns without a front."""

    def __init__(self, raster: Image, level: Floats, opening: PlaceOpening, empty: NDArray[np.bool_]) -> None:
        self._level = level
        self._opening = opening
        self._beam_m = _beam_edge(raster)
        free_m, all_m = _known(self._beam_m[empty]), _known(self._beam_m)
        self._free = len(free_m) >= _LEAST_COLUMNS
        self.edge_m = 0.0
        """Where the deck's edge is seen, above where the pose has it."""
        if self._free:
            self.edge_m = float(np.median(free_m))
        elif len(all_m) >= _LEAST_COLUMNS:
            self.edge_m = float(np.quantile(all_m, _EDGE_PART))

    def of(self, start: int, stop: int) -> float | None:
        """How far behind the rack's face the front in these columns stands, metres, negative for one before
        it; None where that is not seen."""
        _, eye_m, before_m = self._opening.eye_m
        if eye_m < _LEAST_EYE_M:
            return None
        strip_m = _foot(self._level[:, start:stop], self._opening)
        if strip_m is None:
            ends_m = _known(self._beam_m[start:stop])
            if not self._free or len(ends_m) < min(_LEAST_COLUMNS, stop - start):
                return None
            hidden_m = self.edge_m - float(np.median(ends_m))
            strip_m = -hidden_m if hidden_m > _OUT_M else 0.0
        return before_m * strip_m / (eye_m - strip_m)


def deck_edge_m(raster: Image) -> float | None:
    """Where the deck's edge is seen, above where the pose has it, by an opening's raster, (rows, columns, 3)
    BGR; None where it is not."""
    known_m = _known(_beam_edge(raster, _FAR_OFF_M))
    return float(np.quantile(known_m, _EDGE_PART)) if len(known_m) >= _LEAST_COLUMNS else None


def _known(values: Floats) -> Floats:
    return values[np.isfinite(values)]


def _beam_edge(raster: Image, off_m: float = _OFF_M) -> Floats:
    """(columns,) metres above the deck's place at which the beam's face ends, NaN where it is not told from
    what is above."""
    deck, off = round(BELOW_M / ROW_M), round(off_m / ROW_M)
    colours = raster[: deck + off + 2].astype(np.float32) + 1.0
    hues = colours / colours.sum(axis=2, keepdims=True)
    beam = np.median(hues[: deck - off], axis=(0, 1))
    alike = np.abs(hues - beam).max(axis=2) < _SAME_HUE
    rows = len(alike) - np.argmax(alike[::-1], axis=0)
    known = alike.any(axis=0) & (rows < len(alike)) & (rows > deck - 2 * off)
    return np.where(known, (rows - deck) * np.float32(ROW_M), np.float32(np.nan)).astype(np.float32)


def _foot(level: Floats, opening: PlaceOpening) -> float | None:
    """The height of the strip of the deck that is seen between its edge and a front, metres; None where none
    is seen."""
    reach_m = deck_strip_m(opening, _FOOT_DEPTH_M)
    deck = round(BELOW_M / ROW_M)
    high = deck + round(reach_m / ROW_M)
    if reach_m < _LEAST_FOOT_M or high + 4 > level.shape[0]:
        return None
    profile = np.median(level[: high + 4], axis=1)
    step = profile[2:] - profile[:-2]  # of row i + 1
    least, most = np.quantile(level[: high + 4], (0.1, 0.9), axis=1)
    is_deck = (least > _DECK[0]) & (most < _DECK[1])
    low, late = deck - round(_OFF_M / ROW_M), deck + round(_OFF_M / ROW_M)
    falls = [
        row
        for row in range(low, min(late, high))
        if step[row - 1] < -_FOOT_STEP and step[row - 1] <= step[row] and is_deck[row + 2]
    ]
    if not falls:
        return None
    edge = foot = falls[0]
    for row in range(edge + 2, high):
        if not is_deck[row]:
            return None
        if step[row] > _FOOT_STEP and step[row] >= step[row + 1]:
            foot = row + 1
            break
    return (foot - edge) * ROW_M if foot > edge else None
