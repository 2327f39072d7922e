"""Racks before which boxes with labels hang, turned in any way: what a benchmark of passes looks at."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from flightd.core.geometry import Matrix
from flightd.sim.racks.code_symbols import Symbol
from flightd.sim.racks.goods import GoodsPainter
from flightd.sim.racks.panels import Pane, Texture
from flightd.sim.racks.rack_layout import Face, Opening
from flightd.sim.racks.scene import Racks, Sightline
from flightd.sim.racks.stacks import Goods
from flightd.sim.racks.stock import Condition, Label, StockPlace, StockSituation

_ROUND_M = 0.04
"""What is seen of a box around its label, at least."""
_LEAST_M = 0.22
_BEFORE_M = 0.01
"""The middle of a box's front, before the rack's face."""
_TONE = (92.0, 138.0, 178.0)


@dataclass(frozen=True, slots=True)
class Tilt:
    """How a label is tilted: turned clockwise in its own plane, and this plane leant by `lean_rad` about an
    axis in the rack's face, `axis_rad` from level."""

    turn_rad: float = 0.0
    lean_rad: float = 0.0
    axis_rad: float = 0.0

    @property
    def most_rad(self) -> float:
        return max(abs(self.turn_rad), abs(self.lean_rad))

    def axes(self, right: float, inward: float) -> tuple[Matrix, Matrix]:
        """The directions to the right and up in the leant plane, (3,) map axes with heights up; `right` and
        `inward` as in `Face`."""
        c, s = math.cos(self.axis_rad), math.sin(self.axis_rad)
        flat, out = np.array(((right, 0.0, 0.0), (0.0, 0.0, 1.0))), np.array((0.0, -inward, 0.0))
        axis = c * flat[0] + s * flat[1]
        # what is across the axis comes out of the face, what is along it stays
        across = math.cos(self.lean_rad) * (c * flat[1] - s * flat[0]) + math.sin(self.lean_rad) * out
        return c * axis - s * across, s * axis + c * across


@dataclass(frozen=True, slots=True)
class HungBox:
    """A box before a place, its label in the middle of its front: `right_m` of the opening's middle and
    `height_m` above the floor."""

    symbol: Symbol
    glossy: bool
    module_m: float
    right_m: float
    height_m: float
    tilt: Tilt
    looks: int

    def label(self) -> Label:
        condition = Condition.GLOSSY if self.glossy else Condition.CLEAN
        return Label(self.symbol, condition, self.module_m, self.right_m, self.height_m, self.tilt.turn_rad)

    @property
    def size_m(self) -> tuple[float, float]:
        """Width and height of its front."""
        width_m, height_m = self.label().paper_size_m
        c, s = abs(math.cos(self.tilt.turn_rad)), abs(math.sin(self.tilt.turn_rad))
        wide_m, high_m = width_m * c + height_m * s, width_m * s + height_m * c
        return max(wide_m + 2 * _ROUND_M, _LEAST_M), max(high_m + 2 * _ROUND_M, _LEAST_M)


class HungRacks(Racks):
    """Racks whose goods have no labels, with boxes before them."""

    def __init__(
        self,
        faces: tuple[Face, ...],
        places: Mapping[str, StockPlace],
        density: Callable[[str], float | None],
        seed: int,
        boxes: Mapping[str, HungBox],
    ) -> None:
        """`boxes` by the code of their place."""
        super().__init__(faces, {code: replace(p, labels=()) for code, p in places.items()}, density, seed)
        self._boxes = boxes
        self._fronts = GoodsPainter(seed)
        self._textures: dict[str, Texture] = {}

    def draw_fronts(self, pane: Pane, sights: tuple[Sightline, ...]) -> None:
        super().draw_fronts(pane, sights)
        for sight in sights:
            for opening in sight.openings():
                box = self._boxes.get(opening.location.code)
                if box is not None:
                    self._draw_box(pane, sight.face, opening, box)

    def _draw_box(self, pane: Pane, face: Face, opening: Opening, box: HungBox) -> None:
        middle = np.array(
            (opening.x_m + face.right * box.right_m, face.y_m - face.inward * _BEFORE_M, box.height_m)
        )
        right, up = box.tilt.axes(face.right, face.inward)
        half_x, half_y = box.size_m[0] / 2, box.size_m[1] / 2
        corners = [
            middle + x * half_x * right + y * half_y * up for x, y in ((-1, 1), (1, 1), (1, -1), (-1, -1))
        ]
        pane.sheet(np.array(corners), box.size_m, lambda: self._texture(opening, box), _TONE)

    def _texture(self, opening: Opening, box: HungBox) -> Texture:
        code = opening.location.code
        if code not in self._textures:
            width_m, height_m = box.size_m
            goods = Goods(width_m, height_m, box.right_m, 0.0, covered=False, looks=box.looks)
            label = replace(box.label(), height_m=opening.level.deck_m + height_m / 2)
            place = StockPlace(opening, StockSituation.CLEAN, goods, (label,))
            self._textures[code] = Texture.of(self._fronts.front(place, goods))
        return self._textures[code]
