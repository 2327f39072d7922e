"""Is a place on the shelf empty, are there goods, or is it covered?  From its patch of a picture.

An opening that is empty shows its dim back and little structure; goods stand in it as large bright faces
with edges of their own; a cover (foil, a sheet, a pallet put in front) is one flat bright face without a
label.  The measures are shares of the patch, so they need no calibration; what fits no case is `UNSURE`.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from flightd.core.scanning import Occupancy
from flightd.core.types import Image

_LONGEST_PX = 160
_SMALLEST_PX = 12


@dataclass(frozen=True, slots=True)
class PatchMeasures:
    """Shares of a patch, 0..1: `dark` pixels, `light` pixels (as a label's paper), pixels on `edges`."""

    dark: float
    light: float
    edges: float


def measure(patch: Image) -> PatchMeasures:
    """Measures of a patch, (H, W, 3) BGR or (H, W)."""
    grey = cv2.cvtColor(patch, cv2.COLOR_BGR2GRAY) if patch.ndim == 3 else patch
    scale = min(1.0, _LONGEST_PX / max(grey.shape))
    size = (max(1, round(grey.shape[1] * scale)), max(1, round(grey.shape[0] * scale)))
    small = cv2.GaussianBlur(cv2.resize(grey, size, interpolation=cv2.INTER_AREA), (3, 3), 0)
    level = small.astype(np.float32)
    gx, gy = cv2.Sobel(level, cv2.CV_32F, 1, 0), cv2.Sobel(level, cv2.CV_32F, 0, 1)
    steep = cv2.magnitude(gx, gy) > 60.0
    return PatchMeasures(float((level < 70).mean()), float((level > 185).mean()), float(steep.mean()))


def judge(patch: Image) -> Occupancy:
    """What the patch of one opening shows."""
    if min(patch.shape[:2]) < _SMALLEST_PX:
        return Occupancy.UNSURE
    m = measure(patch)
    if m.dark > 0.9 and m.light < 0.01 and m.edges < 0.05:
        return Occupancy.EMPTY
    if m.dark < 0.5:
        return Occupancy.GOODS
    return Occupancy.UNSURE
