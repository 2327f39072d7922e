"""By how much the edges of a region are turned: bars keep to one direction, modules of a matrix to two."""

from __future__ import annotations

import cv2
import numpy as np

from flightd.core.types import Image

_LEAST_STEP = 200.0
"""By Scharr's filter: some six grey levels to the pixel."""
_BINS = 18
"""Of five degrees each: directions a right angle apart are one."""
_NEAR_RAD = np.pi / 14
_LEAST_SHARE = 0.12


def edges_turn_rad(grey: Image, least_rad: float) -> float | None:
    """The turn that most edges of `grey` (H, W) have against the picture's own two directions, clockwise,
    within 45 degrees; of those from `least_rad` on.  None where hardly any are turned so far."""
    gx, gy = cv2.Scharr(grey, cv2.CV_32F, 1, 0), cv2.Scharr(grey, cv2.CV_32F, 0, 1)
    size = cv2.magnitude(gx, gy)
    edges = size > _LEAST_STEP
    if not edges.any():
        return None
    # strong edges count for their number, not their strength: the rim of a box is no label
    weight = np.minimum(size[edges], np.percentile(size[edges], 50))
    turn = (np.arctan2(gy[edges], gx[edges]) + np.pi / 4) % (np.pi / 2) - np.pi / 4
    often, _ = np.histogram(turn, _BINS, (-np.pi / 4, np.pi / 4), weights=weight)
    middles = (np.arange(_BINS) + 0.5) * np.pi / 2 / _BINS - np.pi / 4
    often[np.abs(middles) < least_rad] = 0.0
    often = np.convolve(np.concatenate([often[-1:], often, often[:1]]), [0.5, 1.0, 0.5], "valid")
    best = int(often.argmax())
    if often[best] < _LEAST_SHARE * weight.sum():
        return None
    off = (turn - middles[best] + np.pi / 4) % (np.pi / 2) - np.pi / 4
    near = (np.abs(off) < _NEAR_RAD) & (np.abs(turn) >= least_rad)
    return float(middles[best] + (weight[near] * off[near]).sum() / weight[near].sum())
