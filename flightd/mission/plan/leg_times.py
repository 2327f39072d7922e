"""How long the parts of a flight take: legs by the speed profile, turns at corners, dwelling at stops.

Headings are those of the plan (`plan.leg_yaw`); lines run along x and y, so that every heading is one of
four, counted in quarter turns.  Where a shelf-facing drone passes an aisle without shelves it keeps the
heading that it has; here it counts as along +x.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from flightd.config.mission import MissionConfig
from flightd.mission.plan.flight_plan import HeadingPolicy, leg_yaw
from flightd.site.site import Site
from flightd.site.ways import NoWayError

Seconds: TypeAlias = NDArray[np.float64]
Quarters: TypeAlias = NDArray[np.int64]

ANY_QUARTER = 4
"""In place of a heading: none is wanted."""


def profile_s(distance: float, speed: float, accel: float) -> float:
    """Time from rest to rest over `distance` with bounded speed and acceleration."""
    if distance <= 0.0:
        return 0.0
    ramp = speed * speed / accel
    return distance / speed + speed / accel if distance >= ramp else 2.0 * math.sqrt(distance / accel)


@dataclass(frozen=True, slots=True)
class Pace:
    """How fast this mission moves: seconds for each kind of part."""

    height_m: float
    climb_mps: float
    climb_accel_mps2: float
    speed_mps: float
    accel_mps2: float
    turn_rate_radps: float
    turn_accel_radps2: float
    settle_s: float
    dwell_s: float
    take_off_s: float
    land_s: float

    @classmethod
    def of(cls, p: MissionConfig) -> Pace:
        x = p.expert
        return cls(
            p.height_m,
            p.climb_mps,
            x.climb_accel_mps2,
            p.speed_mps,
            p.accel_mps2,
            p.turn_rate_radps,
            x.turn_accel_radps2,
            p.settle_s,
            p.dwell_s,
            profile_s(p.height_m, p.climb_mps, x.climb_accel_mps2) + p.settle_s,
            max(p.height_m - x.touch_below_m, 0.0) / p.land_mps + x.touch_below_m / x.touch_mps,
        )

    def leg_s(self, metres: float, speed_mps: float = math.inf) -> float:
        """A straight leg from rest to rest, no faster than `speed_mps`, settled at its end."""
        return profile_s(metres, min(self.speed_mps, speed_mps), self.accel_mps2) + self.settle_s

    def climb_s(self, metres: float) -> float:
        """Up or down from one height to another, settled there."""
        return profile_s(abs(metres), self.climb_mps, self.climb_accel_mps2) + self.settle_s

    def turn_s(self, angle_rad: float) -> float:
        """A turn on the spot; settling is waited for even where nothing is to be turned."""
        return profile_s(abs(angle_rad), self.turn_rate_radps, self.turn_accel_radps2) + self.settle_s


@dataclass(frozen=True, slots=True)
class Travel:
    """The ways between `nodes`: (n, n) seconds without the turn before the first leg, infinite where no
    way leads, and the quarters of heading with which each way begins and ends."""

    nodes: tuple[str, ...]
    time_s: Seconds
    departs: Quarters
    arrives: Quarters


class Legs:
    """Times on one site at one pace."""

    def __init__(self, site: Site, policy: HeadingPolicy, pace: Pace) -> None:
        self.pace = pace
        self._site = site
        quarter = math.pi / 2
        turns = [pace.turn_s(min(k, 4 - k) * quarter) for k in range(4)]
        self.turn_s: Seconds = np.zeros((ANY_QUARTER + 1, ANY_QUARTER + 1))
        """Seconds of the turn from one quarter to another; nothing from or to ANY_QUARTER."""
        for a in range(4):
            for b in range(4):
                self.turn_s[a, b] = turns[(b - a) % 4]
        self._arcs = {
            (a, b): (metres, _quarter(site, a, b), to_quarter(leg_yaw(site, a, b, policy, 0.0)))
            for a in site.nodes
            for b in site.neighbours(a)
            for metres in (site.distance_m(a, b),)
        }

    def sweep(self) -> tuple[str, ...]:
        """Every node of the site that is not cut off, aisle by aisle."""
        return self._site.serpentine_route()

    def travel(self, nodes: Sequence[str]) -> Travel:
        """Times between all `nodes` (each once)."""
        n = len(nodes)
        time_s = np.full((n, n), math.inf)
        departs, arrives = np.zeros((n, n), np.int64), np.zeros((n, n), np.int64)
        column = {node: j for j, node in enumerate(nodes)}
        for i, node in enumerate(nodes):
            for j, (seconds, first, last) in self._from(node, column).items():
                time_s[i, j], departs[i, j], arrives[i, j] = seconds, first, last
        return Travel(tuple(nodes), time_s, departs, arrives)

    def way_s(self, start: str, goal: str, *, against_one_way: bool = False) -> float:
        """Time of the way from `start` to `goal`, the turn into it taken as a half turn.  NoWayError."""
        way = self._site.path(start, goal, against_one_way=against_one_way)
        if len(way) < 2:
            return 0.0
        seconds = self.pace.turn_s(math.pi)
        state = None
        for a, b in itertools.pairwise(way):
            state = self._step(state, a, b)
        assert state is not None
        return seconds + state[0] + self.pace.leg_s(state[1])

    def _step(
        self, state: tuple[float, float, int, int, int] | None, a: str, b: str
    ) -> tuple[float, float, int, int, int]:
        """(seconds until the present straight began, its metres so far, its direction, the first
        heading, the present heading) after the line a-b."""
        metres, direction, yaw = self._arcs[a, b]
        if state is None:
            return 0.0, metres, direction, yaw, yaw
        seconds, run_m, along, first, last = state
        if direction == along and yaw == last:
            return seconds, run_m + metres, direction, first, yaw
        corner_s = seconds + self.pace.leg_s(run_m) + self.turn_s.item(last, yaw)
        return corner_s, metres, direction, first, yaw

    def _from(self, start: str, column: dict[str, int]) -> dict[int, tuple[float, int, int]]:
        """(seconds, first quarter, last quarter) of the shortest way to each of the nodes in `column`."""
        found: dict[int, tuple[float, int, int]] = {}
        states: dict[str, tuple[float, float, int, int, int] | None] = {start: None}
        leg_s = self.pace.leg_s
        for node, before in self._site.reach(start).items():
            if node != start:
                states[node] = state = self._step(states[before], before, node)
                if node in column:
                    found[column[node]] = state[0] + leg_s(state[1]), state[3], state[4]
            elif node in column:
                found[column[node]] = 0.0, ANY_QUARTER, ANY_QUARTER
        return found


def to_quarter(yaw_rad: float) -> int:
    """The quarter turn nearest to a heading, 0..3."""
    return round(yaw_rad / (math.pi / 2)) % 4


def _quarter(site: Site, a: str, b: str) -> int:
    one, two = site.nodes[a], site.nodes[b]
    return to_quarter(math.atan2(two.y_m - one.y_m, two.x_m - one.x_m))


def check_reach(travel: Travel) -> None:
    """NoWayError when one of the nodes cannot be reached from another."""
    missing = np.argwhere(np.isinf(travel.time_s))
    if len(missing):
        i, j = missing[0]
        raise NoWayError(f"no open way from {travel.nodes[i]} to {travel.nodes[j]}")
