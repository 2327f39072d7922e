"""Points of the floor (grain, stains, cracks) followed from picture to picture, computed, not looked for."""

from __future__ import annotations

import random
from dataclasses import dataclass

from flightd.core.types import FloorFeature
from flightd.vision.floor.feature_tracking import MOST_TOLD
from tests.sim.ideal.ideal_sight import EyeView

_FOLLOWED = 12
_PLACE_PX, _CREEP_PX, _LOST = 0.5, 0.2, 0.05
"""Standard deviations in the picture, of a place and of what it creeps by from one picture to the next, and
the share of the points that each picture loses."""


@dataclass(slots=True)
class _Point:
    id: int
    x_m: float
    y_m: float
    off_px: tuple[float, float] = (0.0, 0.0)
    """What it has crept by from picture to picture."""


class FloorPoints:
    """Follows some points that are in view, the oldest told, as the vision does; give `see` each picture."""

    def __init__(self, seed: int) -> None:
        self._random = random.Random(f"points {seed}")
        self._points: list[_Point] = []
        self._next_id = 0

    def lose(self) -> None:
        """Nothing was seen: whatever comes is new."""
        self._points.clear()

    def see(self, view: EyeView) -> tuple[FloorFeature, ...]:
        """Those followed from the picture before."""
        rng = self._random
        kept: list[_Point] = []
        told: list[FloorFeature] = []
        for point in self._points:
            at = view.pixel(point.x_m, point.y_m)
            if at is None or rng.random() < _LOST:
                continue
            kept.append(point)
            du, dv = (off + rng.gauss(0.0, _CREEP_PX) for off in point.off_px)
            point.off_px = du, dv
            if len(told) < MOST_TOLD:
                u, v = (c + off + rng.gauss(0.0, _PLACE_PX) for c, off in zip(at, (du, dv), strict=True))
                told.append(FloorFeature(point.id, u, v))
        while len(kept) < _FOLLOWED:
            floor_m = view.floor(rng.random(), rng.random())
            if floor_m is None:
                break
            kept.append(_Point(self._next_id, *floor_m))
            self._next_id += 1
        self._points = kept
        return tuple(told)
