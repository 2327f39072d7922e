"""Fronts of what stands in the places: boxes on pallets, wrapped loads, crates; with their labels."""

from __future__ import annotations

import itertools

import cv2
import numpy as np
from numpy.typing import NDArray

from flightd.core.types import Image
from flightd.sim.racks.label_paper import stick
from flightd.sim.racks.panels import texels_per_m, texture_shape
from flightd.sim.racks.stacks import Goods
from flightd.sim.racks.stock import StockPlace

_PALLET_M = 0.10
_GRAIN_PX = 1024
_UNIT = 128
"""A gain of one in the grain."""
_CARDBOARD = ((78.0, 122.0, 164.0), (92.0, 138.0, 178.0), (110.0, 150.0, 186.0), (70.0, 108.0, 146.0))
_PLAIN = ((205.0, 208.0, 210.0), (60.0, 60.0, 62.0))
_CRATES = ((150.0, 80.0, 30.0), (40.0, 40.0, 150.0), (70.0, 110.0, 40.0), (120.0, 120.0, 118.0))
_DARK_TONE = (20.0, 20.0, 21.0)
_WOOD = (96.0, 140.0, 172.0)


class GoodsPainter:
    """Paints fronts; the grain of their material is drawn once for all of them."""

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng([seed, 0x67726169])
        grain = 0.45 * rng.standard_normal((_GRAIN_PX, _GRAIN_PX), dtype=np.float32)
        for cell_px, weight in ((6, 0.5), (40, 0.9), (220, 1.2)):
            coarse = rng.standard_normal((_GRAIN_PX // cell_px + 2,) * 2, dtype=np.float32)
            grain += weight * cv2.resize(coarse, (_GRAIN_PX, _GRAIN_PX), interpolation=cv2.INTER_CUBIC)
        gain = np.clip(np.round((1.0 + 0.04 * grain) * _UNIT), 0, 255).astype(np.uint8)
        # twice as large, so that a crop of one period is one piece wherever it begins
        self._grain: Image = np.repeat(np.tile(gain, (2, 2))[..., None], 3, axis=2)

    def front(self, place: StockPlace, goods: Goods) -> Image:
        """(H, W, 3) BGR front of one of a place's stacks, the top row highest, as seen from the aisle; labels
        hang on the first."""
        rng = np.random.default_rng([goods.looks, 0x676F6F64])
        density = texels_per_m(goods.width_m, goods.height_m)
        height, width = texture_shape(goods.width_m, goods.height_m, density)
        stands_bare = goods.height_m <= 0.35 or (goods.dark and rng.random() < 0.5)
        pallet = 0 if stands_bare else round(_PALLET_M * density)
        front = np.empty((height, width, 3), np.uint8)
        load = _dark if goods.dark else (_boxes, _boxes, _wrapped, _crates)[int(rng.integers(4))]
        load(front[: height - pallet], density, rng)
        if pallet:
            _pallet(front[height - pallet :], density, rng)
        self._grained(front, rng)
        _shade(front, density)
        for label in place.labels if goods is place.goods else ():
            x_px = (label.right_m - goods.right_m + goods.width_m / 2) * density - 0.5
            y_px = height - (label.height_m - place.opening.level.deck_m) * density - 0.5
            stick(front, label, x_px, y_px, density, goods.looks)
        return front

    def tone(self, goods: Goods) -> tuple[float, float, float]:
        """About what a front looks like from afar."""
        return _DARK_TONE if goods.dark else _CARDBOARD[goods.looks % len(_CARDBOARD)]

    def sheet(self, goods: Goods, height_m: float, width_m: float) -> Image:
        """(H, W, 3) BGR tarpaulin that hangs before covered goods, half as many texels to the metre."""
        rng = np.random.default_rng([goods.looks, 0x74617270])
        shape = texture_shape(width_m, height_m, texels_per_m(width_m, height_m) / 2)
        colour = np.array(_CRATES[int(rng.integers(len(_CRATES)))]) * 0.7
        x = np.arange(shape[1])
        folds = np.zeros(shape[1])
        for _ in range(7):
            folds += rng.uniform(4, 14) * np.sin(x * rng.uniform(0.01, 0.09) + rng.uniform(0, 6))
        row = np.clip(colour * (1.0 + folds / 110.0)[:, None] + 22.0, 0, 255).astype(np.uint8)
        sheet = np.repeat(row[None], shape[0], axis=0)
        self._grained(sheet, rng)
        return sheet

    def _grained(self, picture: Image, rng: np.random.Generator) -> None:
        """Give a picture the grain of its material, in place."""
        top, left = (int(offset) for offset in rng.integers(_GRAIN_PX, size=2))
        starts = (range(0, size, _GRAIN_PX) for size in picture.shape[:2])
        for y, x in itertools.product(*starts):  # the grain repeats over what is larger than its period
            part = picture[y : y + _GRAIN_PX, x : x + _GRAIN_PX]
            grain = self._grain[top : top + part.shape[0], left : left + part.shape[1]]
            cv2.multiply(part, grain, dst=part, scale=1 / _UNIT)


def _boxes(load: Image, density: float, rng: np.random.Generator) -> None:
    """Cardboard boxes in rows; each with its own hue, tape and print."""
    height, width = load.shape[:2]
    rows = int(rng.choice((1, 2, 2, 3)))
    palette = _CARDBOARD if rng.random() < 0.85 else _PLAIN
    load[:] = 18
    top = 0
    for row in range(rows):
        below = height if row == rows - 1 else round(height * (row + 1) / rows)
        columns = int(rng.choice((1, 2, 2, 3)))
        cuts = np.round(np.linspace(0, width, columns + 1)).astype(int)
        for left, right in itertools.pairwise(cuts):
            inset = rng.integers(0, 5, 3)
            box = load[top + inset[0] : below - 1, left + 1 + inset[1] : right - 1 - inset[2]]
            tone = np.array(palette[int(rng.integers(len(palette)))]) * rng.uniform(0.9, 1.08)
            box[:] = tone.astype(np.uint8)
            _print(box, tone, rng)
            _tape(box, density, rng)
            _edges(box)
        top = below


def _tape(box: Image, density: float, rng: np.random.Generator) -> None:
    height, width = box.shape[:2]
    half = round(0.024 * density)
    if rng.random() < 0.7 and height > 6 * half:
        middle = round(height * rng.uniform(0.42, 0.58))
        _relight(box[middle - half : middle + half], 0.84, 22.0)
        _relight(box[middle : middle + 1], 0.6)  # the slit between the flaps
    elif width > 6 * half:
        _relight(box[: round(0.07 * density), width // 2 - half : width // 2 + half], 1.0, 18.0)


def _print(box: Image, tone: NDArray[np.float64], rng: np.random.Generator) -> None:
    """This-way-up arrows and a line of text, in faded ink."""
    height, width = box.shape[:2]
    if min(height, width) < 160 or rng.random() < 0.3:
        return
    ink = [float(level) for level in tone * 0.57]
    left, low = round(width * rng.uniform(0.05, 0.12)), round(height * 0.92)
    size = round(min(height, width) * 0.11)
    for number in range(2):
        x = left + round(number * 1.3 * size)
        cv2.arrowedLine(box, (x + size // 2, low), (x + size // 2, low - size), ink, 5, tipLength=0.45)
    name = str(rng.choice(("FRAGILE", "KEEP DRY", "HANDLE WITH CARE", "MADE IN EU", "PARTS")))
    cv2.putText(box, name, (left + 3 * size, low), cv2.FONT_HERSHEY_DUPLEX, size / 34, ink, 2, cv2.LINE_AA)


def _wrapped(load: Image, density: float, rng: np.random.Generator) -> None:
    """A load in stretch film: boxes shimmer through, streaks of light run across."""
    _boxes(load, density, rng)
    height, width = load.shape[:2]
    film = np.full((height // 2 + 1, width // 2 + 1), 38, np.uint8)
    streak = np.empty_like(film)
    for _ in range(14):
        at, lean = rng.uniform(0, film.shape[0]), rng.uniform(-0.35, 0.35)
        streak[:] = 0
        ends = (0, round(at)), (film.shape[1], round(at + lean * film.shape[1]))
        cv2.line(streak, *ends, int(rng.integers(8, 34)), int(rng.integers(2, 8)))
        cv2.add(film, streak, dst=film)
    film = cv2.cvtColor(cv2.resize(cv2.blur(film, (3, 5)), (width, height)), cv2.COLOR_GRAY2BGR)
    cv2.addWeighted(load, 0.72, film, 1.0, 0.0, dst=load)


def _crates(load: Image, _density: float, rng: np.random.Generator) -> None:
    """Stacked plastic crates of one colour, with ribs and handles."""
    height, width = load.shape[:2]
    rows = int(rng.choice((2, 3)))
    load[:] = np.array(_CRATES[int(rng.integers(len(_CRATES)))], np.uint8)
    for row in range(rows):
        top, below = round(height * row / rows), round(height * (row + 1) / rows)
        _relight(load[top : top + 9], 1.25)
        _relight(load[below - 5 : below], 0.35)
        for rib in np.linspace(0, width - 1, 7).astype(int):
            _relight(load[top + 12 : below - 6, max(rib - 4, 0) : rib + 4], 1.14)
        grip = slice(top + round(0.2 * (below - top)), top + round(0.38 * (below - top)))
        _relight(load[grip, round(width * 0.38) : round(width * 0.62)], 0.3)


def _dark(load: Image, density: float, rng: np.random.Generator) -> None:
    """Black film or black boxes: hardly any light comes back, seams and edges show barely or not at all."""
    height = load.shape[0]
    load[:] = np.round(rng.uniform(9.0, 38.0) * rng.uniform(0.92, 1.08, 3)).astype(np.uint8)
    for part in np.linspace(0.0, 1.0, int(rng.choice((1, 2, 3))), endpoint=False)[1:]:
        seam = round(part * height)
        _relight(load[max(seam - 3, 0) : seam + 3], float(rng.uniform(0.4, 1.7)))
    if rng.random() < 0.5:
        _relight(load[:, : round(0.01 * density)], float(rng.uniform(0.6, 1.6)))
    if rng.random() < 0.25:  # a lighter foot, as of a tray that the load stands in
        foot = round(float(rng.uniform(0.01, 0.05)) * density)
        load[max(height - foot, 0) :] = np.round(np.full(3, rng.uniform(60.0, 120.0))).astype(np.uint8)


def _pallet(area: Image, density: float, rng: np.random.Generator) -> None:
    """A pallet from its end: deck board, three blocks, bottom board; dark between them."""
    height, width = area.shape[:2]
    wood = np.array(_WOOD) * rng.uniform(0.75, 1.05)
    board, block = round(0.022 * density), min(round(0.1 * density), width)
    area[:] = 14
    area[:board] = wood.astype(np.uint8)
    area[height - board :] = (wood * 0.8).astype(np.uint8)
    for left in (0, (width - block) // 2, width - block):
        area[board : height - board, left : left + block] = (wood * 0.88).astype(np.uint8)


def _edges(box: Image) -> None:
    """Light falls from above: the upper edge is bright, the lower and the sides are darker."""
    _relight(box[:3], 1.12)
    _relight(box[-6:], 0.7)
    _relight(box[:, :3], 0.8)
    _relight(box[:, -3:], 0.8)


def _shade(picture: Image, density: float) -> None:
    """The beam above keeps the light off the upper part of the load."""
    reach = 0.1 * density
    shaded = picture[: round(4 * reach)]
    light = 1.0 - 0.22 * np.exp(-np.arange(len(shaded), dtype=np.float32) / np.float32(reach))
    shaded[:] = shaded * light[:, None, None]


def _relight(area: Image, gain: float, lift: float = 0.0) -> None:
    """Multiply and raise the brightness of a part of a picture, in place."""
    area[:] = np.minimum(area * np.float32(gain) + np.float32(lift), 255.0)
