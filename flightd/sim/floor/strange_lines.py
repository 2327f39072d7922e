"""What others have left on a floor: long old lines beside the true ones, and tape of other colours."""

from __future__ import annotations

import math
import random
from collections.abc import Iterable

from flightd.core.paint import NAMED_PAINTS, paint_srgb
from flightd.sim.floor.paint_damage import (
    OldLine,
    Stripe,
    Tape,
    around_pads,
    lies_in,
    meets,
    painted_m,
    rack_boxes,
    runs_along_x,
    stroke_box,
)
from flightd.sim.floor.texture import Box
from flightd.site.site import PaintedLine, Site

_TRIES = 200
_LONG_M = 3.0, 10.0
_LEAST_LONG_M = 2.0
"""No part of a shorter line is an old one: beside stubs at a crossing there are none."""
_ASIDE_M = 0.08, 0.40
"""From middle to middle; not nearer than leaves floor between both."""
_FLOOR_BETWEEN_M = 0.01
_SKEW_RAD = math.radians(0.25)
_LEFT = 0.35, 0.85
_TAPE_M, _TAPE_WIDTH_M = (0.5, 3.0), (0.04, 0.08)
_ALONGSIDE = 0.5
"""Share of the tape that lies along a line; the other lies anywhere, along x or y."""
_TAPE_COLOURS = "red", "white", "black", "yellow", "blue", "green"
_ALIKE = 100.0
"""Tape whose sRGB is nearer to the paint's is of its colour."""


def drawn_old_lines(
    site: Site, share: float, seed: int, others: Iterable[Stripe] = ()
) -> tuple[OldLine, ...]:
    """Old lines of 3 to 10 m, 8 to 40 cm beside true ones and as long as those at most, parallel to a quarter
    of a degree, a `share` of the painted length in the mean over the seeds: a small floor has one now and
    then.  They keep off pads, racks and `others`, and lie below what lies on the floor."""
    rng, old = random.Random(f"old lines {seed}"), list[OldLine]()
    long = [line for line in site.lines if painted_m([line]) >= _LEAST_LONG_M]
    taken = [*around_pads(site), *rack_boxes(site), *(stripe.box() for stripe in others)]
    left_m, bounds = share * painted_m(site.lines), site.bounds()
    for _ in range(_TRIES if long else 0):
        if left_m <= 0.0:
            break
        (line,) = rng.choices(long, [painted_m([one]) for one in long])
        stripe = _beside(line, rng, min(rng.uniform(*_LONG_M), painted_m([line])))
        box = stripe.box()
        if not lies_in(box, bounds) or meets(box, [*taken, *_alongside(site, line)]):
            continue
        if rng.random() >= left_m / stripe.length_m:
            break
        old.append(OldLine(stripe, rng.uniform(*_LEFT)))
        taken.append(box)
        left_m -= stripe.length_m
    return tuple(old)


def drawn_tapes(site: Site, share: float, seed: int) -> tuple[Tape, ...]:
    """Tape of colours that are not the paint's, a `share` of the painted length, half of it along lines, at
    least 8 cm from their middle; it may lie across them, below the paint."""
    rng, tapes = random.Random(f"tape {seed}"), list[Tape]()
    colours = [one for one in _TAPE_COLOURS if _unlike(one, site.line_colour)]
    taken = [*around_pads(site), *rack_boxes(site)]
    left_m, bounds = share * painted_m(site.lines), site.bounds()
    for _ in range(_TRIES):
        if left_m <= 0.25:
            break
        (line,) = rng.choices(site.lines, [painted_m([one]) for one in site.lines])
        long_m = min(rng.uniform(*_TAPE_M), max(left_m, _TAPE_M[0]))
        stripe = _beside(line, rng, long_m)
        if rng.random() >= _ALONGSIDE:
            stripe = Stripe(
                stripe.x_m + rng.uniform(-1.0, 1.0),
                stripe.y_m + rng.uniform(-1.0, 1.0),
                long_m,
                rng.uniform(*_TAPE_WIDTH_M),
                math.radians(rng.uniform(-10.0, 10.0)) + rng.choice((0.0, math.pi / 2)),
            )
        box, colour = stripe.box(), rng.choice(colours)
        if lies_in(box, bounds) and not meets(box, taken):
            tapes.append(Tape(stripe, colour))
            taken.append(box)
            left_m -= stripe.length_m
    return tuple(tapes)


def _beside(line: PaintedLine, rng: random.Random, long_m: float) -> Stripe:
    """A stripe so long along a line, to either side of it."""
    width_m = line.width_m * rng.uniform(0.7, 1.3)
    least_m = max(_ASIDE_M[0], (line.width_m + width_m) / 2 + _FLOOR_BETWEEN_M)
    aside_m = rng.choice((-1.0, 1.0)) * rng.uniform(least_m, _ASIDE_M[1])
    spare_m = max(painted_m([line]) - long_m, 0.0)
    along_m, turn_rad = rng.uniform(0.0, spare_m) + long_m / 2, rng.uniform(-_SKEW_RAD, _SKEW_RAD)
    if runs_along_x(line):
        return Stripe(line.x0_m + along_m, line.y0_m + aside_m, long_m, width_m, turn_rad)
    return Stripe(line.x0_m + aside_m, line.y0_m + along_m, long_m, width_m, turn_rad + math.pi / 2)


def _alongside(site: Site, line: PaintedLine) -> list[Box]:
    """The lines that are parallel to one, and itself."""
    along_x = runs_along_x(line)
    return [stroke_box(one) for one in site.lines if runs_along_x(one) is along_x]


def _unlike(colour: str, paint: str) -> bool:
    return colour in NAMED_PAINTS and math.dist(paint_srgb(colour), paint_srgb(paint)) > _ALIKE
