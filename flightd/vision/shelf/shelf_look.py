"""One look at a shelf: the codes in a front camera's picture, and what each wanted place shows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import TypeAlias

import cv2
import numpy as np

from flightd.core.inventory import PlaceFill
from flightd.core.scanning import CodeSet, Occupancy, Place, PlaceLook, Quad
from flightd.core.types import CodeRead, Image
from flightd.vision.shelf import empty_deck as deck
from flightd.vision.shelf.code_reader import read_codes
from flightd.vision.shelf.evidence_jpeg import evidence_jpeg, picture_name
from flightd.vision.shelf.fill_level import OpeningLook, fill_level
from flightd.vision.shelf.occupancy import judge, known_white, light_on, lightest, paper_level
from flightd.vision.shelf.opening_raster import onto_opening

Box: TypeAlias = tuple[int, int, int, int]
"""(x0, y0, x1, y1) in pixels, far ends excluded."""

_LIGHTER = 75.0
"""The paper counts that is lighter than so many of hundred labels' is."""
_MARGIN = 0.1
"""Room around the wanted places, as a part of their size: a pose is never exact."""


def read_shelf(
    bgr: Image,
    seq: int,
    stamp_ns: int,
    places: Sequence[Place],
    exposure: float = 1.0,
    gain: float = 1.0,
) -> tuple[CodeSet, dict[str, bytes]]:
    """The codes and the places of one picture, (H, W, 3) BGR; the evidence by its name, of each place of
    which the picture is worth more than what is kept.

    Only the part of the picture with the places is read.
    """
    height, width = bgr.shape[:2]
    box = _around(places, width, height)
    started = cv2.getTickCount()
    reads = _shifted(read_codes(_cut(bgr, box)), box, bgr)
    read = cv2.getTickCount()
    papers = _papers(bgr, reads)
    usual, whites = known_white(lightest(bgr)), _whites(places, papers)
    looks, kept = [], {}
    for place in places:
        look, jpeg = _look(bgr, place, reads, whites.get(place.level), usual)
        looks.append(look)
        if jpeg:
            kept[look.evidence] = jpeg
    per_ms = cv2.getTickFrequency() * 1e-3
    timings = {"codes": (read - started) / per_ms, "places": (cv2.getTickCount() - read) / per_ms}
    white = _white([level for _, level in papers]) if papers else lightest(_cut(bgr, box))
    how = timings, exposure, gain, round(white, 1)
    return CodeSet(seq, stamp_ns, width, height, reads, tuple(looks), *how), kept


def _cut(bgr: Image, box: Box) -> Image:
    """What is within a box."""
    x0, y0, x1, y1 = box
    return np.ascontiguousarray(bgr[y0:y1, x0:x1])


def _around(places: Sequence[Place], width: int, height: int) -> Box:
    """The pixels of all places with some room; the whole picture if there are none."""
    if not places:
        return 0, 0, width, height
    boxes = np.array([_box(place.quad_px, width, height, _MARGIN) for place in places])
    (x0, y0), (x1, y1) = boxes[:, :2].min(axis=0), boxes[:, 2:].max(axis=0)
    return int(x0), int(y0), int(x1), int(y1)


def _box(quad: Quad, width: int, height: int, room: float = 0.0) -> Box:
    """The pixels around a quad with `room` as a part of its size, inside the picture."""
    centre = (width - 1) / 2, (height - 1) / 2
    corners = np.array(quad) + centre
    low, high = corners.min(axis=0), corners.max(axis=0)
    spare = (high - low) * room
    low, high = low - spare, high + spare
    x0, x1 = (int(np.clip(x, 0, width)) for x in (low[0], high[0] + 1))
    y0, y1 = (int(np.clip(y, 0, height)) for y in (low[1], high[1] + 1))
    return x0, y0, x1, y1


def _shifted(reads: Sequence[CodeRead], box: Box, picture: Image) -> tuple[CodeRead, ...]:
    """The reads of a part of the picture, in the whole picture's centred coordinates."""
    height, width = picture.shape[:2]
    dx, dy = (box[0] + box[2] - width) / 2, (box[1] + box[3] - height) / 2
    return tuple(
        replace(read, corners_px=tuple((round(x + dx, 1), round(y + dy, 1)) for x, y in read.corners_px))
        for read in reads
    )


def _papers(bgr: Image, reads: Sequence[CodeRead]) -> list[tuple[CodeRead, float]]:
    """The codes with the grey level of their labels' paper."""
    height, width = bgr.shape[:2]
    labels = ((read, _cut(bgr, _box(read.corners_px, width, height, _MARGIN))) for read in reads)
    return [(read, paper_level(label)) for read, label in labels if label.size]


def _whites(places: Sequence[Place], papers: Sequence[tuple[CodeRead, float]]) -> dict[int, float]:
    """The grey level of white paper on each level on which there are labels: how one is lit says nothing of
    the next."""
    found: dict[int, list[float]] = {}
    for place in places:
        here = [level for read, level in papers if _contains(_lit(place), read)]
        found.setdefault(place.level, []).extend(here)
    return {level: _white(here) for level, here in found.items() if here}


def _white(papers: Sequence[float]) -> float:
    """White by the paper of several labels: some are grey, or in the shade of goods."""
    return float(np.percentile(papers, _LIGHTER))


def _lit(place: Place) -> Quad:
    return place.lit_px or place.quad_px


def _look(
    bgr: Image, place: Place, reads: Sequence[CodeRead], paper: float | None, usual: float
) -> tuple[PlaceLook, bytes]:
    """What one place shows, and its picture.  `paper` is the grey level of labels on its level, None where
    there are none: then the `usual` one of white counts, that of the whole picture."""
    height, width = bgr.shape[:2]
    white = usual if paper is None else known_white(paper)
    occupancy = Occupancy.UNSURE
    # in its core: a code below may be the shelf's own label
    if any(_contains(place.core_px, read) for read in reads):
        occupancy = Occupancy.GOODS
    elif _is_inside(place.core_px, width, height):
        x0, y0, x1, y1 = _box(place.core_px, width, height)
        core = bgr[y0:y1, x0:x1]
        occupancy = judge(core, white, partial(deck.is_seen, bgr, place.deck_px, core, white))
    x0, y0, x1, y1 = _box(place.quad_px, width, height)
    lit = _box(_lit(place), width, height)
    light = light_on(bgr[lit[1] : lit[3], lit[0] : lit[2]], white)
    opening = _opening(bgr, place, reads, white)
    fill = None if opening is None else opening.fill
    shows_deck = occupancy is Occupancy.EMPTY or _would_show_deck(place, width, height)
    if occupancy is Occupancy.EMPTY:
        if opening is not None and opening.is_clear:
            fill = PlaceFill(0.0)
        else:  # its middle is, and goods may stand beside that
            occupancy = Occupancy.UNSURE
    elif occupancy is Occupancy.COVERED and opening is not None:
        fill = PlaceFill(None)
    has_code = any(read.text != place.location and _contains(place.quad_px, read) for read in reads)
    look = PlaceLook(
        place.location,
        place.quad_px,
        place.share,
        occupancy,
        light=light,
        fill=fill,
        code=has_code,
        deck=shows_deck,
        white=None if paper is None else round(paper, 1),
    )
    if not (look.worth > place.kept and x1 > x0 and y1 > y0):
        return look, b""
    jpeg = evidence_jpeg(np.ascontiguousarray(bgr[y0:y1, x0:x1]))
    return replace(look, evidence=picture_name(jpeg)), jpeg


def _opening(bgr: Image, place: Place, reads: Sequence[CodeRead], white: float) -> OpeningLook | None:
    """What is seen of a place from end to end, None where the picture does not show enough of its opening."""
    opening = place.opening
    if opening is None:
        return None
    codes = []
    for read in reads:
        corners_m = onto_opening(np.array(read.corners_px), opening)
        (x0, low), (x1, high) = corners_m.min(axis=0), corners_m.max(axis=0)
        if x0 >= 0.0 and x1 <= opening.width_m and low >= 0.0 and high <= opening.height_m:
            codes.append((float(x0), float(low), float(x1), float(high)))
    return fill_level(bgr, opening, white, codes)


def _would_show_deck(place: Place, width: int, height: int) -> bool:
    inside = _is_inside(place.core_px, width, height) and _is_inside(place.deck_px[2:], width, height)
    rows = [y for _, y in place.core_px]
    return inside and deck.would_show(place.deck_px, max(rows) - min(rows))


def _is_inside(quad: Quad, width: int, height: int) -> bool:
    return all(abs(x) <= (width - 1) / 2 and abs(y) <= (height - 1) / 2 for x, y in quad)


def _contains(quad: Quad, read: CodeRead) -> bool:
    """Whether the middle of a code is in a part of the picture."""
    x, y = np.array(read.corners_px).mean(axis=0)
    return cv2.pointPolygonTest(np.array(quad, np.float32), (float(x), float(y)), False) >= 0
