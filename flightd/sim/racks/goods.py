"""Fronts of what stands in the places: boxes on pallets, wrapped loads, crates; with their labels."""

from __future__ import annotations

import enum
import itertools
from dataclasses import dataclass

import cv2
import numpy as np

from flightd.core.types import Image
from flightd.sim.racks.cartons import Rows, mixed_boxes, paint, relight
from flightd.sim.racks.label_paper import stick
from flightd.sim.racks.panels import texels_per_m, texture_shape
from flightd.sim.racks.stacks import BARE_M, PALLET_M, Goods
from flightd.sim.racks.stock import StockPlace

_GRAIN_PX = 1024
_UNIT = 128
"""A gain of one in the grain."""
_CARDBOARD = ((78.0, 122.0, 164.0), (92.0, 138.0, 178.0), (110.0, 150.0, 186.0), (70.0, 108.0, 146.0))
_CRATES = ((150.0, 80.0, 30.0), (40.0, 40.0, 150.0), (70.0, 110.0, 40.0), (120.0, 120.0, 118.0))
_DARK_TONE = (20.0, 20.0, 21.0)
_WOOD = (96.0, 140.0, 172.0)


class _Kind(enum.Enum):
    DARK = enum.auto()
    BOXES = enum.auto()
    WRAPPED = enum.auto()
    CRATES = enum.auto()


_KINDS = (_Kind.BOXES, _Kind.BOXES, _Kind.WRAPPED, _Kind.CRATES)


@dataclass(frozen=True, slots=True)
class _Plan:
    """What a front shows, before it is painted: `shape` in texels, of which `pallet` rows are the pallet's;
    `rng` draws what is left to draw."""

    shape: tuple[int, int]
    density: float
    pallet: int
    kind: _Kind
    boxes: Rows
    rng: np.random.Generator

    @classmethod
    def of(cls, goods: Goods) -> _Plan:
        rng = np.random.default_rng([goods.looks, 0x676F6F64])
        density = texels_per_m(goods.width_m, goods.height_m)
        height, width = texture_shape(goods.width_m, goods.height_m, density)
        stands_bare = goods.height_m <= BARE_M or (goods.dark and rng.random() < 0.5)
        pallet = 0 if stands_bare else round(PALLET_M * density)
        room = height - pallet, width
        kind = _Kind.DARK if goods.dark else _KINDS[int(rng.integers(4))]
        boxes: Rows = ()
        if goods.cartons is not None:
            kind = _Kind.WRAPPED if goods.cartons.film else _Kind.BOXES
            boxes = goods.cartons.boxes(room, density)
        elif kind in {_Kind.BOXES, _Kind.WRAPPED}:
            boxes = mixed_boxes(room, density, rng)
        return cls((height, width), density, pallet, kind, boxes, rng)

    def load(self, load: Image) -> None:
        """Paint what stands on the pallet."""
        if self.kind is _Kind.DARK:
            _dark(load, self.density, self.rng)
        elif self.kind is _Kind.CRATES:
            _crates(load, self.rng)
        else:
            paint(load, self.boxes, self.density)
            if self.kind is _Kind.WRAPPED:
                _film(load, self.rng)


def boxes_in_rows(goods: Goods) -> tuple[int, ...]:
    """How many boxes are seen in each row of a front, the highest first; none where there are no boxes."""
    return tuple(len(row) for row in _Plan.of(goods).boxes)


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
        plan = _Plan.of(goods)
        front = np.empty((*plan.shape, 3), np.uint8)
        height, density, rng = plan.shape[0], plan.density, plan.rng
        plan.load(front[: height - plan.pallet])
        if plan.pallet:
            _pallet(front[height - plan.pallet :], density, rng)
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


def _film(load: Image, rng: np.random.Generator) -> None:
    """Stretch film over a load, in place: boxes shimmer through, streaks of light run across."""
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


def _crates(load: Image, rng: np.random.Generator) -> None:
    """Stacked plastic crates of one colour, with ribs and handles."""
    height, width = load.shape[:2]
    rows = int(rng.choice((2, 3)))
    load[:] = np.array(_CRATES[int(rng.integers(len(_CRATES)))], np.uint8)
    for row in range(rows):
        top, below = round(height * row / rows), round(height * (row + 1) / rows)
        relight(load[top : top + 9], 1.25)
        relight(load[below - 5 : below], 0.35)
        for rib in np.linspace(0, width - 1, 7).astype(int):
            relight(load[top + 12 : below - 6, max(rib - 4, 0) : rib + 4], 1.14)
        grip = slice(top + round(0.2 * (below - top)), top + round(0.38 * (below - top)))
        relight(load[grip, round(width * 0.38) : round(width * 0.62)], 0.3)


def _dark(load: Image, density: float, rng: np.random.Generator) -> None:
    """Black film or black boxes: hardly any light comes back, seams and edges show barely or not at all."""
    height = load.shape[0]
    load[:] = np.round(rng.uniform(9.0, 38.0) * rng.uniform(0.92, 1.08, 3)).astype(np.uint8)
    for part in np.linspace(0.0, 1.0, int(rng.choice((1, 2, 3))), endpoint=False)[1:]:
        seam = round(part * height)
        relight(load[max(seam - 3, 0) : seam + 3], float(rng.uniform(0.4, 1.7)))
    if rng.random() < 0.5:
        relight(load[:, : round(0.01 * density)], float(rng.uniform(0.6, 1.6)))
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


def _shade(picture: Image, density: float) -> None:
    """The beam above keeps the light off the upper part of the load."""
    reach = 0.1 * density
    shaded = picture[: round(4 * reach)]
    light = 1.0 - 0.22 * np.exp(-np.arange(len(shaded), dtype=np.float32) / np.float32(reach))
    shaded[:] = shaded * light[:, None, None]
