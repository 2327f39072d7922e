"""How near the drone's body came to what stands or hangs in the hall.

The body is an upright cylinder with the propellers in it; a tilt of some degrees moves its rim by less than
the cylinder is too large.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from flightd.sim.judge.motion import TrueMotion, Values
from flightd.site.site import Shelf, Site
from flightd.site.ways import KeepOut

BODY_RADIUS_M = 0.30
"""Half the width of the drone, with its propellers."""
BODY_HALF_HEIGHT_M = 0.10
"""From the body's origin down to the feet, and up."""


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
    for obstacle, each in (
        ("rack", _to_racks(site.shelves, motion)),
        ("keep_out", _to_keep_outs(site.keep_outs, motion)),
    ):
        distances = list(each)
        if distances:
            found.append(Clearance(obstacle, np.min(distances, axis=0)))
    return found


def _to_racks(shelves: Sequence[Shelf], motion: TrueMotion) -> Iterator[Values]:
    """To each shelf front, which stands from the floor to its height."""
    for shelf in shelves:
        dx = np.maximum(np.maximum(shelf.x0_m - motion.x_m, motion.x_m - shelf.x1_m), 0.0)
        beside = np.hypot(dx, motion.y_m - shelf.y_m) - BODY_RADIUS_M
        yield _free(beside, motion.height_m - BODY_HALF_HEIGHT_M - shelf.height_m)


def _to_keep_outs(areas: Sequence[KeepOut], motion: TrueMotion) -> Iterator[Values]:
    for area in areas:
        dx = np.maximum(np.maximum(area.x0_m - motion.x_m, motion.x_m - area.x1_m), 0.0)
        dy = np.maximum(np.maximum(area.y0_m - motion.y_m, motion.y_m - area.y1_m), 0.0)
        below = area.from_m - (motion.height_m + BODY_HALF_HEIGHT_M)
        above = (motion.height_m - BODY_HALF_HEIGHT_M) - area.to_m
        yield _free(np.hypot(dx, dy) - BODY_RADIUS_M, np.maximum(below, above))


def _free(beside_m: Values, over_m: Values) -> Values:
    """The distance to an upright box from the gaps beside it and above or below it; where both are closed
    the body is in it, by so much as the smaller gap lacks."""
    apart = np.hypot(np.maximum(beside_m, 0.0), np.maximum(over_m, 0.0))
    return np.where(apart > 0.0, apart, np.maximum(beside_m, over_m))
