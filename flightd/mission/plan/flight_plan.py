"""The flight plan: where to stop, in what order, facing where.

Heading policies: ALONG flies with the nose in the direction of travel; SHELF keeps the nose (the front
camera) to the shelf of the aisle and flies sideways.  Between aisles the next line is far away, so there
the longer side of the down camera's picture is turned along the way.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from flightd.config.mission import Heading
from flightd.config.schema import Config
from flightd.config.sweep import ScanMode
from flightd.mission.plan.sweep_leg import SweepLeg
from flightd.site.site import Side, Site

_AHEAD_DEG = 45.0
"""A front camera that is turned aside by less looks along the nose."""


def counts_shelves(config: Config, site: Site) -> bool:
    """Whether flights count: with a front camera, where there are locations."""
    return config.front_camera.is_fitted and bool(site.locations)


@dataclass(frozen=True, slots=True)
class HeadingPolicy:
    """The heading wanted, and whether the longer side of the picture lies along the drone's nose."""

    heading: Heading
    long_side_ahead: bool = True

    @classmethod
    def of(cls, config: Config, site: Site) -> HeadingPolicy:
        """The mission's heading, flown with the configured down camera; nose to the shelf for who may
        fly past shelves with a camera that looks ahead, where he stops before them, too."""
        ahead = abs(config.front_camera.mount_yaw_deg) < _AHEAD_DEG
        swept = config.scan.mode is ScanMode.SWEEP and counts_shelves(config, site) and ahead
        return cls(Heading.SHELF if swept else config.mission.heading, config.camera.long_side_ahead)


@dataclass(frozen=True, slots=True)
class Stop:
    """A node to stop at.  `yaw_rad` is flown from the stop before up to here; `visit` says that the node
    is one of the wanted ones (dwell, scan), not just a corner on the way; `sweep` is what is flown past on
    the way to it; `waits`: it holds there until it is told where to fly on."""

    node: str
    x_m: float
    y_m: float
    yaw_rad: float
    visit: bool
    sweep: SweepLeg | None = None
    waits: bool = False

    @property
    def speed_mps(self) -> float:
        """What is flown past on the way to it bears no more; infinite where nothing is."""
        return math.inf if self.sweep is None else self.sweep.speed_mps


@dataclass(frozen=True, slots=True)
class FlightPlan:
    """Stops in order, the last one above the pad.  `start_yaw_rad` is the heading on the pad."""

    start: str
    home: str
    start_yaw_rad: float
    stops: tuple[Stop, ...]

    @property
    def visits(self) -> int:
        """Stops that are visits; a node may be visited twice."""
        return sum(stop.visit for stop in self.stops)

    @property
    def waits(self) -> bool:
        """It ends by holding at its last visit, not at home."""
        return any(stop.waits for stop in self.stops)

    @property
    def to_visit(self) -> frozenset[str]:
        """The nodes that are visited."""
        return frozenset(stop.node for stop in self.stops if stop.visit)

    @property
    def nodes(self) -> int:
        """Nodes that are visited, each counted once."""
        return len(self.to_visit)


def run_of(site: Site, stops: Sequence[Stop]) -> tuple[str, ...]:
    """The first of some stops and the visits that follow it in its aisle without another stop between."""
    aisle = site.nodes[stops[0].node].aisle if stops else ""
    visits = itertools.takewhile(lambda stop: stop.visit and site.nodes[stop.node].aisle == aisle, stops)
    return tuple(stop.node for stop in visits)


def runs_of(site: Site, stops: Sequence[Stop]) -> Iterator[tuple[str, ...]]:
    """All visits of some stops, run by run."""
    while stops:
        run = run_of(site, stops)
        if run:
            yield run
        stops = stops[max(len(run), 1) :]


def make_plan(
    site: Site,
    visits: Sequence[str],
    start: str,
    home: str,
    policy: HeadingPolicy,
    start_yaw_rad: float = 0.0,
    *,
    in_need: bool = False,
    waits: bool = False,
) -> FlightPlan:
    """Plan a flight from `start` over `visits` in the given order to `home`, along open painted lines;
    `in_need` one-way lines count as open both ways; it `waits` at the last visit before it flies home.

    Corners on the way become stops of their own.  Raises InputError for a node that the site lacks or to
    which no open way leads.
    """
    for node in (start, home, *visits):
        site.require(node)
    stops: list[Stop] = []
    here, yaw = start, start_yaw_rad
    for goal, visit in [*((node, True) for node in visits), (home, False)]:
        if waits and not visit:
            stops.append(replace(_stop(site, here, yaw, visit=False), waits=True))
        path = site.path(here, goal, against_one_way=in_need)
        for i, node in enumerate(path[1:], start=1):
            corner = i + 1 < len(path) and not _straight(site, path[i - 1], node, path[i + 1])
            yaw = leg_yaw(site, path[i - 1], node, policy, yaw)
            if corner or node == goal:
                stops.append(_stop(site, node, yaw, visit and node == goal))
        if len(path) == 1:
            stops.append(_stop(site, goal, yaw, visit))
        here = goal
    return FlightPlan(start, home, start_yaw_rad, tuple(stops))


def _stop(site: Site, node: str, yaw_rad: float, visit: bool) -> Stop:
    at = site.nodes[node]
    return Stop(node, at.x_m, at.y_m, yaw_rad, visit)


def _direction(site: Site, a: str, b: str) -> float:
    one, two = site.nodes[a], site.nodes[b]
    return math.atan2(two.y_m - one.y_m, two.x_m - one.x_m)


def _straight(site: Site, a: str, b: str, c: str) -> bool:
    return abs(math.sin((_direction(site, a, b) - _direction(site, b, c)) / 2)) < 1e-6


def leg_yaw(site: Site, a: str, b: str, policy: HeadingPolicy, yaw_before: float) -> float:
    """Heading flown from node `a` to its neighbour `b`."""
    direction = _direction(site, a, b)
    if policy.heading is Heading.ALONG:
        return direction
    if site.nodes[a].aisle != site.nodes[b].aisle:
        return direction if policy.long_side_ahead else 0.0
    sides = [shelf.side for shelf in site.shelves if shelf.aisle == site.nodes[b].aisle]
    if not sides:
        return yaw_before
    return math.pi / 2 if Side.RIGHT in sides else -math.pi / 2
