"""What stands below the legs: how low may be sunk over it, and where beside it may be landed.  Pure.

A keep-out whose top the flight's heights pass by closes no leg.  Over it nothing sinks to wait, and a landing
that sees where it is goes along its line to where the floor is free.  One that sees nothing comes down on it:
what drifts unseen does so with the square of the time, and to stay up would be to fly on stale data.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from flightd.config.mission import MissionConfig
from flightd.core.types import GridPose
from flightd.mission.guidance import MissionInputs
from flightd.site.site import Site
from flightd.site.ways import BODY_RADIUS_M, KEEP_OUT_CLEARANCE_M, KEEP_OUT_HEIGHT_M, KeepOut

_ASIDE_M = 5.0
"""Not farther: what has to land now should not fly on for long."""
_ON_LINE_M, _AS_NEAR_M = 0.6, 0.3
"""A line that is farther away is not the one that is flown; one that is so little farther than the nearest
may be."""
_THERE_M = 0.25
"""So near to the place beside it, it comes down."""


@dataclass(frozen=True, slots=True)
class _Run:
    """A straight stretch of open lines from `low_m` to `high_m`, along x or along y, at `across_m`."""

    along_x: bool
    across_m: float
    low_m: float
    high_m: float

    def of(self, x_m: float, y_m: float) -> tuple[float, float]:
        """(along, across) of a point of the map."""
        return (x_m, y_m) if self.along_x else (y_m, x_m)

    def place(self, along_m: float) -> tuple[float, float]:
        return (along_m, self.across_m) if self.along_x else (self.across_m, along_m)

    def away_m(self, x_m: float, y_m: float) -> float:
        along_m, across_m = self.of(x_m, y_m)
        beyond_m = max(self.low_m - along_m, along_m - self.high_m, 0.0)
        return math.hypot(beyond_m, across_m - self.across_m)


class LowKeepOuts:
    """Of one site as it is flown: `Site.between` the heights of the flight."""

    def __init__(self, site: Site, params: MissionConfig) -> None:
        self._params = params
        self._areas = site.low_keep_outs
        self._runs = tuple(_runs(site)) if self._areas else ()

    def floor_m(self, s: MissionInputs) -> float:
        """Below this height it does not sink to wait; 0 where nothing stands below.  A drone that may be
        elsewhere may be over any of them."""
        pose = s.pose
        known = pose is not None and s.is_sure(self._params)
        near = _near(self._areas, pose) if pose is not None and known else self._areas
        return max((area.to_m + KEEP_OUT_HEIGHT_M for area in near), default=0.0)

    def top_m(self, s: MissionInputs) -> float:
        """The top of what stands where the drone is believed to be; 0 for the floor."""
        near = () if s.pose is None else _near(self._areas, s.pose)
        return max((area.to_m for area in near), default=0.0)

    def landing_place(self, s: MissionInputs, here_m: tuple[float, float]) -> tuple[float, float]:
        """Where to come down: `here_m`, or the nearest place of its line that is free.  Who is not sure of
        the place stays."""
        if not self._areas or not s.is_sure(self._params) or not self._is_near(here_m):
            return here_m
        nearest_m = min((run.away_m(*here_m) for run in self._runs), default=math.inf)
        found = [
            place
            for run in self._runs
            if run.away_m(*here_m) <= min(nearest_m + _AS_NEAR_M, _ON_LINE_M)
            for place in self._free_of(run, here_m)
        ]
        best = min(found, key=lambda place: math.dist(place, here_m), default=here_m)
        return best if math.dist(best, here_m) <= _ASIDE_M else here_m

    def is_on_way(self, s: MissionInputs, place_m: tuple[float, float]) -> bool:
        """It is still over one of them, on its way to a landing place beside it."""
        if not self._areas or self.top_m(s) == 0.0 or self._is_near(place_m):
            return False
        return s.distance_m(place_m) > _THERE_M

    def _is_near(self, place_m: tuple[float, float]) -> bool:
        return any(_away_m(area, *place_m) < KEEP_OUT_CLEARANCE_M for area in self._areas)

    def _free_of(self, run: _Run, here_m: tuple[float, float]) -> Iterator[tuple[float, float]]:
        """The nearest free places of a run before and behind, and where it ends free."""
        along_m, _ = run.of(*here_m)
        reach_m = KEEP_OUT_CLEARANCE_M + 1e-6
        ends = [along_m, run.low_m, run.high_m]
        for area in self._areas:
            low, high = (area.x0_m, area.x1_m) if run.along_x else (area.y0_m, area.y1_m)
            ends += [low - reach_m, high + reach_m]
        for end_m in ends:
            place_m = run.place(end_m)
            if run.low_m <= end_m <= run.high_m and not self._is_near(place_m):
                yield place_m


def _near(areas: Sequence[KeepOut], pose: GridPose) -> list[KeepOut]:
    """Those that the drone may be over, to two standard deviations of its position."""
    sigma_m = math.sqrt(max(pose.covariance[0], pose.covariance[4], 0.0))
    reach_m = BODY_RADIUS_M + 2.0 * sigma_m
    return [area for area in areas if _away_m(area, pose.x_m, pose.y_m) < reach_m]


def _away_m(area: KeepOut, x_m: float, y_m: float) -> float:
    dx_m = max(area.x0_m - x_m, x_m - area.x1_m, 0.0)
    dy_m = max(area.y0_m - y_m, y_m - area.y1_m, 0.0)
    return math.hypot(dx_m, dy_m)


def _runs(site: Site) -> Iterator[_Run]:
    """The open lines, those that lie end to end as one."""
    stretches: dict[tuple[bool, float], list[tuple[float, float]]] = {}
    for edge in site.edges:
        if site.is_closed(edge):
            continue
        a, b = site.nodes[edge.a], site.nodes[edge.b]
        along_x = abs(a.x_m - b.x_m) >= abs(a.y_m - b.y_m)
        across_m, ends = (a.y_m, (a.x_m, b.x_m)) if along_x else (a.x_m, (a.y_m, b.y_m))
        stretches.setdefault((along_x, across_m), []).append((min(ends), max(ends)))
    for (along_x, across_m), pieces in stretches.items():
        low_m, high_m = math.inf, -math.inf
        for begin_m, end_m in sorted(pieces):
            if begin_m > high_m + 1e-6:
                if high_m > low_m:
                    yield _Run(along_x, across_m, low_m, high_m)
                low_m = begin_m
            high_m = max(high_m, end_m)
        yield _Run(along_x, across_m, low_m, high_m)
