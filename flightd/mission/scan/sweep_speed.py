"""How fast a shelf may be flown past so that its labels are still read, and what limits that.  Pure.

A label is read at 2.5 pixels for each module and more, blurred by less than 0.75 module (`site.coverage`);
each place must be wholly in several pictures on the way.
"""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass

from flightd.config.schema import Config
from flightd.site.coverage import MAX_BLUR_MODULES, FrontView, Legibility

_POSE_M = 0.04
_POSE_RAD = math.radians(2.0)
"""How far off the picture may lie on the shelf: the drone's place, and its heading."""
_CRAWL_MPS = 0.1
"""Slower than this a place is passed in no less time than a stop before it takes."""


class Limit(enum.StrEnum):
    """What keeps a flight past a shelf from being faster."""

    BLUR = "blur"
    OVERLAP = "overlap"
    CRUISE = "cruise"
    CONFIGURED = "configured"


class StopCause(enum.StrEnum):
    """Why places are counted by stopping, none of them in passing."""

    LABELS = "labels"
    """Their labels are too small in the picture."""
    WIDTH = "width"
    """A place is nearly as wide as the picture, or wider: to stop before it is quicker than to crawl past."""
    LINE = "line"
    """The line is not open both ways, or not clear at that height."""
    NODES = "nodes"
    """They are before too few nodes."""


@dataclass(frozen=True, slots=True)
class Shelf:
    """What is flown past: how far away, and how wide its widest place is."""

    distance_m: float
    place_m: float


@dataclass(frozen=True, slots=True)
class SweepOptics:
    """What sees it: the front camera and its readers, and what they must see."""

    view: FrontView
    least_exposure: float
    fps: float
    label_m: float
    views: int
    cruise_mps: float
    configured_mps: float | None = None

    @classmethod
    def of(cls, config: Config) -> SweepOptics:
        """As configured: frames that the readers have no time for are none."""
        front, scan = config.front_camera, config.scan
        sweep = scan.sweep
        return cls(
            FrontView.of(front, sweep.module_m),
            sweep.least_exposure,
            min(front.fps, scan.workers / sweep.read_s),
            sweep.label_m,
            sweep.views,
            config.mission.speed_mps,
            sweep.speed_mps,
        )


@dataclass(frozen=True, slots=True)
class SweepSpeed:
    """The fastest flight past a shelf, and what comes of it.

    `exposure` is a part of the camera's usual one, `exposure_s` what that comes to.  `window_m` is the way on
    which a place is wholly in the picture, `views` how many pictures that gives, `fps` how many frames are
    read in a second and `needed_fps` how many this speed needs; `limits_mps` what each limit alone allows,
    `limit` the lowest of them.  0 m/s where a place is wider than the picture.  `stops_for` is why it is not
    flown past, None if it may be: the labels are large enough in the picture, and a place fits well."""

    speed_mps: float
    limit: Limit
    limits_mps: tuple[tuple[Limit, float], ...]
    exposure: float
    blur_modules: float
    px_per_module: float
    window_m: float
    views: float
    fps: float
    needed_fps: float
    exposure_s: float
    stops_for: StopCause | None


def sweep_speed(shelf: Shelf, optics: SweepOptics) -> SweepSpeed:
    """The speed past one shelf front."""
    view = optics.view
    wide_m = max(shelf.place_m, optics.label_m)
    spare_m = _POSE_M + shelf.distance_m * math.tan(_POSE_RAD)
    window_m = view.seen_m(shelf.distance_m) - wide_m - 2.0 * spare_m
    limits = {
        Limit.BLUR: view.speed_limit_mps() / optics.least_exposure,
        Limit.OVERLAP: max(window_m, 0.0) * optics.fps / optics.views,
        Limit.CRUISE: optics.cruise_mps,
    }
    if optics.configured_mps is not None:
        limits[Limit.CONFIGURED] = optics.configured_mps
    limit = min(limits, key=limits.__getitem__)
    speed_mps = limits[limit]
    # no darker than the speed asks for
    exposure = min(1.0, view.speed_limit_mps() / speed_mps) if speed_mps > 0.0 else 1.0
    px = view.px_per_module(shelf.distance_m)
    stops_for = None if limits[Limit.OVERLAP] >= _CRAWL_MPS else StopCause.WIDTH
    if view.legibility(shelf.distance_m) is not Legibility.SURE:
        stops_for = StopCause.LABELS
    return SweepSpeed(
        speed_mps=speed_mps,
        limit=limit,
        limits_mps=tuple(limits.items()),
        exposure=exposure,
        blur_modules=MAX_BLUR_MODULES * speed_mps * exposure / view.speed_limit_mps(),
        px_per_module=px,
        window_m=max(window_m, 0.0),
        views=window_m * optics.fps / speed_mps if speed_mps > 0.0 else 0.0,
        fps=optics.fps,
        needed_fps=optics.views * speed_mps / window_m if window_m > 0.0 else 0.0,
        exposure_s=exposure * view.exposure_s,
        stops_for=stops_for,
    )
