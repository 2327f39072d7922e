"""How bright a picture is: its middle, what is lost at both ends, and its strips one by one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flightd.core.types import Image

BLACK, BURNT = 4, 252
"""A sample whose brightest channel is no more, or no less, has lost what it showed."""
STRIPS = 12
"""Across the picture, each of some of its rows: a sensor reads row by row."""
_COLUMNS, _ROWS = 80, 180
"""Samples across and down, about."""


@dataclass(frozen=True, slots=True)
class Brightness:
    """`median` of 0 to 255; the shares of samples that are `black` and `burnt` out; of each strip, from the
    top, the mean of its middle half."""

    median: float
    black: float
    burnt: float
    strips: tuple[float, ...]


def brightness_of(bgr: Image) -> Brightness:
    """Of a (H, W, 3) picture; a millisecond."""
    samples = bgr[:: max(bgr.shape[0] // _ROWS, 1), :: max(bgr.shape[1] // _COLUMNS, 1)]
    brightest = samples.max(axis=2)
    grey = samples.mean(axis=2, dtype=np.float32)
    return Brightness(
        median=float(np.median(grey)),
        black=float((brightest <= BLACK).mean()),
        burnt=float((brightest >= BURNT).mean()),
        strips=tuple(map(_middle, np.array_split(grey, STRIPS))),
    )


def _middle(values: NDArray[np.float32]) -> float:
    """The mean of the middle half: as little moved by what is rare as the median, and no whole number."""
    ordered = np.sort(values, axis=None)
    quarter = len(ordered) // 4
    return float(ordered[quarter : len(ordered) - quarter].mean())
