"""EAN-13 and UPC-A codes that are too blurred for a reader of edges: found in a region, and read from several
bands across the bars that have to agree."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final, NamedTuple, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from flightd.core.geometry import Matrix
from flightd.core.types import Image
from flightd.vision.shelf.bar_extents import bar_extents
from flightd.vision.shelf.ean_profile import Place, ProfileRead, Start, best_start, read_again, read_profile
from flightd.vision.shelf.ean_symbol import MODULES

_Vector: TypeAlias = NDArray[np.float64]
_Plane: TypeAlias = NDArray[np.float32]

_LONGEST_PX: Final = 640
"""Larger regions are shrunk: what is blurred over many pixels loses nothing."""
_LEAST_STEP: Final = 12.0
_DIRECTIONS: Final = 2
_BANDS: Final = 5
_BAND_PX: Final = (4, 16)
_LEAST_TALL_PX: Final = 8
_LEAST_MODULE_PX: Final = 1.0
_NEAR: Final = np.linspace(-1.5, 1.5, 7)
_BENDS: Final = ((0.0,), (-1.5, 1.5))
"""Modules by which each end, and the middle between them, may lie elsewhere than it seems."""
_LEAST_SCORE: Final = 0.8
_MOST_STARTS: Final = 12
_LEAST_ONE_WAY: Final = 0.7
"""Share of the edges' strength that is across the bars: 0.87 and more in photographs of linear codes, at most
0.53 in those of others."""
_LEAST_MARGIN: Final = 8.0
_LEAST_EXPLAINED: Final = 0.88
_MOST_BLUR: Final = 1.7
_LEAST_AGREEING, _LEAST_UNFORCED = 3, 2
_MOST_FORCED: Final = 1.0
_LEAST_EVIDENCE: Final = 90.0
"""Wrong texts that bands agreed on, of codes drawn at random with more blur than can be read, came to 80."""


@dataclass(frozen=True, slots=True)
class BlurredRead:
    """13 digits; corners (4, 2) in pixels of the region, around from the left end of the upper edge; the sum
    of the bands' margins, and how many bands say it."""

    text: str
    corners: Matrix
    evidence: float
    bands: int


class _Band(NamedTuple):
    """The brightness across the bars at one height, and how the bars lean there (dx/dy for each x)."""

    y_px: float
    lean: _Vector
    profile: _Vector


class _Found(NamedTuple):
    start: Start
    band: int
    flipped: bool


def read_blurred_ean(grey: Image) -> BlurredRead | None:
    """The code of a region (H, W) that has one, or none that is sure enough."""
    shrunk = min(1.0, _LONGEST_PX / max(grey.shape))
    small = (
        cv2.resize(grey, None, fx=shrunk, fy=shrunk, interpolation=cv2.INTER_AREA) if shrunk < 1.0 else grey
    )
    for angle in _directions(np.asarray(small, np.uint8)):
        upright, region_from_upright = _upright(np.asarray(small, np.uint8), angle)
        found = _in_upright(upright)
        if found is not None:
            corners = found.corners @ region_from_upright[:, :2].T + region_from_upright[:, 2]
            return BlurredRead(found.text, corners / shrunk, found.evidence, found.bands)
    return None


def _gradients(grey: Image) -> tuple[_Plane, _Plane]:
    smooth = cv2.GaussianBlur(grey, (0, 0), 1.0)
    gx, gy = cv2.Sobel(smooth, cv2.CV_32F, 1, 0), cv2.Sobel(smooth, cv2.CV_32F, 0, 1)
    return np.asarray(gx, np.float32), np.asarray(gy, np.float32)


def _directions(grey: Image) -> Iterator[float]:
    """Across most edges (rad), the most frequent direction first."""
    gx, gy = _gradients(grey)
    size = cv2.magnitude(gx, gy)
    weight = np.where(size < _LEAST_STEP, 0.0, np.minimum(size, np.percentile(size, 90)))
    angle = np.arctan2(gy, gx) % np.pi
    often, _ = np.histogram(angle, 36, (0.0, np.pi), weights=weight)
    often = np.convolve(np.concatenate([often[-1:], often, often[:1]]), [0.5, 1.0, 0.5], "valid")
    for _ in range(_DIRECTIONS):
        best = int(often.argmax())
        if often[best] <= 0.0:
            return
        off = np.abs((angle - (best + 0.5) * np.pi / 36 + np.pi / 2) % np.pi - np.pi / 2)
        yield float(np.angle((weight * (off < np.pi / 14) * np.exp(2j * angle)).sum()) / 2)
        often[np.arange(best - 6, best + 7) % 36] = 0.0


def _upright(grey: Image, angle: float) -> tuple[Image, Matrix]:
    """The region with its bars upright, and the (2, 3) map from its pixels to the region's."""
    (height, width), c, s = grey.shape, np.cos(angle), np.sin(angle)
    size = int(abs(width * c) + abs(height * s)) + 1, int(abs(width * s) + abs(height * c)) + 1
    turn = np.array([[c, -s, 0.0], [s, c, 0.0]])
    turn[:, 2] = np.array([width - 1, height - 1]) / 2 - turn[:, :2] @ (np.array(size) - 1) / 2
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    turned = cv2.warpAffine(grey, turn, size, flags=flags, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(turned, np.uint8), turn


def _in_upright(upright: Image) -> BlurredRead | None:
    bands = list(_bands(upright))
    for found in _promising(bands):
        band = bands[found.band]
        read = read_profile(_seen(band, found.flipped), found.start)
        if _speaks(read):
            agreed = _agreed(bands, found, read)
            if agreed is not None:
                return agreed
    return None


def _speaks(read: ProfileRead) -> bool:
    return (
        read.margin >= _LEAST_MARGIN
        and read.explained >= _LEAST_EXPLAINED
        and read.blur <= _MOST_BLUR
        and read.place.module_px >= _LEAST_MODULE_PX
    )


def _agreed(bands: list[_Band], found: _Found, first: ProfileRead) -> BlurredRead | None:
    """What the other bands say where the bars of this one go on."""
    here = bands[found.band]
    reads = {found.band: first}
    for number, band in enumerate(bands):
        if number != found.band:
            expected = _carried(first.place, here, band, found.flipped)
            reads[number] = read_again(_seen(band, found.flipped), first, expected)
    same = {number: read for number, read in reads.items() if read.text == first.text and _speaks(read)}
    others = [read for read in reads.values() if read.text != first.text and _speaks(read)]
    evidence = sum(read.margin for read in same.values())
    against = sum(read.margin for read in others)
    unforced = sum(read.forced <= _MOST_FORCED for read in same.values())
    if len(same) < _LEAST_AGREEING or unforced < _LEAST_UNFORCED:
        return None
    if evidence < max(_LEAST_EVIDENCE, 4.0 * against):
        return None
    return BlurredRead(first.text, _corners(bands, same, found.flipped), evidence, len(same))


def _seen(band: _Band, flipped: bool) -> _Vector:
    return band.profile[::-1] if flipped else band.profile


def _carried(place: Place, here: _Band, there: _Band, flipped: bool) -> Place:
    """Where the symbol lies in another band, its bars being straight."""
    last = len(here.profile) - 1
    ends = [
        _along(float(last - x if flipped else x), here, there)
        for x in place.at(np.array([0.0, MODULES / 2, MODULES]))
    ]
    left, middle, right = (last - x if flipped else x for x in ends)
    growth = (left + right - 2.0 * middle) / (MODULES**2 / 2)
    return Place(left, (right - left) / MODULES, growth)


def _along(x_px: float, here: _Band, there: _Band) -> float:
    at = int(np.clip(round(x_px), 0, len(here.lean) - 1))
    return float(x_px + (here.lean[at] + there.lean[at]) / 2 * (there.y_px - here.y_px))


def _corners(bands: list[_Band], reads: dict[int, ProfileRead], flipped: bool) -> Matrix:
    first, last = min(reads), max(reads)
    wide = len(bands[first].profile) - 1
    edges = []
    for number in (first, last):
        ends = [float(x) for x in reads[number].place.at(np.array([0.0, float(MODULES)]))]
        edges.append([(wide - x if flipped else x, bands[number].y_px) for x in ends])
    upper, lower = edges
    return np.array([upper[0], upper[1], lower[1], lower[0]])


def _promising(bands: list[_Band]) -> Iterator[_Found]:
    """Where digits could be, the best first; modules of one width before those that grow on the way."""
    extents = [(at, extent) for at in range(0, len(bands), 2) for extent in bar_extents(bands[at].profile)]
    for bends in _BENDS:
        found = []
        for (number, extent), flipped in itertools.product(extents, (False, True)):
            profile = _seen(bands[number], flipped)
            places = _places(extent, bends, len(profile) - 1 if flipped else None)
            if places[0].module_px >= _LEAST_MODULE_PX:
                found.append(_Found(best_start(profile, places), number, flipped))
        likely = [one for one in found if one.start.score >= _LEAST_SCORE]
        yield from sorted(likely, key=lambda one: -one.start.score)[:_MOST_STARTS]


def _places(extent: tuple[float, float], bends: tuple[float, ...], last_px: int | None) -> list[Place]:
    """Where a symbol that seems to reach from one end to the other may lie, counted from the far end of the
    profile where that is given."""
    begin, end = extent if last_px is None else (last_px - extent[1], last_px - extent[0])
    module = (end - begin) / MODULES
    return [
        Place(
            begin + a * module,
            (end - begin + (b - a) * module) / MODULES,
            -middle * module / (MODULES / 2) ** 2,
        )
        for a, b, middle in itertools.product(_NEAR, _NEAR, bends)
    ]


def _bands(upright: Image) -> Iterator[_Band]:
    """Bands across the tallest stretch of rows with upright edges; lean is fitted to them, linear in x."""
    gx, gy = _gradients(upright)
    height, width = upright.shape
    bars = np.where(np.abs(gy) < 0.35 * np.abs(gx), gx * gx, 0.0).astype(np.float32)
    rows = np.convolve(bars.sum(axis=1), np.full(5, 0.2), "same")
    strong = np.flatnonzero(rows > 0.4 * np.sort(rows)[-max(1, height // 10)])
    if not len(strong):
        return
    run = max(np.split(strong, np.flatnonzero(np.diff(strong) > 4) + 1), key=len)
    top, tall = int(run[0]), int(run[-1]) + 1 - int(run[0])
    if tall < _LEAST_TALL_PX:
        return
    inside = slice(top, top + tall)
    if bars[inside].sum() < _LEAST_ONE_WAY * (np.square(gx[inside]) + np.square(gy[inside])).sum():
        return
    thick = int(np.clip(tall // _BANDS, *_BAND_PX))
    grey, x = upright.astype(np.float32), np.arange(width)
    for number in range(_BANDS):
        y = top + tall * (number + 0.5) / _BANDS
        near = slice(max(0, int(y - thick)), min(height, int(y + thick)))
        weight = bars[near].sum(axis=0)
        if np.count_nonzero(weight) < 10:
            continue
        leaning = -np.where(bars[near] > 0, gx[near] * gy[near], 0.0).sum(axis=0) / np.maximum(weight, 1e-6)
        columns = np.stack([np.ones(width), x / width - 0.5], axis=1)
        root = np.sqrt(weight)
        solved = np.linalg.lstsq(columns * root[:, None], leaning * root, rcond=None)[0]
        lean = columns @ solved
        down = np.arange(int(y - thick / 2), int(y + thick / 2) + 1)
        at_x = (x + lean * (down[:, None] - y)).astype(np.float32)
        at_y = np.repeat(down[:, None].astype(np.float32), width, axis=1)
        sheared = cv2.remap(grey, at_x, at_y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        yield _Band(y, lean, np.asarray(np.median(sheared, axis=0), np.float64))
