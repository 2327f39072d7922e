"""What a hall does to its guide lines: paint that is gone, things that lie on it, old lines beside it."""

from __future__ import annotations

import math
import random
from collections.abc import Iterable
from dataclasses import dataclass

from flightd.sim.floor.texture import Box
from flightd.site.rack_depth import rack_body
from flightd.site.site import PaintedLine, Site

_TRIES = 400
"""A floor that is too crowded for what is wished ends the search."""
_EVERYWHERE = (-math.inf, -math.inf, math.inf, math.inf)
_PAD_CLEAR_M = 0.5
_PALLET_CLEAR_M = 0.6
_PALLET_M = (1.2, 0.8)
PALLET_HEIGHT_M = 0.144
"""A flat pallet's of 1.2 by 0.8 m (EN 13698-1)."""
_RAGGED_M = 0.02
"""By how much a gap is wider than its line: a line's edge is not straight."""
_ALONGSIDE_M = 0.15
_LEAST_HIDDEN_M = 0.1
_ASKEW = 0.3
"""Share of the false lines that run neither along x nor along y."""


@dataclass(frozen=True, slots=True)
class Stripe:
    """A straight stripe of paint about its middle, turned from x towards y."""

    x_m: float
    y_m: float
    length_m: float
    width_m: float
    turn_rad: float

    def box(self) -> Box:
        """The upright rectangle around it."""
        c, s = abs(math.cos(self.turn_rad)), abs(math.sin(self.turn_rad))
        half_x_m = (self.length_m * c + self.width_m * s) / 2
        half_y_m = (self.length_m * s + self.width_m * c) / 2
        return _box(self.x_m, self.y_m, half_x_m, half_y_m)


@dataclass(frozen=True, slots=True)
class OldLine:
    """What is left of a line that was painted anew beside its old place."""

    stripe: Stripe
    left: float
    """Share of the paint that still covers the floor."""


@dataclass(frozen=True, slots=True)
class Tape:
    """Tape of another colour than the paint's, for other purposes."""

    stripe: Stripe
    colour: str


@dataclass(frozen=True, slots=True)
class PaintDamage:
    """Floor without paint (`gaps`), what lies on it, and what is on it that no map has: stripes of the
    paint's colour, long old lines beside the true ones, tape of other colours."""

    gaps: tuple[Box, ...] = ()
    pallets: tuple[Box, ...] = ()
    gratings: tuple[Box, ...] = ()
    false_lines: tuple[Stripe, ...] = ()
    old_lines: tuple[OldLine, ...] = ()
    tapes: tuple[Tape, ...] = ()


UNDAMAGED = PaintDamage()


def painted_m(lines: Iterable[PaintedLine], within: Box = _EVERYWHERE) -> float:
    """How many metres of line there are within a box."""
    x0_m, y0_m, x1_m, y1_m = within
    return math.fsum(
        max(min(line.x1_m, x1_m) - max(line.x0_m, x0_m), min(line.y1_m, y1_m) - max(line.y0_m, y0_m))
        for line in lines
        if line.x0_m <= x1_m and line.x1_m >= x0_m and line.y0_m <= y1_m and line.y1_m >= y0_m
    )


def stroke_box(line: PaintedLine, beside_m: float = 0.0) -> Box:
    """The painted rectangle, square at its ends, `beside_m` wider to either side."""
    half_m = line.width_m / 2 + beside_m
    if runs_along_x(line):
        return line.x0_m, line.y0_m - half_m, line.x1_m, line.y0_m + half_m
    return line.x0_m - half_m, line.y0_m, line.x0_m + half_m, line.y1_m


def runs_along_x(line: PaintedLine) -> bool:
    """Whether it runs along x; else along y."""
    return line.y0_m == line.y1_m


def meets(box: Box, others: Iterable[Box]) -> bool:
    """Whether a box overlaps any other."""
    return any(
        box[0] < other[2] and box[2] > other[0] and box[1] < other[3] and box[3] > other[1]
        for other in others
    )


def lies_in(box: Box, bounds: Box) -> bool:
    """Whether a box lies within another, whole."""
    return box[0] >= bounds[0] and box[1] >= bounds[1] and box[2] <= bounds[2] and box[3] <= bounds[3]


def around_pads(site: Site) -> list[Box]:
    """What lies within 0.5 m of the centre of a pad or of its node: nothing is wrong with the lines there."""
    places = [(site.pad_centre(pad), site.nodes[pad.node]) for pad in site.pads]
    centres = [at for centre, node in places for at in (centre, (node.x_m, node.y_m))]
    return [_box(x_m, y_m, _PAD_CLEAR_M, _PAD_CLEAR_M) for x_m, y_m in centres]


def rack_boxes(site: Site) -> list[Box]:
    """The floor on which racks stand."""
    bodies = [rack_body(site, shelf) for shelf in site.shelves]
    return [(body.x0_m, body.y0_m, body.x1_m, body.y1_m) for body in bodies]


def drawn_damage(site: Site, gone: float, covered: float, false: float, seed: int) -> PaintDamage:
    """Damage to these shares of the painted length, as far as there is room for it.

    Of `gone` and `covered` together so much is met as can be: gaps of 0.3 to 1 m (the last as long as is
    left) make up for covers that found no place.  A false line may cross a true one but never lies on or
    right beside one.  Nothing comes nearer than 0.5 m to the centre of a pad or of its node, and no pallet
    nearer than 0.6 m to a pad: take-off needs the lines there, and whoever owns a pad keeps it clear."""
    if not (gone or covered or false):
        return UNDAMAGED
    hall = _Hall(site, random.Random(f"paint damage {seed}"))
    total_m = painted_m(site.lines)
    pallets, gratings = hall.lay_covers(covered * total_m)
    hidden_m = math.fsum(painted_m(site.lines, box) for box in pallets + gratings)
    gaps = hall.wear_gaps((gone + covered) * total_m - hidden_m)
    return PaintDamage(gaps, pallets, gratings, hall.paint_false_lines(false * total_m))


class _Hall:
    """The floor while its damage is drawn: where there is no room left."""

    def __init__(self, site: Site, rng: random.Random) -> None:
        self._rng = rng
        self._lines = site.lines
        self._lengths_m = [painted_m([line]) for line in site.lines]
        self._bounds = site.bounds()
        self._shelves = rack_boxes(site)
        self._taken = around_pads(site)
        self._pads: list[Box] = []
        for pad in site.pads:
            half_m = pad.size_m / 2 + _PALLET_CLEAR_M
            self._pads.append(_box(*site.pad_centre(pad), half_m, half_m))

    def lay_covers(self, wished_m: float) -> tuple[tuple[Box, ...], tuple[Box, ...]]:
        """Pallets and gratings that hide so many metres of line, to about 0.1 m."""
        pallets: list[Box] = []
        gratings: list[Box] = []
        left_m = wished_m
        for _ in range(_TRIES):
            if left_m <= _LEAST_HIDDEN_M:
                break
            is_pallet = self._rng.random() < 0.5
            box = self._pallet() if is_pallet else self._grating()
            hidden_m = painted_m(self._lines, box)
            away = [*self._taken, *self._shelves, *(self._pads if is_pallet else ())]
            if _LEAST_HIDDEN_M <= hidden_m <= left_m + _LEAST_HIDDEN_M and not meets(box, away):
                (pallets if is_pallet else gratings).append(box)
                self._taken.append(box)
                left_m -= hidden_m
        return tuple(pallets), tuple(gratings)

    def wear_gaps(self, wished_m: float) -> tuple[Box, ...]:
        """Stretches along the lines from which the paint is gone, so many metres in all."""
        gaps: list[Box] = []
        left_m = wished_m
        for _ in range(_TRIES):
            if left_m <= 0.01:
                break
            line, length_m = self._line()
            long_m = min(self._rng.uniform(0.3, 1.0), left_m, length_m)
            x0_m, y0_m, x1_m, y1_m = stroke_box(line, _RAGGED_M)
            start_m = self._rng.uniform(0.0, length_m - long_m)
            box = (
                (x0_m + start_m, y0_m, x0_m + start_m + long_m, y1_m)
                if runs_along_x(line)
                else (x0_m, y0_m + start_m, x1_m, y0_m + start_m + long_m)
            )
            if not meets(box, self._taken):
                gaps.append(box)
                self._taken.append(box)
                left_m -= painted_m(self._lines, box)
        return tuple(gaps)

    def paint_false_lines(self, wished_m: float) -> tuple[Stripe, ...]:
        """Stripes like the guide lines, so many metres in all, to 0.25 m."""
        stripes: list[Stripe] = []
        left_m, rng = wished_m, self._rng
        for _ in range(_TRIES):
            if left_m <= 0.25:
                break
            (x_m, y_m), line = self._place()
            along_x = rng.random() < 0.5
            askew_rad = math.radians(rng.uniform(-10.0, 10.0)) if rng.random() < _ASKEW else 0.0
            stripe = Stripe(
                x_m + rng.uniform(-1.0, 1.0),
                y_m + rng.uniform(-1.0, 1.0),
                min(rng.uniform(0.5, 1.5), max(left_m, 0.5)),
                line.width_m * rng.uniform(0.7, 1.3),
                askew_rad + (0.0 if along_x else math.pi / 2),
            )
            alongside = (
                stroke_box(line, _ALONGSIDE_M) for line in self._lines if runs_along_x(line) is along_x
            )
            box = stripe.box()
            if lies_in(box, self._bounds) and not meets(box, [*self._taken, *self._shelves, *alongside]):
                stripes.append(stripe)
                self._taken.append(box)
                left_m -= stripe.length_m
        return tuple(stripes)

    def _pallet(self) -> Box:
        (x_m, y_m), line = self._place()
        size_x_m, size_y_m = _PALLET_M if self._rng.random() < 0.5 else _PALLET_M[::-1]
        aside_m = self._rng.uniform(-0.3, 0.3)
        dx_m, dy_m = (0.0, aside_m) if runs_along_x(line) else (aside_m, 0.0)
        return _box(x_m + dx_m, y_m + dy_m, size_x_m / 2, size_y_m / 2)

    def _grating(self) -> Box:
        (x_m, y_m), line = self._place()
        half_m = self._rng.uniform(0.3, 0.75), self._rng.uniform(0.075, 0.1)
        lies_along, aside_m = self._rng.random() < 0.5, self._rng.uniform(-0.2, 0.2)
        if lies_along:
            aside_m = 0.0
        if runs_along_x(line) is lies_along:
            return _box(x_m + aside_m, y_m, half_m[0], half_m[1])
        return _box(x_m, y_m + aside_m, half_m[1], half_m[0])

    def _line(self) -> tuple[PaintedLine, float]:
        """A line and its length; a long one is as much more often drawn as it is longer."""
        (k,) = self._rng.choices(range(len(self._lines)), self._lengths_m)
        return self._lines[k], self._lengths_m[k]

    def _place(self) -> tuple[tuple[float, float], PaintedLine]:
        """A point on a line, anywhere on the paint."""
        line, _ = self._line()
        at = self._rng.random()
        x_m = line.x0_m + at * (line.x1_m - line.x0_m)
        return (x_m, line.y0_m + at * (line.y1_m - line.y0_m)), line


def _box(x_m: float, y_m: float, half_x_m: float, half_y_m: float) -> Box:
    return x_m - half_x_m, y_m - half_y_m, x_m + half_x_m, y_m + half_y_m
