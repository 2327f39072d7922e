"""Where in a picture a label may be: bright, even-edged regions with something dark on them."""

from __future__ import annotations

from typing import TypeAlias

import cv2
import numpy as np

from flightd.core.types import Image

Box: TypeAlias = tuple[int, int, int, int]
"""(x0, y0, x1, y1) in pixels, far ends excluded."""

_BRIGHT_PART = 0.55
"""Of the lightest in the picture: paper in half the light is one label with paper in full light."""
_LEAST_W_PX, _LEAST_H_PX = 48, 20
_LEAST_FILL = 0.45
"""Part of its box that a label covers at least; one that is turned by 45 degrees covers half."""
_LEAST_INK = 0.01
_GAP_PX = 15
"""Text and bars are no holes in a label."""


def label_regions(bgr: Image, most: int = 4) -> list[Box]:
    """At most `most` boxes of a picture, (H, W, 3) BGR, largest first, with a little room."""
    grey = cv2.cvtColor(bgr, cv2.COLOR_BGR2GRAY)
    light = float(np.percentile(grey, 99.0))
    bright = (grey >= _BRIGHT_PART * light).astype(np.uint8)
    closed = cv2.morphologyEx(bright, cv2.MORPH_CLOSE, np.ones((_GAP_PX, _GAP_PX), np.uint8))
    opened = cv2.morphologyEx(closed, cv2.MORPH_OPEN, np.ones((9, 9), np.uint8))
    _, labels, stats, _ = cv2.connectedComponentsWithStats(opened, connectivity=4)
    found: list[tuple[int, Box]] = []
    for number, (x, y, w, h, area) in enumerate(stats[1:].tolist(), start=1):
        if w < _LEAST_W_PX or h < _LEAST_H_PX or area < _LEAST_FILL * w * h:
            continue
        part = labels[y : y + h, x : x + w] == number
        ink = 1.0 - float(bright[y : y + h, x : x + w][part].mean())
        if ink >= _LEAST_INK:
            found.append((area, _with_room(x, y, w, h, grey.shape)))
    return [box for _, box in sorted(found, reverse=True)[:most]]


def _with_room(x: int, y: int, w: int, h: int, shape: tuple[int, ...]) -> Box:
    room = _GAP_PX
    return max(0, x - room), max(0, y - room), min(shape[1], x + w + room), min(shape[0], y + h + room)
