"""Fronts of what stands in the places: boxes on pallets, wrapped loads, crates; with their labels."""

from __future__ import annotations

import itertools
from typing import TypeAlias, cast

import cv2
import numpy as np
from numpy.typing import NDArray

from flightd.core.types import Image
from flightd.sim.racks.paper import stick
from flightd.sim.racks.stock import Goods, Place

Floats: TypeAlias = NDArray[np.float32]

TEXELS_PER_M = 1250.0
_PALLET_M = 0.10
_GRAIN_PX = 1536
_CARDBOARD = ((78.0, 122.0, 164.0), (92.0, 138.0, 178.0), (110.0, 150.0, 186.0), (70.0, 108.0, 146.0))
_PLAIN = ((205.0, 208.0, 210.0), (60.0, 60.0, 62.0))
_CRATES = ((150.0, 80.0, 30.0), (40.0, 40.0, 150.0), (70.0, 110.0, 40.0), (120.0, 120.0, 118.0))
_WOOD = (96.0, 140.0, 172.0)


class GoodsPainter:
    """Paints fronts; the grain of their material is drawn once for all of them."""

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng([seed, 0x67726169])
        fine = rng.standard_normal((_GRAIN_PX, _GRAIN_PX), dtype=np.float32)
        grain = 0.45 * fine
        for cell_px, weight in ((6, 0.5), (40, 0.9), (220, 1.2)):
            coarse = rng.standard_normal((_GRAIN_PX // cell_px + 2,) * 2, dtype=np.float32)
            grain += weight * cv2.resize(coarse, (_GRAIN_PX, _GRAIN_PX), interpolation=cv2.INTER_CUBIC)
        self._grain: Floats = np.ascontiguousarray(grain, np.float32)

    def front(self, place: Place) -> Image:
        """(H, W, 3) BGR front of a place that is not empty, the top row highest, `TEXELS_PER_M` to the
        metre, as seen from the aisle."""
        goods = place.goods
        assert goods is not None
        rng = np.random.default_rng([goods.looks, 0x676F6F64])
        height, width = round(goods.height_m * TEXELS_PER_M), round(goods.width_m * TEXELS_PER_M)
        pallet = round(_PALLET_M * TEXELS_PER_M) if goods.height_m > 0.35 else 0
        picture = np.empty((height, width, 3), np.float32)
        load = picture[: height - pallet]
        paint = (_boxes, _boxes, _wrapped, _crates)[int(rng.integers(4))]
        paint(load, rng, self._crop(load.shape, rng))
        if pallet:
            _pallet(picture[height - pallet :], rng, self._crop((pallet, width), rng))
        _shade(picture)
        front = np.clip(np.round(picture), 0.0, 255.0).astype(np.uint8)
        for label in place.labels:
            x_px = (label.right_m - goods.right_m + goods.width_m / 2) * TEXELS_PER_M - 0.5
            y_px = height - (label.height_m - place.opening.level.deck_m) * TEXELS_PER_M - 0.5
            stick(front, label, x_px, y_px, TEXELS_PER_M, goods.looks)
        return front

    def tone(self, goods: Goods) -> tuple[float, float, float]:
        """About what a front looks like from afar."""
        return _CARDBOARD[goods.looks % len(_CARDBOARD)]

    def sheet(self, goods: Goods, height_m: float, width_m: float) -> Image:
        """(H, W, 3) BGR tarpaulin that hangs before covered goods."""
        rng = np.random.default_rng([goods.looks, 0x74617270])
        shape = round(height_m * TEXELS_PER_M / 2), round(width_m * TEXELS_PER_M / 2)
        colour = np.array(_CRATES[int(rng.integers(len(_CRATES)))], np.float32) * np.float32(0.7)
        x = np.arange(shape[1], dtype=np.float32)
        folds = np.zeros(shape[1], np.float32)
        for _ in range(7):
            folds += np.float32(rng.uniform(4, 14)) * np.sin(
                x * np.float32(rng.uniform(0.01, 0.09)) + np.float32(rng.uniform(0, 6))
            )
        level = 1.0 + folds[None, :] / 110.0 + 0.03 * self._crop(shape, rng)
        return cast("Image", np.clip(colour * level[..., None] + 22.0, 0, 255).astype(np.uint8))

    def _crop(self, shape: tuple[int, ...], rng: np.random.Generator) -> Floats:
        """(H, W) grain, about unit variance."""
        rows = (np.arange(shape[0]) + int(rng.integers(_GRAIN_PX))) % _GRAIN_PX
        columns = (np.arange(shape[1]) + int(rng.integers(_GRAIN_PX))) % _GRAIN_PX
        return self._grain[rows][:, columns]


def _boxes(load: Floats, rng: np.random.Generator, grain: Floats) -> None:
    """Cardboard boxes in rows; each with its own hue, tape and print."""
    height, width = load.shape[:2]
    rows = int(rng.choice((1, 2, 2, 3)))
    palette = _CARDBOARD if rng.random() < 0.85 else _PLAIN
    load[:] = 18.0
    top = 0
    for row in range(rows):
        below = height if row == rows - 1 else round(height * (row + 1) / rows)
        columns = int(rng.choice((1, 2, 2, 3)))
        cuts = np.round(np.linspace(0, width, columns + 1)).astype(int)
        for left, right in itertools.pairwise(cuts):
            inset = rng.integers(0, 5, 4)
            box = load[top + inset[0] : below - 1, left + 1 + inset[1] : right - 1 - inset[2]]
            tone = np.array(palette[int(rng.integers(len(palette)))], np.float32) * np.float32(
                rng.uniform(0.9, 1.08)
            )
            box[:] = tone
            _tape(box, rng)
            _print(box, rng)
            box *= (
                1.0
                + 0.035
                * grain[top + inset[0] : below - 1, left + 1 + inset[1] : right - 1 - inset[2]][..., None]
            )
            _edges(box)
        top = below


def _tape(box: Floats, rng: np.random.Generator) -> None:
    height, width = box.shape[:2]
    half = round(0.024 * TEXELS_PER_M)
    if rng.random() < 0.7 and height > 6 * half:
        middle = round(height * rng.uniform(0.42, 0.58))
        box[middle - half : middle + half] *= np.float32(0.84)
        box[middle - half : middle + half] += 22.0
        box[middle] *= 0.6  # the slit between the flaps
    elif width > 6 * half:
        box[: round(0.07 * TEXELS_PER_M), width // 2 - half : width // 2 + half] += 18.0


def _print(box: Floats, rng: np.random.Generator) -> None:
    """This-way-up arrows and a line of text, in faded ink."""
    height, width = box.shape[:2]
    if min(height, width) < 160 or rng.random() < 0.3:
        return
    ink = np.zeros((height, width), np.uint8)
    left, low = round(width * rng.uniform(0.05, 0.12)), round(height * 0.92)
    size = round(min(height, width) * 0.11)
    for number in range(2):
        x = left + round(number * 1.3 * size)
        cv2.arrowedLine(ink, (x + size // 2, low), (x + size // 2, low - size), 110, 5, tipLength=0.45)
    name = str(rng.choice(("FRAGILE", "KEEP DRY", "HANDLE WITH CARE", "MADE IN EU", "PARTS")))
    cv2.putText(ink, name, (left + 3 * size, low), cv2.FONT_HERSHEY_DUPLEX, size / 34, 110, 2, cv2.LINE_AA)
    box *= 1.0 - ink.astype(np.float32)[..., None] / 255.0


def _wrapped(load: Floats, rng: np.random.Generator, grain: Floats) -> None:
    """A load in stretch film: boxes shimmer through, streaks of light run across."""
    _boxes(load, rng, grain)
    height, width = load.shape[:2]
    film = np.zeros((height // 2 + 1, width // 2 + 1), np.float32)
    for _ in range(14):
        at, lean = rng.uniform(0, film.shape[0]), rng.uniform(-0.35, 0.35)
        streak = np.zeros(film.shape, np.uint8)
        ends = (0, round(at)), (film.shape[1], round(at + lean * film.shape[1]))
        cv2.line(streak, *ends, int(rng.integers(8, 34)), int(rng.integers(2, 8)))
        film += streak
    film = cv2.resize(cv2.blur(film, (3, 5)), (width, height)) + 38.0
    load *= 0.72
    load += film[..., None]


def _crates(load: Floats, rng: np.random.Generator, grain: Floats) -> None:
    """Stacked plastic crates of one colour, with ribs and handles."""
    height, width = load.shape[:2]
    colour = np.array(_CRATES[int(rng.integers(len(_CRATES)))], np.float32)
    rows = int(rng.choice((2, 3)))
    load[:] = colour * (1.0 + 0.015 * grain[..., None])
    for row in range(rows):
        top, below = round(height * row / rows), round(height * (row + 1) / rows)
        load[top : top + 9] *= 1.25
        load[below - 5 : below] *= 0.35
        for rib in np.linspace(0, width - 1, 7).astype(int):
            load[top + 12 : below - 6, max(rib - 4, 0) : rib + 4] *= 1.14
        grip = slice(top + round(0.2 * (below - top)), top + round(0.38 * (below - top)))
        load[grip, round(width * 0.38) : round(width * 0.62)] *= 0.3


def _pallet(area: Floats, rng: np.random.Generator, grain: Floats) -> None:
    """A pallet from its end: deck board, three blocks, bottom board; dark between them."""
    height, width = area.shape[:2]
    wood = np.array(_WOOD, np.float32) * np.float32(rng.uniform(0.75, 1.05))
    area[:] = 14.0
    board = round(0.022 * TEXELS_PER_M)
    block = round(0.1 * TEXELS_PER_M)
    textured = wood * (1.0 + 0.07 * grain[..., None])
    area[:board] = textured[:board]
    area[height - board :] = textured[height - board :] * 0.8
    for left in (0, (width - block) // 2, width - block):
        area[board : height - board, left : left + block] = (
            textured[board : height - board, left : left + block] * 0.88
        )


def _edges(box: Floats) -> None:
    """Light falls from above: the upper edge is bright, the lower and the sides are darker."""
    box[:3] *= 1.12
    box[-6:] *= 0.7
    box[:, :3] *= 0.8
    box[:, -3:] *= 0.8


def _shade(picture: Floats) -> None:
    """The beam above keeps the light off the upper part of the load."""
    height = picture.shape[0]
    depth = 0.22 * np.exp(-np.arange(height, dtype=np.float32) / np.float32(0.1 * TEXELS_PER_M))
    picture *= (1.0 - depth)[:, None, None]
