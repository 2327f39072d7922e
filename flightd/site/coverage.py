"""Does the front camera see and read every label from the nodes?

The paper's rule (section on the warehouse layout): a camera with field of view sigma at distance D_Y sees
D_X = 2 D_Y tan(sigma / 2) of the shelf; nodes may be D_X apart, the first at most D_X / 2 from the start.
A label is read at 2.5 pixels for each module and more, and blurred by less than 0.75 module.
"""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass
from typing import Any, Self

from flightd.config.front_camera import FrontCameraConfig
from flightd.site.site import Location, Shelf, Site

MIN_PX_PER_MODULE = 2.5
LEAST_PX_PER_MODULE = 1.0
"""Below, nothing is read; from there on linear codes mostly are, others not before about 2."""
MAX_BLUR_MODULES = 0.75
_SLACK_M = _SLACK_PX = 1e-6


class Legibility(enum.StrEnum):
    """Whether labels are read by their size in the picture."""

    SURE = "sure"
    UNSURE = "unsure"
    NONE = "none"


@dataclass(frozen=True, slots=True)
class FrontView:
    """The front camera on the drone, and the labels it must read.  `fov_rad` is the horizontal field."""

    fov_rad: float
    width_px: int
    exposure_s: float
    module_m: float

    @classmethod
    def of(cls, front: FrontCameraConfig, module_m: float) -> Self:
        """As configured."""
        fov_rad = 2.0 * math.atan(front.width_px / 2.0 / front.fx_px)
        return cls(fov_rad, front.width_px, front.exposure_s, module_m)

    @property
    def focal_px(self) -> float:
        """Pixels of a pinhole with square pixels."""
        return self.width_px / 2 / math.tan(self.fov_rad / 2)

    def seen_m(self, distance_m: float) -> float:
        """D_X: how much of a shelf is in the picture across."""
        return 2 * distance_m * math.tan(self.fov_rad / 2)

    def px_per_module(self, distance_m: float) -> float:
        return self.focal_px * self.module_m / distance_m

    def legibility(self, distance_m: float) -> Legibility:
        """Of labels on a shelf at that distance."""
        px = self.px_per_module(distance_m)
        if px >= MIN_PX_PER_MODULE - _SLACK_PX:
            return Legibility.SURE
        return Legibility.UNSURE if px >= LEAST_PX_PER_MODULE else Legibility.NONE

    def speed_limit_mps(self) -> float:
        """Fastest flight along the shelf at which the blur stays within 0.75 module."""
        return MAX_BLUR_MODULES * self.module_m / self.exposure_s

    def reading_distance_m(self) -> float:
        """Farthest distance with 2.5 pixels for each module."""
        return self.focal_px * self.module_m / MIN_PX_PER_MODULE


@dataclass(frozen=True, slots=True)
class Gap:
    """A stretch of a shelf front, `from_m` to `to_m` along x, that is in no node's picture of `seen_m`."""

    aisle: str
    side: str
    from_m: float
    to_m: float
    seen_m: float

    def __str__(self) -> str:
        where = f"aisle {self.aisle}, {self.side} side: x {self.from_m:.2f} to {self.to_m:.2f} m"
        return (
            f"{where} is in no picture; nodes may be {self.seen_m:.2f} m apart and {self.seen_m / 2:.2f} m "
            "from the shelf's ends"
        )


@dataclass(frozen=True, slots=True)
class Coverage:
    """What the camera will see and read from the nodes, flown at `speed_mps` while it looks.

    `problems` are lines for a person, `gaps` those of them that have a place; `unseen` the codes out of every
    picture, `unreadable` those seen too small; `read_part` is the share of all locations that is neither (1
    for a site without any), and 0 where the flight is too fast.
    """

    locations: int
    unseen: tuple[str, ...]
    unreadable: tuple[str, ...]
    least_px_per_module: float
    blur_modules: float
    speed_limit_mps: float
    problems: tuple[str, ...]
    gaps: tuple[Gap, ...] = ()

    @property
    def read_part(self) -> float:
        if self.blur_modules > MAX_BLUR_MODULES:
            return 0.0
        lost = len(self.unseen) + len(self.unreadable)
        return 1.0 - lost / self.locations if self.locations else 1.0


def check_coverage(site: Site, view: FrontView, speed_mps: float) -> Coverage:
    """Hold every shelf front against the paper's rule, and every label against the reader's limits."""
    uncovered = [gap for shelf in site.shelves for gap in _gaps(site, shelf, view)]
    problems = [str(gap) for gap in uncovered]
    unseen, unreadable = [], []
    smallest = math.inf
    for location in site.locations.values():
        distance_m = _distance_m(site, location)
        px = view.px_per_module(distance_m)
        smallest = min(smallest, px)
        along_m = abs(location.x_m - site.nodes[location.node].x_m)
        if along_m > view.seen_m(distance_m) / 2 + _SLACK_M:
            unseen.append(location.code)
        elif px < MIN_PX_PER_MODULE:
            unreadable.append(location.code)
    if not site.locations and site.shelves:
        smallest = min(view.px_per_module(_shelf_distance_m(site, shelf)) for shelf in site.shelves)
    if smallest < MIN_PX_PER_MODULE:
        problems.append(too_small(smallest, view.reading_distance_m()))
    blur = speed_mps * view.exposure_s / view.module_m
    if blur > MAX_BLUR_MODULES:
        problems.append(
            f"{speed_mps:g} m/s blurs labels by {blur:.2f} modules, {MAX_BLUR_MODULES:g} are allowed: "
            f"fly at most {view.speed_limit_mps():.3f} m/s while looking"
        )
    return Coverage(
        len(site.locations),
        tuple(unseen),
        tuple(unreadable),
        smallest if math.isfinite(smallest) else 0.0,
        blur,
        view.speed_limit_mps(),
        tuple(problems),
        tuple(uncovered),
    )


def too_small(px_per_module: float, within_m: float) -> str:
    """What is wrong with labels of which the smallest gets so much of a picture, and what helps: it is read
    `within_m`."""
    return (
        f"labels get {px_per_module:.2f} px per module, {MIN_PX_PER_MODULE:g} are needed: "
        f"come within {within_m:.2f} m, or take a longer lens or larger labels"
    )


def _gaps(site: Site, shelf: Shelf, view: FrontView) -> list[Gap]:
    """Each stretch of the front that is in no node's picture."""
    seen_m = view.seen_m(_shelf_distance_m(site, shelf))
    gaps = []
    reached_m = shelf.x0_m
    for x_m in [*(node.x_m for node in site.aisle_nodes(shelf.aisle)), math.inf]:
        starts_m = min(x_m - seen_m / 2, shelf.x1_m)
        if starts_m > reached_m + _SLACK_M:
            gaps.append(Gap(shelf.aisle, shelf.side, reached_m, starts_m, seen_m))
        reached_m = max(reached_m, min(x_m + seen_m / 2, shelf.x1_m))
    return gaps


def _shelf_distance_m(site: Site, shelf: Shelf) -> float:
    aisle = next(aisle for aisle in site.aisles if aisle.id == shelf.aisle)
    return aisle.shelf_distance_m


def _distance_m(site: Site, location: Location) -> float:
    return abs(location.y_m - site.nodes[location.node].y_m)


def coverage_facts(reach: Coverage) -> dict[str, Any]:
    """The coverage in numbers and lists, as JSON has it."""
    return {
        "read_part": round(reach.read_part, 5),
        "px_per_module": round(reach.least_px_per_module, 3),
        "blur_modules": round(reach.blur_modules, 3),
        "speed_limit_mps": round(reach.speed_limit_mps, 4),
        "unseen": list(reach.unseen),
        "unreadable": list(reach.unreadable),
        "problems": list(reach.problems),
    }
