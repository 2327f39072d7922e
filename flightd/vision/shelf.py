"""One look at a shelf: the codes in a front camera's picture, and what each wanted place shows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np

from flightd.core.scanning import CodeSet, Occupancy, Place, PlaceLook
from flightd.core.types import CodeRead, Image
from flightd.vision.codes import read_codes
from flightd.vision.occupancy import judge
from flightd.vision.small_jpeg import evidence_jpeg, picture_name

_MARGIN = 0.1
"""Room around the wanted places, as a part of their size: a pose is never exact."""
_INSET = (0.14, 0.18)
"""Part of a place's width and height at its border that may show uprights and beams, not the opening."""


def read_shelf(
    bgr: Image, seq: int, stamp_ns: int, places: Sequence[Place]
) -> tuple[CodeSet, dict[str, bytes]]:
    """The codes and the places of one picture, (H, W, 3) BGR; the evidence of each place by its name.

    Only the part of the picture with the places is read.
    """
    height, width = bgr.shape[:2]
    box = _around(places, width, height)
    started = cv2.getTickCount()
    reads = _shifted(read_codes(np.ascontiguousarray(bgr[box[1] : box[3], box[0] : box[2]])), box, bgr)
    read = cv2.getTickCount()
    looks, kept = [], {}
    for place in places:
        look, jpeg = _look(bgr, place, reads)
        looks.append(look)
        if jpeg:
            kept[look.evidence] = jpeg
    per_ms = cv2.getTickFrequency() * 1e-3
    timings = {"codes": (read - started) / per_ms, "places": (cv2.getTickCount() - read) / per_ms}
    return CodeSet(seq, stamp_ns, width, height, reads, tuple(looks), timings), kept


def _around(places: Sequence[Place], width: int, height: int) -> tuple[int, int, int, int]:
    """(x0, y0, x1, y1) of the places in pixels, far ends excluded; the whole picture if there are none."""
    if not places:
        return 0, 0, width, height
    boxes = np.array([_box(place, width, height, -_MARGIN, -_MARGIN) for place in places])
    (x0, y0), (x1, y1) = boxes[:, :2].min(axis=0), boxes[:, 2:].max(axis=0)
    return int(x0), int(y0), int(x1), int(y1)


def _box(place: Place, width: int, height: int, inset_x: float, inset_y: float) -> tuple[int, int, int, int]:
    """The pixels of a place, made smaller by parts of its size, inside the picture."""
    centre = (width - 1) / 2, (height - 1) / 2
    corners = np.array(place.quad_px) + centre
    low, high = corners.min(axis=0), corners.max(axis=0)
    inset = (high - low) * (inset_x, inset_y)
    low, high = low + inset, high - inset
    x0, x1 = (int(np.clip(x, 0, width)) for x in (low[0], high[0] + 1))
    y0, y1 = (int(np.clip(y, 0, height)) for y in (low[1], high[1] + 1))
    return x0, y0, x1, y1


def _shifted(
    reads: Sequence[CodeRead], box: tuple[int, int, int, int], picture: Image
) -> tuple[CodeRead, ...]:
    """The reads of a part of the picture, in the whole picture's centred coordinates."""
    height, width = picture.shape[:2]
    dx, dy = (box[0] + box[2] - width) / 2, (box[1] + box[3] - height) / 2
    return tuple(
        replace(read, corners_px=tuple((round(x + dx, 1), round(y + dy, 1)) for x, y in read.corners_px))
        for read in reads
    )


def _look(bgr: Image, place: Place, reads: Sequence[CodeRead]) -> tuple[PlaceLook, bytes]:
    """What one place shows, and its picture."""
    height, width = bgr.shape[:2]
    x0, y0, x1, y1 = _box(place, width, height, *_INSET)
    occupancy = Occupancy.UNSURE
    if x1 > x0 and y1 > y0:
        occupancy = judge(bgr[y0:y1, x0:x1])
    if occupancy is not Occupancy.GOODS and any(_contains(place, read) for read in reads):
        occupancy = Occupancy.GOODS
    x0, y0, x1, y1 = _box(place, width, height, 0.0, 0.0)
    jpeg = evidence_jpeg(np.ascontiguousarray(bgr[y0:y1, x0:x1])) if x1 > x0 and y1 > y0 else b""
    name = picture_name(jpeg) if jpeg else ""
    return PlaceLook(place.location, place.quad_px, place.share, occupancy, name), jpeg


def _contains(place: Place, read: CodeRead) -> bool:
    x, y = np.array(read.corners_px).mean(axis=0)
    quad = np.array(place.quad_px, np.float32)
    return cv2.pointPolygonTest(quad, (float(x), float(y)), False) >= 0
