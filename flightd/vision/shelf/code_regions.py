"""Where in a picture a code may be: dense edges that keep to two perpendicular directions.

Bars and modules have edges everywhere, and all of them run along or across the code; gravel has them in
every direction, a rack's beams have few.  The measure is that of the structure tensor with four-fold
symmetry, |mean(g^4 / |g|^2)| / mean(|g|^2) for the gradient g as a complex number.  Where there are fewer
edges than a code has, of whatever direction, nobody need look for one.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
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
_MIN_SIDE, _MIN_BUSY_SIDE = 8, 5
_MIN_PIECE_PX = 500.0
_MIN_EVIDENCE_PX = 1800.0
"""A code of 25 modules read at 2.5 pixels for each covers as much; the corner of a box less."""
_LEAST_PART, _LEAST_PIECE_PART = 0.06, 0.05
"""Evidence as a part of a region's area, margins included, and of a single piece's: codes have 0.07 and 0.06
at least, what the edges of goods and racks happen to add up to 0.05 and 0.04 at most."""
_MARGIN = 0.25
_QUIET = 0.15
_BUSY_DENSITY = 0.22
"""More than the edge of a box has; in codes of fine modules it is 0.27 and more."""
_MOST_BUSY = 0.6
"""Part of the picture that busy boxes may cover together, so that looking at them alone is worth it."""
_SMALL_PICTURE_PX = 400_000
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

    @property
    def area(self) -> int:
        return (self.x1 - self.x0) * (self.y1 - self.y0)

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

    def widened(self, aside: float, above: float) -> CodeRegion:
        """With so much more room to the left and right, above and below."""
        x0, y0, x1, y1 = self.x0 - aside, self.y0 - above, self.x1 + aside, self.y1 + above
        return CodeRegion(int(x0), int(y0), int(x1) + 1, int(y1) + 1, self.evidence)

    def contains(self, x: float, y: float) -> bool:
        return self.x0 <= x < self.x1 and self.y0 <= y < self.y1


@dataclass(frozen=True, slots=True)
class _Layer:
    """Edges at every `pixel`-th pixel: their density about it, the squares and the product of the gradient's
    parts (right, down), and the density that a code has."""

    density: _Floats
    squares: tuple[_Floats, _Floats, _Floats]
    pixel: int
    least_density: float

    def symmetry(self) -> _Floats:
        """The four-fold symmetry, 0..1."""
        xx, yy, xy = self.squares
        energy, box = xx + yy, (_WINDOW, _WINDOW)
        # g^4 / |g|^2 = (g^2)^2 / |g|^2 with g^2 = (xx - yy) + 2i xy, and |g^2| = |g|^2
        four_real = cv2.blur(energy - 8.0 * xy * xy / (energy + 1e-3), box)
        four_imag = cv2.blur(4.0 * (xx - yy) * xy / (energy + 1e-3), box)
        found: _Floats = cv2.magnitude(four_real, four_imag) / (cv2.blur(energy, box) + 1e-3)
        return found

    def box(self, x: int, y: int, w: int, h: int, evidence: float) -> CodeRegion:
        """Samples as pixels of the picture."""
        px = self.pixel
        return CodeRegion(x * px, y * px, (x + w) * px, (y + h) * px, evidence)

    def margin(self, long: int) -> float:
        """Pixels in which a code that shows over so many samples may go on."""
        return (_MARGIN * long + _WINDOW / 2) * self.pixel

    def quiet(self, long: int) -> float:
        """Pixels beside a code so many samples long that its quiet zone may take."""
        return (_QUIET * long + _WINDOW / 4) * self.pixel


class CodeSearch:
    """Where codes may be in a picture, `grey` (H, W)."""

    def __init__(self, grey: Image) -> None:
        self._shape = grey.shape
        # not exactly half: sharp modules that fall on whole pixels would have fewer edges than blurred ones
        size = grey.shape[1] // 2 + 1, grey.shape[0] // 2 + 1
        half = np.asarray(cv2.resize(grey, size, interpolation=cv2.INTER_LINEAR), np.uint8)
        # fine modules are dense edges at full size only, large ones at half size only
        layers = _layer(grey, 1, _MIN_DENSITY), _layer(half, 2, _MIN_DENSITY_HALF)
        self._layers = [layer for layer in layers if layer is not None]

    def busy(self) -> list[CodeRegion] | None:
        """Boxes with all codes of modules up to 6 pixels, and much that is none: edges of any direction, with
        room for quiet zones.  None where the picture is small, or hardly larger than these."""
        height, width = self._shape
        if height * width <= _SMALL_PICTURE_PX or not self._layers:
            return None
        fine, pieces = self._layers[0], []
        for x, y, w, h in _boxes(fine.density > _BUSY_DENSITY):
            if min(w, h) >= _MIN_BUSY_SIDE:
                pieces.append(fine.box(x, y, w, h, 0.0).widened(fine.quiet(w), fine.quiet(h)))
        found = [self._clipped(region) for region in _merged(pieces)]
        area = sum(region.area for region in found)
        return found if area < _MOST_BUSY * height * width else None

    def regions(self, known: Sequence[Matrix] = (), most: int = 4) -> list[CodeRegion]:
        """At most `most` boxes that look like codes, margins included, best first; without what the `known`
        codes, (4, 2) corners each, explain."""
        boxes = [_surroundings(corners) for corners in known]
        pieces = [piece for layer in self._layers for piece in _pieces(layer, boxes)]
        whole = [part for one in _merged(pieces) for part in _dense(one, pieces)]
        found = [self._clipped(one) for one in whole if one.evidence >= _MIN_EVIDENCE_PX]
        return sorted(found, key=lambda region: -region.evidence)[:most]

    def _clipped(self, r: CodeRegion) -> CodeRegion:
        height, width = self._shape
        return CodeRegion(max(0, r.x0), max(0, r.y0), min(width, r.x1), min(height, r.y1), r.evidence)


def shrunk(grey: Image, times: int) -> Image:
    """(H // times, W // times) of a picture (H, W): the mean of each square; empty where there is none."""
    height, width = (side // times for side in grey.shape)
    if not height or not width:
        return np.empty((height, width), np.uint8)
    even = grey[: height * times, : width * times]
    return np.asarray(cv2.resize(even, (width, height), interpolation=cv2.INTER_AREA), np.uint8)


def _surroundings(corners: Matrix) -> CodeRegion:
    """The box of a code with what belongs to it: its printed text, its frame, an add-on."""
    (x0, y0), (x1, y1) = corners.min(axis=0), corners.max(axis=0)
    around = _AROUND * max(x1 - x0, y1 - y0)
    return CodeRegion(int(x0), int(y0), int(x1) + 1, int(y1) + 1, 0.0).widened(around, around)


def _boxes(mask: NDArray[np.bool_]) -> Iterator[tuple[int, int, int, int]]:
    """(x, y, width, height) of what hangs together, small gaps closed."""
    closed = cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((_GAP, _GAP), np.uint8))
    outlines, _ = cv2.findContours(closed, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
    for outline in outlines:
        x, y, w, h = cv2.boundingRect(outline)
        yield x, y, w, h


def _pieces(layer: _Layer, known: Sequence[CodeRegion]) -> Iterator[CodeRegion]:
    """Connected evidence that none of the `known` boxes touches."""
    dense = layer.density > layer.least_density
    if not dense.any():
        return
    good = dense & (layer.symmetry() > _MIN_SYMMETRY)
    strength = np.where(good, layer.density, 0.0)
    for x, y, w, h in _boxes(good):
        evidence = float(strength[y : y + h, x : x + w].sum()) * layer.pixel**2
        if min(w, h) < _MIN_SIDE or evidence < _MIN_PIECE_PX:
            continue
        piece = layer.box(x, y, w, h, evidence)
        if not any(piece.touches(box) for box in known):
            margin = layer.margin(max(w, h))
            yield piece.widened(margin, margin)


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


def _dense(region: CodeRegion, pieces: Sequence[CodeRegion]) -> Sequence[CodeRegion]:
    """A merged region, or those of its pieces that may be codes by themselves where all lie scattered."""
    if region.evidence >= _LEAST_PART * region.area:
        return (region,)
    return [one for one in pieces if one.touches(region) and one.evidence >= _LEAST_PIECE_PART * one.area]


def _layer(grey: Image, times: int, least_density: float) -> _Layer | None:
    """The edges of a picture that is shrunk so many times; None where it is too small to have any."""
    step = max(math.ceil(max(grey.shape) / _SAMPLES), 1)
    if min(grey.shape) < 3 * step:
        return None
    rows, columns = slice(1, -1, step), slice(1, -1, step)
    # differences over the pixel's own neighbours: fine modules survive, which no shrunk picture would keep
    gx = cv2.subtract(grey[rows, 2::step], grey[rows, :-2:step], dtype=cv2.CV_32F)
    gy = cv2.subtract(grey[2::step, columns], grey[:-2:step, columns], dtype=cv2.CV_32F)
    xx, yy, xy = gx * gx, gy * gy, gx * gy
    middles, window = grey[rows, columns], np.ones((_WINDOW, _WINDOW), np.uint8)
    levels = cv2.subtract(cv2.dilate(middles, window), cv2.erode(middles, window)).astype(np.float32)
    edge = xx + yy > np.square(np.maximum(_MIN_STEP, _MIN_RELATIVE_STEP * levels))
    density = np.asarray(cv2.blur(edge.astype(np.float32), (_WINDOW, _WINDOW)), np.float32)
    return _Layer(density, (xx, yy, xy), step * times, least_density)
