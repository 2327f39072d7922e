"""Where along a profile across bars a linear code may lie, by the paper beside it."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import Final, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

_Vector: TypeAlias = NDArray[np.float64]

_LEAST_LONG_PX: Final = 90.0
_INNER_GAP, _OUTER_GAP = 0.065, 0.035
"""Of an EAN-13's length: light inside is four modules wide at most, beside it seven at least, less blur."""


def bar_extents(profile: _Vector) -> list[tuple[float, float]]:
    """From where to where in a profile a symbol may lie: dark, with only short light stretches inside and a
    longer one at each end.  What is dark is judged by the paper around it, with two thresholds."""
    bright, count = cv2.GaussianBlur(profile[None].astype(np.float32), (0, 0), 0.8), len(profile)
    found: list[tuple[float, float]] = []
    for part, threshold in itertools.product((0.08, 0.16), (0.1, 0.2)):
        window = max(9, int(part * count)) | 1
        paper = cv2.blur(cv2.dilate(bright, np.ones((1, window), np.uint8)), (window, 1))
        dark = (1.0 - bright / np.maximum(paper, 1.0))[0]
        inked = dark[dark > 0.05]
        if len(inked) < 20:
            continue
        is_dark = dark > max(0.03, threshold * float(np.percentile(inked, 80)))
        edges = np.flatnonzero(np.diff(np.concatenate([[0], is_dark.astype(np.int8), [0]]))).reshape(-1, 2)
        found += _between_quiet(edges.tolist(), count)
    return _distinct(found)


def _between_quiet(runs: list[list[int]], count: int) -> Iterator[tuple[float, float]]:
    for first, (begin, _) in enumerate(runs):
        widest = 0
        for last in range(first, len(runs)):
            if last > first:
                widest = max(widest, runs[last][0] - runs[last - 1][1])
            end = runs[last][1]
            length = end - begin
            if widest > _INNER_GAP * max(length, count / 4):
                break
            before = begin - (runs[first - 1][1] if first else 0)
            after = (runs[last + 1][0] if last + 1 < len(runs) else count) - end
            if length >= _LEAST_LONG_PX and widest <= _INNER_GAP * length < _INNER_GAP / _OUTER_GAP * min(
                before, after
            ):
                yield float(begin), float(end - 1)


def _distinct(extents: list[tuple[float, float]]) -> list[tuple[float, float]]:
    kept: list[tuple[float, float]] = []
    for begin, end in extents:
        if all(abs(begin - b) >= 2 or abs(end - e) >= 2 for b, e in kept):
            kept.append((begin, end))
    return kept
