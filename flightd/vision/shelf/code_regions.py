"""Where in a picture a code may be: dense edges that keep to two perpendicular directions.

Bars and modules have edges everywhere, and all of them run along or across the code; gravel has them in
every direction, a rack's beams have few.  The measure is that of the structure tensor with four-fold
symmetry, |mean(g^4 / |g|^2)| / mean(|g|^2) for the gradient g as a complex number.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from flightd.core.geometry import Matrix
from flightd.core.types import Image

_Floats: TypeAlias = NDArray[np.float32]

_SAMPLES = 400
"""Most gradients along the picture's longer side."""
_WINDOW = 11
"""Samples over which density and symmetry are averaged."""
_MIN_STEP = 14.0
_MIN_RELATIVE_STEP = 0.2
"""Difference in grey level of the two neighbours of a pixel on an edge worth counting: at least, and as a
part of the range of grey levels in the window (texture has many small steps, a code has full ones)."""
_MIN_DENSITY = 0.30
_MIN_DENSITY_HALF = 0.60
"""Shrinking brings all edges closer together, those of clutter too."""
_MIN_SYMMETRY = 0.42
_GAP = 9
"""Samples without evidence that a code may have inside: a blot, a reflection."""
_MIN_SIDE = 8
_MIN_PIECE_PX = 500.0
_MIN_EVIDENCE_PX = 1800.0
"""A code of 25 modules read at 2.5 pixels for each covers as much; the corner of a box less."""
_MARGIN = 0.25
_AROUND = 0.7
"""Part of a code's length within which more of the kind belongs to it."""


@dataclass(frozen=True, slots=True)
class CodeRegion:
    """A box of the picture in pixels, the far ends excluded, with its rank: evidence times area."""

    x0: int
    y0: int
    x1: int
    y1: int
    evidence: float

    def touches(self, other: CodeRegion) -> bool:
        return self.x0 < other.x1 and other.x0 < self.x1 and self.y0 < other.y1 and other.y0 < self.y1

    def joined(self, other: CodeRegion) -> CodeRegion:
        """The box around both."""
        return CodeRegion(
            min(self.x0, other.x0),
            min(self.y0, other.y0),
            max(self.x1, other.x1),
            max(self.y1, other.y1),
            self.evidence + other.evidence,
        )

    def widened(self, margin: float) -> CodeRegion:
        """With so much more room on all sides."""
        x0, y0, x1, y1 = self.x0 - margin, self.y0 - margin, self.x1 + margin, self.y1 + margin
        return CodeRegion(int(x0), int(y0), int(x1) + 1, int(y1) + 1, self.evidence)

    def contains(self, x: float, y: float) -> bool:
        return self.x0 <= x < self.x1 and self.y0 <= y < self.y1


def code_regions(grey: Image, known: Sequence[Matrix] = (), most: int = 4) -> list[CodeRegion]:
    """At most `most` boxes of `grey` (H, W) that look like codes, margins included, best first; without what
    the `known` codes, (4, 2) corners each, explain."""
    height, width = grey.shape
    half = np.asarray(
        cv2.resize(grey, (width // 2 + 1, height // 2 + 1), interpolation=cv2.INTER_AREA), np.uint8
    )
    # fine modules are dense edges at full size only, large ones at half size only
    boxes = [_surroundings(corners) for corners in known]
    pieces = _pieces(grey, 1, _MIN_DENSITY, boxes) + _pieces(half, 2, _MIN_DENSITY_HALF, boxes)
    whole = [region for region in _merged(pieces) if region.evidence >= _MIN_EVIDENCE_PX]
    clipped = [
        CodeRegion(max(0, r.x0), max(0, r.y0), min(width, r.x1), min(height, r.y1), r.evidence) for r in whole
    ]
    return sorted(clipped, key=lambda region: -region.evidence)[:most]


def _surroundings(corners: Matrix) -> CodeRegion:
    """The box of a code with what belongs to it: its printed text, its frame, an add-on."""
    (x0, y0), (x1, y1) = corners.min(axis=0), corners.max(axis=0)
    return CodeRegion(int(x0), int(y0), int(x1) + 1, int(y1) + 1, 0.0).widened(
        _AROUND * max(x1 - x0, y1 - y0)
    )


def _pieces(grey: Image, shrunk: int, least_density: float, known: Sequence[CodeRegion]) -> list[CodeRegion]:
    """Connected evidence that none of the `known` boxes touches, in pixels of the picture `shrunk` times as
    large."""
    step = math.ceil(max(grey.shape) / _SAMPLES)
    if min(grey.shape) < 3 * step:
        return []
    strength = _strength(grey, step, least_density)
    mask = cv2.morphologyEx((strength > 0).astype(np.uint8), cv2.MORPH_CLOSE, np.ones((_GAP, _GAP), np.uint8))
    _, _, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
    pixel = step * shrunk
    found = []
    for x, y, w, h, _ in stats[1:].tolist():
        evidence = float(strength[y : y + h, x : x + w].sum()) * pixel * pixel
        if min(w, h) < _MIN_SIDE or evidence < _MIN_PIECE_PX:
            continue
        piece = CodeRegion(x * pixel, y * pixel, (x + w) * pixel, (y + h) * pixel, evidence)
        if not any(piece.touches(box) for box in known):
            found.append(piece.widened((_MARGIN * max(w, h) + _WINDOW / 2) * pixel))
    return found


def _merged(regions: list[CodeRegion]) -> list[CodeRegion]:
    """Regions that touch become one: a code with wide bars shows in pieces."""
    merged: list[CodeRegion] = []
    for region in regions:
        whole = region
        while touching := [other for other in merged if other.touches(whole)]:
            merged = [other for other in merged if other not in touching]
            for other in touching:
                whole = whole.joined(other)
        merged.append(whole)
    return merged


def _strength(grey: Image, step: int, least_density: float) -> _Floats:
    """Edge density at every `step`-th pixel where it and the symmetry say that this may be a code, else 0."""
    rows, columns = slice(1, -1, step), slice(1, -1, step)
    # differences over the pixel's own neighbours: fine modules survive, which no shrunk picture would keep
    gx = cv2.subtract(grey[rows, 2::step], grey[rows, :-2:step], dtype=cv2.CV_32F)
    gy = cv2.subtract(grey[2::step, columns], grey[:-2:step, columns], dtype=cv2.CV_32F)
    xx, yy, xy = gx * gx, gy * gy, gx * gy
    energy = xx + yy
    # g^4 / |g|^2 = (g^2)^2 / |g|^2 with g^2 = (xx - yy) + 2i xy, and |g^2| = |g|^2
    box = (_WINDOW, _WINDOW)
    four_real = cv2.blur(energy - 8.0 * xy * xy / (energy + 1e-3), box)
    four_imag = cv2.blur(4.0 * (xx - yy) * xy / (energy + 1e-3), box)
    symmetry = cv2.magnitude(four_real, four_imag) / (cv2.blur(energy, box) + 1e-3)
    middles, window = grey[rows, columns], np.ones(box, np.uint8)
    levels = cv2.subtract(cv2.dilate(middles, window), cv2.erode(middles, window)).astype(np.float32)
    edge = energy > np.square(np.maximum(_MIN_STEP, _MIN_RELATIVE_STEP * levels))
    density = cv2.blur(edge.astype(np.float32), box)
    good = (density > least_density) & (symmetry > _MIN_SYMMETRY)
    return np.where(good, density, 0.0).astype(np.float32)
