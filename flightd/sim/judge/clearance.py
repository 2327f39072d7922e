"""How near the drone's body came to what stands or hangs in the hall.

The body is an upright cylinder with the propellers in it; a tilt of some degrees moves its rim by less than
the cylinder is too large.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flightd.sim.judge.motion import TrueMotion, Values
from flightd.site.rack_depth import rack_body
from flightd.site.site import Site
from flightd.site.ways import BODY_RADIUS_M, KeepOut

BODY_HALF_HEIGHT_M = 0.10
"""From the body's origin down to the feet, and up."""
_BLOCK = 500
"""So many samples, some seconds, are measured at once."""


@dataclass(frozen=True, slots=True)
class Clearance:
    """The free distances between the body and one kind of obstacle, (n,) metres for the n samples of a
    motion; 0 or less: it is hit."""

    obstacle: str
    free_m: Values

    @property
    def least_m(self) -> float:
        return float(self.free_m.min())


def clearances(site: Site, motion: TrueMotion) -> list[Clearance]:
    """The free distances to racks, ceiling and keep-outs, where the site has any.  Empty without motion."""
    if not len(motion):
        return []
    found = [Clearance("ceiling", site.ceiling_m - (motion.height_m + BODY_HALF_HEIGHT_M))]
    racks = [rack_body(site, shelf) for shelf in site.shelves]
    for obstacle, boxes in (("rack", racks), ("keep_out", site.keep_outs)):
        if boxes:
            found.append(Clearance(obstacle, _to_nearest(boxes, motion)))
    return found


def _to_nearest(boxes: Sequence[KeepOut], motion: TrueMotion) -> Values:
    """From each sample to the nearest of the boxes.  In a large hall most are far from all samples of some
    seconds: they are not measured where they stand further off than what is nearest then."""
    x0_m, y0_m, x1_m, y1_m = np.array([(b.x0_m, b.y0_m, b.x1_m, b.y1_m) for b in boxes], np.float64).T
    free_m = np.full(len(motion), math.inf)
    for begin in range(0, len(motion), _BLOCK):
        part = slice(begin, begin + _BLOCK)
        x_m, y_m, height_m, free = motion.x_m[part], motion.y_m[part], motion.height_m[part], free_m[part]
        at_least = _beside(x0_m - x_m.max(), x_m.min() - x1_m, y0_m - y_m.max(), y_m.min() - y1_m)
        for number in np.argsort(at_least):
            if at_least[number] >= free.max():
                break
            box = boxes[number]
            beside = _beside(box.x0_m - x_m, x_m - box.x1_m, box.y0_m - y_m, y_m - box.y1_m)
            below = box.from_m - (height_m + BODY_HALF_HEIGHT_M)
            above = (height_m - BODY_HALF_HEIGHT_M) - box.to_m
            np.minimum(free, _free(beside, np.maximum(below, above)), out=free)
    return free_m


def _beside(left_m: Values, right_m: Values, before_m: Values, behind_m: Values) -> Values:
    """The gap on the floor between the body and a box from how far its middle is beyond each side."""
    dx, dy = np.maximum(left_m, right_m), np.maximum(before_m, behind_m)
    return np.hypot(np.maximum(dx, 0.0), np.maximum(dy, 0.0)) - BODY_RADIUS_M


def _free(beside_m: Values, over_m: Values) -> Values:
    """The distance to an upright box from the gaps beside it and above or below it; where both are closed
    the body is in it, by so much as the smaller gap lacks."""
    apart = np.hypot(np.maximum(beside_m, 0.0), np.maximum(over_m, 0.0))
    return np.where(apart > 0.0, apart, np.maximum(beside_m, over_m))
