"""Points of the floor (grain, stains, cracks) followed from picture to picture, computed, not looked for."""

from __future__ import annotations

import random
from dataclasses import dataclass

from flightd.core.types import FloorFeature
from flightd.vision.floor.feature_tracking import MOST_TOLD
from tests.sim.ideal.ideal_sight import EyeView

_FOLLOWED = 12


@dataclass(slots=True)
class _Point:
    id: int
    x_m: float
    y_m: float
    off_px: tuple[float, float] = (0.0, 0.0)
    """What it has crept by from picture to picture."""


@dataclass(frozen=True, slots=True)
class PointErrors:
    """Standard deviations in the picture, of a place and of what it creeps by from one picture to the next,
    and the share of the points that each picture loses."""

    place_px: float = 0.5
    creep_px: float = 0.2
    lost: float = 0.05


class FloorPoints:
    """Follows some points that are in view, the oldest told, as the vision does; give `see` each picture."""

    def __init__(self, seed: int, errors: PointErrors = PointErrors()) -> None:
        self._random = random.Random(f"points {seed}")
        self._errors = errors
        self._points: list[_Point] = []
        self._next_id = 0

    def lose(self) -> None:
        """Nothing was seen: whatever comes is new."""
        self._points.clear()

    def see(self, view: EyeView) -> tuple[FloorFeature, ...]:
        """Those followed from the picture before."""
        rng, errors = self._random, self._errors
        kept: list[_Point] = []
        told: list[FloorFeature] = []
        for point in self._points:
            at = view.pixel(point.x_m, point.y_m)
            if at is None or rng.random() < errors.lost:
                continue
            kept.append(point)
            du, dv = (off + rng.gauss(0.0, errors.creep_px) for off in point.off_px)
            point.off_px = du, dv
            if len(told) < MOST_TOLD:
                u, v = (
                    c + off + rng.gauss(0.0, errors.place_px) for c, off in zip(at, (du, dv), strict=True)
                )
                told.append(FloorFeature(point.id, u, v))
        while len(kept) < _FOLLOWED:
            floor_m = view.floor(rng.random(), rng.random())
            if floor_m is None:
                break
            kept.append(_Point(self._next_id, *floor_m))
            self._next_id += 1
        self._points = kept
        return tuple(told)
