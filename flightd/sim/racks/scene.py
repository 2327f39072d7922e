"""Which parts of the racks a camera sees, and drawing them from behind to before."""

from __future__ import annotations

import itertools
from collections import OrderedDict
from collections.abc import Callable, Hashable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from flightd.core.camera_view import CameraView, Viewpoint
from flightd.core.geometry import Matrix
from flightd.core.types import Image
from flightd.sim.racks.goods import GoodsPainter
from flightd.sim.racks.panels import Pane, Panel, Texture
from flightd.sim.racks.rack_layout import BEAM_M, UPRIGHT_M, Face, Opening, RackLevel
from flightd.sim.racks.stacks import Goods
from flightd.sim.racks.steel import BLUE, ORANGE, back, beam, upright
from flightd.sim.racks.stock import StockPlace
from flightd.site.rack_depth import RACK_DEPTH_M

_REACH_M = 7.0
"""Along the aisle, what is farther is not drawn."""
_SAME_PLANE_M = 0.05
_KEPT, _KEPT_BYTES = 96, 500_000_000
"""Pictures of goods and beams that are kept, more than one view holds; usually about 200 MB."""
_BACKS = 8
_LEAST_SLOPE = 0.15
"""Across the aisle per unit of ray: below this a picture looks along the face."""
_SET_BACK_M = 0.05
"""Fronts that stand deeper than this may be hidden by those beside them."""
_SHEET_BEFORE_M = 0.03
_SHEET_LOW_M = 0.06
"""A sheet ends this far above the deck: the label of the location stays to be seen."""
_BACK_TONE = (24.0, 28.0, 31.0)
_DECK_TONE, _DECK_FAR_TONE, _ROOF_TONE = (70.0, 84.0, 92.0), (24.0, 28.0, 31.0), (14.0, 16.0, 18.0)
_TOP_TONES = ((58.0, 90.0, 120.0), (64.0, 96.0, 122.0), (50.0, 76.0, 100.0))
_SIDE_TONES = ((40.0, 62.0, 84.0), (46.0, 68.0, 88.0), (36.0, 54.0, 72.0))


@dataclass(frozen=True, slots=True)
class Sightline:
    """A face before a camera at `at`, of which what lies between two x may be in the picture."""

    face: Face
    at: Viewpoint
    x0_m: float
    x1_m: float

    def bays(self) -> Iterator[tuple[float, float]]:
        """Left and right end of each bay in view."""
        for x0_m, x1_m in itertools.pairwise(self.face.uprights_m):
            if x0_m < self.x1_m and self.x0_m < x1_m:
                yield x0_m, x1_m

    def openings(self) -> Iterator[Opening]:
        for opening in self.face.openings:
            half_m = opening.width_m / 2
            if opening.x_m - half_m < self.x1_m and self.x0_m < opening.x_m + half_m:
                yield opening

    def depth_m(self, part: float) -> tuple[float, float]:
        """The y of the face, and of that part of the way to its back."""
        return self.face.y_m, self.face.y_m + self.face.inward * RACK_DEPTH_M * part


class Racks:
    """All racks of one site with their goods.

    `density` gives the pixels to the metre for which the small label of a location is made, None for
    racks without such labels."""

    def __init__(
        self,
        faces: tuple[Face, ...],
        places: Mapping[str, StockPlace],
        density: Callable[[str], float | None],
        seed: int,
    ) -> None:
        self._faces = faces
        self._places = places
        self._density = density
        self._seed = seed
        self._painter = GoodsPainter(seed)
        self._kept: OrderedDict[Hashable, Texture] = OrderedDict()
        self._kept_bytes = 0
        self._backs = [Texture.of(back(2.0, 1.0, seed + number)) for number in range(_BACKS)]
        self._uprights = {
            height_m: Texture.of(upright(height_m, seed)) for height_m in {f.shelf.height_m for f in faces}
        }

    def sights(self, view: CameraView) -> tuple[Sightline, ...]:
        """The faces that look at the camera from both sides of its aisle, and what of them is in view."""
        found: list[Sightline] = []
        at = view.viewpoint
        for inward in (-1.0, 1.0):
            ahead = [
                face for face in self._faces if face.inward == inward and (face.y_m - at.y_m) * inward > 0.0
            ]
            nearest = min(((face.y_m - at.y_m) * inward for face in ahead), default=0.0)
            for face in ahead:
                if (face.y_m - at.y_m) * inward < nearest + _SAME_PLANE_M:
                    x0_m, x1_m = _reach(face, view)
                    if x0_m < face.x1_m and face.x0_m < x1_m:
                        found.append(Sightline(face, at, x0_m, x1_m))
        return tuple(found)

    def draw_depths(self, pane: Pane, sights: tuple[Sightline, ...]) -> None:
        """What lies in the shade between face and back: decks, backs, the goods' sides.  `pane` may be
        coarse: all this is dim and out of focus."""
        for sight in sights:
            places = [self._places[opening.location.code] for opening in sight.openings()]
            below_m = max(sight.face.levels[0].deck_m - BEAM_M, 0.01)
            levels = (RackLevel(0.0, below_m), *sight.face.levels)
            # what is nearer to the camera's height hides what is farther from it
            above = [level for level in levels if level.deck_m > sight.at.height_m]
            for level in (*levels[: len(levels) - len(above)], *reversed(above)):
                for x0_m, x1_m in sight.bays():
                    self._draw_hollow(pane, sight, x0_m, x1_m, level)
                for place in places:
                    if place.goods is not None and place.opening.level == level:
                        _draw_sides(pane, sight, place, place.goods)
                for place in places:
                    if place.goods is not None and place.opening.level == level:
                        _draw_tops(pane, sight, place, place.goods)
                if level in above:
                    for x0_m, x1_m in sight.bays():
                        pane.polygon(
                            _flat(x0_m, x1_m, *sight.depth_m(1.0), level.deck_m - level.beam_m), _ROOF_TONE
                        )

    def draw_fronts(self, pane: Pane, sights: tuple[Sightline, ...]) -> None:
        """Goods, then the steel before them, then the sheets that hang before all."""
        for sight in sights:
            stocked = [
                (place, place.goods)
                for opening in sight.openings()
                if (place := self._places[opening.location.code]).goods is not None
            ]
            fronts = [
                (place, stack, number)
                for place, goods in stocked
                if goods is not None
                for number, stack in enumerate(goods.stacks)
            ]
            fronts.sort(key=lambda front: min(_SET_BACK_M - front[1].recess_m, 0.0))
            for place, stack, number in fronts:
                if stack.recess_m >= 0.0:
                    self._draw_front(pane, sight, place, stack, number)
            self._draw_steel(pane, sight)
            for place, stack, number in fronts:
                if stack.recess_m < 0.0:
                    _draw_side(pane, sight, place, replace(stack, depth_m=-stack.recess_m))
                    self._draw_front(pane, sight, place, stack, number)
            for place, goods in stocked:
                if goods is not None and goods.covered:
                    self._draw_sheet(pane, sight.face, place, goods)

    def _draw_front(self, pane: Pane, sight: Sightline, place: StockPlace, stack: Goods, number: int) -> None:
        make = partial(self._painter.front, place, stack)
        panel = _goods_panel(sight.face, place, stack)
        key: Hashable = (place.code, number) if number else place.code
        pane.panel(panel, partial(self._picture, key, make), self._painter.tone(stack))

    def _draw_hollow(self, pane: Pane, sight: Sightline, x0_m: float, x1_m: float, level: RackLevel) -> None:
        face = sight.face
        deep_m = sight.depth_m(1.0)[1]
        choice = (round(x0_m * 10) * 31 + round(level.deck_m * 10) * 7 + self._seed) % _BACKS
        panel = _panel(face, deep_m, x0_m, x1_m, level.deck_m, level.top_m)
        pane.panel(panel, partial(self._backs.__getitem__, choice), _BACK_TONE)
        if level.deck_m < sight.at.height_m:
            near_m, middle_m = sight.depth_m(0.45)
            pane.polygon(_flat(x0_m, x1_m, near_m, middle_m, level.deck_m), _DECK_TONE)
            pane.polygon(_flat(x0_m, x1_m, middle_m, deep_m, level.deck_m), _DECK_FAR_TONE)

    def _draw_sheet(self, pane: Pane, face: Face, place: StockPlace, goods: Goods) -> None:
        level, x_m, half_m = place.opening.level, place.opening.x_m, place.opening.width_m / 2
        low_m, high_m = level.deck_m + _SHEET_LOW_M, level.top_m + BEAM_M
        y_m = face.y_m - face.inward * _SHEET_BEFORE_M
        panel = _panel(face, y_m, x_m - half_m, x_m + half_m, low_m, high_m)
        make = partial(self._painter.sheet, goods, high_m - low_m, 2 * half_m)
        pane.panel(panel, partial(self._picture, (place.code, "sheet"), make), _SIDE_TONES[0])

    def _draw_steel(self, pane: Pane, sight: Sightline) -> None:
        face = sight.face
        for x0_m, x1_m in sight.bays():
            for number, level in enumerate(face.levels):
                above = [o for o in face.openings if o.level == level and x0_m < o.x_m < x1_m]
                density = self._density(above[0].location.code) if above else None
                make = partial(
                    beam, above, x0_m, x1_m, level.beam_m, face.right, density, self._seed + number
                )
                key = (face.y_m, round(x0_m, 3), number)
                panel = _panel(face, face.y_m, x0_m, x1_m, level.deck_m - level.beam_m, level.deck_m)
                pane.panel(panel, partial(self._picture, key, make), ORANGE)
        height_m, half_m = face.shelf.height_m, UPRIGHT_M / 2
        for x_m in face.uprights_m:
            if sight.x0_m - half_m < x_m < sight.x1_m + half_m:
                panel = _panel(face, face.y_m, x_m - half_m, x_m + half_m, 0.0, height_m)
                pane.panel(panel, partial(self._uprights.__getitem__, height_m), BLUE)

    def _picture(self, key: Hashable, make: Callable[[], Image]) -> Texture:
        """The picture of that name, drawn when it is first wanted; the longest unused is forgotten."""
        texture = self._kept.get(key)
        if texture is None:
            texture = self._kept[key] = Texture.of(make())
            self._kept_bytes += texture.nbytes
            while len(self._kept) > 1 and (len(self._kept) > _KEPT or self._kept_bytes > _KEPT_BYTES):
                self._kept_bytes -= self._kept.popitem(last=False)[1].nbytes
        self._kept.move_to_end(key)
        return texture


def _reach(face: Face, view: CameraView) -> tuple[float, float]:
    """Between which x some pixel of the picture looks at the face or what is behind it."""
    lens, at = view.lens, view.viewpoint
    low_m, high_m = at.x_m - _REACH_M, at.x_m + _REACH_M
    corners = [(u, v, 1.0) for u in (-1.0, lens.width_px) for v in (-1.0, lens.height_px)]
    rays = np.linalg.solve(lens.matrix(), np.array(corners).T)
    x, y, _ = at.map_from_image @ rays
    if (y * face.inward).min() < _LEAST_SLOPE:
        return low_m, high_m
    found = [at.x_m + x / y * (y_m - at.y_m) for y_m in (face.y_m, face.y_m + face.inward * RACK_DEPTH_M)]
    return max(float(np.min(found)), low_m), min(float(np.max(found)), high_m)


def _panel(face: Face, y_m: float, x0_m: float, x1_m: float, low_m: float, high_m: float) -> Panel:
    left_m, right_m = (x0_m, x1_m) if face.right > 0 else (x1_m, x0_m)
    return Panel(y_m, left_m, right_m, low_m, high_m)


def _goods_panel(face: Face, place: StockPlace, goods: Goods) -> Panel:
    x_m = place.opening.x_m + face.right * goods.right_m
    half_m, deck_m = goods.width_m / 2, place.opening.level.deck_m
    y_m = face.y_m + face.inward * goods.recess_m
    panel = _panel(face, y_m, x_m - half_m, x_m + half_m, deck_m, deck_m + goods.height_m)
    return replace(panel, lean_m=face.right * goods.lean_m) if goods.lean_m else panel


def _flat(x0_m: float, x1_m: float, y0_m: float, y1_m: float, height_m: float) -> Matrix:
    """The corners of a horizontal rectangle."""
    return np.array(
        [(x0_m, y0_m, height_m), (x1_m, y0_m, height_m), (x1_m, y1_m, height_m), (x0_m, y1_m, height_m)]
    )


def _draw_sides(pane: Pane, sight: Sightline, place: StockPlace, goods: Goods) -> None:
    """The sides of the goods that are turned to the camera, the nearest last."""
    at_m, right = sight.at.x_m - place.opening.x_m, sight.face.right
    for stack in sorted(goods.stacks, key=lambda stack: -abs(right * stack.right_m - at_m)):
        _draw_side(pane, sight, place, stack)


def _draw_tops(pane: Pane, sight: Sightline, place: StockPlace, goods: Goods) -> None:
    """The tops of stacks that are seen from above."""
    for stack in goods.stacks:
        panel = _goods_panel(sight.face, place, stack)
        if stack.depth_m is not None and sight.at.height_m > panel.high_m:
            deep_m = panel.y_m + sight.face.inward * stack.depth_m
            left_m, right_m = panel.left_m + panel.lean_m, panel.right_m + panel.lean_m
            corners = _flat(left_m, right_m, panel.y_m, deep_m, panel.high_m)
            pane.polygon(corners, _TOP_TONES[stack.looks % len(_TOP_TONES)])


def _draw_side(pane: Pane, sight: Sightline, place: StockPlace, goods: Goods) -> None:
    """The side of one stack that is turned to the camera."""
    panel = _goods_panel(sight.face, place, goods)
    x0_m, x1_m = sorted((panel.left_m, panel.right_m))
    if x0_m <= sight.at.x_m <= x1_m:
        return
    x_m = x0_m if sight.at.x_m < x0_m else x1_m
    whole_m, depth_m = sight.depth_m(0.9)[1], goods.depth_m
    deep_m = whole_m if depth_m is None else panel.y_m + sight.face.inward * depth_m
    corners = [
        (x_m + panel.lean_m, panel.y_m, panel.high_m),
        (x_m + panel.lean_m, deep_m, panel.high_m),
        (x_m, deep_m, panel.low_m),
        (x_m, panel.y_m, panel.low_m),
    ]
    pane.polygon(np.array(corners), _SIDE_TONES[goods.looks % len(_SIDE_TONES)])
