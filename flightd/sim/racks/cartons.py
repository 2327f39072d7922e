"""Cardboard boxes on a front, in mixed rows or as a regular stack: where they stand and how they look."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from flightd.core.types import Image

_CARDBOARD = ((78.0, 122.0, 164.0), (92.0, 138.0, 178.0), (110.0, 150.0, 186.0), (70.0, 108.0, 146.0))
_PLAIN = ((205.0, 208.0, 210.0), (60.0, 60.0, 62.0))
_WORDS = ("FRAGILE", "KEEP DRY", "HANDLE WITH CARE", "MADE IN EU", "PARTS")
_SHADE = 18
"""Between the boxes, and where one is missing."""
_CARTON_M = ((0.14, 0.34), (0.13, 0.30))
"""Width and height of the cartons of a regular stack."""
_MOST_GAP_M = 0.006

Tone: TypeAlias = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Box:
    """One box, in texels of its front: `slit` is the row of the slit between taped flaps, from its top;
    `strip` a strip of tape at its upper edge.  `words` are printed from `words_left` on."""

    left: int
    right: int
    top: int
    below: int
    tone: Tone
    slit: int | None = None
    strip: bool = False
    words: str = ""
    words_left: int = 0


Rows: TypeAlias = tuple[tuple[Box, ...], ...]
"""The boxes of a front, the highest row first."""


@dataclass(frozen=True, slots=True)
class CartonStack:
    """A stack of cartons of one kind, `columns` by `rows` in its front.  Of the highest row so many are
    `missing`; where it is `bonded` every second row has a carton more or less than the others; `low` is the
    part of their height by which the cartons of one row are lower."""

    columns: int
    rows: int
    looks: int
    film: bool = False
    missing: int = 0
    bonded: bool = False
    low: float = 0.0

    @property
    def columns_of_rows(self) -> tuple[int, ...]:
        """How many cartons stand in each row, the highest first."""
        more = [self.columns + (self.bonded and row % 2 == 1) for row in range(self.rows)]
        return more[0] - self.missing, *more[1:]

    @property
    def share(self) -> float:
        """The part of the front that its cartons take."""
        heights = self._heights()
        return 1.0 - self.missing / self.columns * heights[0]

    def boxes(self, shape: tuple[int, int], density: float) -> Rows:
        """The cartons on a front of that many rows and columns of texels."""
        rng = np.random.default_rng([self.looks, 0x63617274])
        palette = _CARDBOARD if rng.random() < 0.85 else _PLAIN[:1]
        tone = np.array(palette[int(rng.integers(len(palette)))]) * rng.uniform(0.85, 1.05)
        gap = round(float(rng.uniform(0.001, _MOST_GAP_M)) * density)
        kind, at = int(rng.integers(4)), float(rng.uniform(0.42, 0.58))
        words = str(rng.choice(_WORDS)) if rng.random() < 0.7 else ""
        words_part = float(rng.uniform(0.05, 0.12))
        edges = np.round(np.cumsum([0.0, *self._heights()]) * shape[0]).astype(int).tolist()
        rows: list[tuple[Box, ...]] = []
        for (top, below), count in zip(itertools.pairwise(edges), self.columns_of_rows, strict=True):
            whole = count + self.missing if not rows else count
            cuts = np.round(np.linspace(0, shape[1], whole + 1)).astype(int).tolist()[: count + 1]
            row = []
            for left, right in itertools.pairwise(cuts):
                inset = rng.integers(0, gap + 2, 3)
                first, last = left + 1 + int(inset[1]), right - 1 - int(inset[2])
                upper, lower = top + int(inset[0]), below - 1
                slit = round((lower - upper) * (at + float(rng.normal(0.0, 0.004)))) if kind == 0 else None
                own = tone * float(rng.uniform(0.95, 1.05))
                left_of_words = round((last - first) * words_part)
                row.append(Box(first, last, upper, lower, own, slit, kind == 1, words, left_of_words))
            rows.append(tuple(row))
        return tuple(rows)

    def _heights(self) -> list[float]:
        """Of each row as a part of the front's, the highest first."""
        heights = [1.0] * self.rows
        heights[self.looks % self.rows] -= self.low
        return [height / sum(heights) for height in heights]


def carton_stack(size_m: tuple[float, float], rng: np.random.Generator) -> CartonStack:
    """A stack for a front of that width and height: three quarters of them regular."""
    columns, rows = (
        max(round(whole_m / float(rng.uniform(*sizes))), 1)
        for whole_m, sizes in zip(size_m, _CARTON_M, strict=True)
    )
    looks, film = int(rng.integers(2**31)), bool(rng.random() < 0.35)
    draw = float(rng.random())
    if draw < 0.10 and columns > 1:
        return CartonStack(columns, rows, looks, film, missing=int(rng.integers(1, columns)))
    if draw < 0.18 and rows > 1:
        return CartonStack(columns, rows, looks, film, bonded=True)
    if draw < 0.25 and rows > 1:
        return CartonStack(columns, rows, looks, film, low=float(rng.uniform(0.15, 0.4)))
    return CartonStack(columns, rows, looks, film)


def mixed_boxes(shape: tuple[int, int], density: float, rng: np.random.Generator) -> Rows:
    """Boxes in rows, in each its own number of them; each with its own hue, tape and print."""
    height, width = shape
    count = int(rng.choice((1, 2, 2, 3)))
    palette = _CARDBOARD if rng.random() < 0.85 else _PLAIN
    half = _half_tape(density)
    rows, top = [], 0
    for number in range(count):
        below = height if number == count - 1 else round(height * (number + 1) / count)
        columns = int(rng.choice((1, 2, 2, 3)))
        cuts = np.round(np.linspace(0, width, columns + 1)).astype(int)
        row = []
        for left, right in itertools.pairwise(cuts.tolist()):
            inset = rng.integers(0, 5, 3)
            first, last = left + 1 + int(inset[1]), right - 1 - int(inset[2])
            upper, lower = top + int(inset[0]), below - 1
            tone = np.array(palette[int(rng.integers(len(palette)))]) * rng.uniform(0.9, 1.08)
            wide, high = last - first, lower - upper
            words, words_left = "", 0
            if min(high, wide) >= 160 and rng.random() >= 0.3:
                words_left = round(wide * rng.uniform(0.05, 0.12))
                words = str(rng.choice(_WORDS))
            slit = None
            if rng.random() < 0.7 and high > 6 * half:
                slit = round(high * rng.uniform(0.42, 0.58))
            strip = slit is None and wide > 6 * half
            row.append(Box(first, last, upper, lower, tone, slit, strip, words, words_left))
        rows.append(tuple(row))
        top = below
    return tuple(rows)


def paint(load: Image, rows: Sequence[Sequence[Box]], density: float) -> None:
    """Paint boxes onto a front, in place."""
    load[:] = _SHADE
    for box in itertools.chain.from_iterable(rows):
        area = load[box.top : box.below, box.left : box.right]
        area[:] = box.tone.astype(np.uint8)
        if box.words:
            _print(area, box)
        _tape(area, box, density)
        _edges(area)


def relight(area: Image, gain: float, lift: float = 0.0) -> None:
    """Multiply and raise the brightness of a part of a picture, in place."""
    area[:] = np.minimum(area * np.float32(gain) + np.float32(lift), 255.0)


def _half_tape(density: float) -> int:
    return round(0.024 * density)


def _tape(area: Image, box: Box, density: float) -> None:
    width, half = area.shape[1], _half_tape(density)
    if box.slit is not None:
        relight(area[box.slit - half : box.slit + half], 0.84, 22.0)
        relight(area[box.slit : box.slit + 1], 0.6)  # the slit between the flaps
    elif box.strip:
        relight(area[: round(0.07 * density), width // 2 - half : width // 2 + half], 1.0, 18.0)


def _print(area: Image, box: Box) -> None:
    """This-way-up arrows and a line of text, in faded ink."""
    height, width = area.shape[:2]
    ink = [float(level) for level in box.tone * 0.57]
    left, low = box.words_left, round(height * 0.92)
    size = round(min(height, width) * 0.11)
    for number in range(2):
        x = left + round(number * 1.3 * size)
        cv2.arrowedLine(area, (x + size // 2, low), (x + size // 2, low - size), ink, 5, tipLength=0.45)
    cv2.putText(
        area, box.words, (left + 3 * size, low), cv2.FONT_HERSHEY_DUPLEX, size / 34, ink, 2, cv2.LINE_AA
    )


def _edges(area: Image) -> None:
    """Light falls from above: the upper edge is bright, the lower and the sides are darker."""
    relight(area[:3], 1.12)
    relight(area[-6:], 0.7)
    relight(area[:, :3], 0.8)
    relight(area[:, -3:], 0.8)
