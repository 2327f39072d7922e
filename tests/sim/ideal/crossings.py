"""A bench for counting nodes: thousands of simulated crossings of a floor whose paint differs from its map.

The drone flies random routes from its pad.  Parts of the lines are gone, false ones were stuck down.  Gusts
push it about, its heading sways, its height changes, lines flicker and the camera is blind now and then.
What is seen, in pixels, goes the way that it goes in flight: the state estimator follows the lines, carries
itself on while none is seen, and tells where it is.  Only the judge knows the truth.

    python -m tests.sim.ideal.crossings 10000            # the whole bench: 40 CPU minutes or so
    python -m tests.sim.ideal.crossings 1000 --grid random --missing 0.05 --false 0.02 --from 251
"""

from __future__ import annotations

import argparse
import enum
import math
import random
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, fields, replace
from pathlib import Path

from flightd.config.schema import load_config
from flightd.core.geometry import wrap_pi
from flightd.core.tick import TickInput
from flightd.core.types import GridPose, Junction, JunctionKind, LineSet
from flightd.localisation.grid_localiser import GridLocaliser
from flightd.localisation.state_estimator import StateEstimator
from flightd.sim.plant.wind import WindParams
from flightd.sim.random_sites import random_site
from flightd.site.nearest_node import NodeIndex
from flightd.site.site import Site
from tests.sim.ideal.crossing_floors import uniform_grid, worn
from tests.sim.ideal.crossing_motion import STEP_S, Motion
from tests.sim.ideal.floor_points import FloorPoints
from tests.sim.ideal.ideal_sight import EyeErrors, IdealEye

CONFIG = load_config(Path(__file__).parents[3] / "configs" / "sim.toml")
SURE = CONFIG.mission.integrity_min
LEAST_AVAILABILITY = 0.9
_FRAME_STEPS = 4
"""A frame every 80 ms: what a small computer manages."""
_LATE_STEPS = 3
_TURN_RADPS = math.radians(CONFIG.mission.turn_rate_degps)
_ACCEL_MPS2 = 0.8
_SKEW_RAD = 0.1
_STRAIGHT = 0.7
"""How often it flies on straight where it can."""
_JUNCTION_SEEN = 0.85
_KINDS = {1: JunctionKind.END, 2: JunctionKind.CORNER, 3: JunctionKind.TEE, 4: JunctionKind.CROSS}
_WORDS = {int: "whole number", float: "number"}
_CHUNK = 40
"""So many crossings make a flight."""


class Grid(enum.StrEnum):
    """Sites to fly over."""

    UNIFORM = "uniform"
    RANDOM = "random"

    def site(self, seed: int) -> Site:
        return uniform_grid(seed) if self is Grid.UNIFORM else random_site(seed)


@dataclass(frozen=True, slots=True)
class Trouble:
    """What differs from the map and disturbs the flight."""

    missing: float = 0.2
    """Share of the lines' parts, cell by cell, that are gone."""
    false: float = 0.3
    """Lines in each cell that the map does not have."""
    gust_mps: float = WindParams().gust_rms_mps
    yaw_rad: float = math.radians(5.0)
    blind: float = 0.05
    """Share of the ways between nodes on which nothing at all is seen for up to a second."""
    bare: bool = False
    """The floor shows nothing but its lines that could be followed."""
    flicker: float = 0.04
    arms_wrong: float = 0.03


@dataclass(slots=True)
class Count:
    """Nodes flown over: at how many the drone was sure of its place, and at how many it was so and was wrong
    there or on the way there; and at how many it was wrong and in doubt."""

    crossings: int = 0
    undetected: int = 0
    doubted_wrong: int = 0
    sure: int = 0

    @property
    def availability(self) -> float:
        return self.sure / max(self.crossings, 1)

    @property
    def words(self) -> str:
        return (
            f"{self.crossings} crossings, {self.undetected} miscounted unnoticed, {self.doubted_wrong} wrong"
            f" in doubt, availability {self.availability:.3f}"
        )

    def add(self, other: Count) -> None:
        for one in fields(self):
            setattr(self, one.name, getattr(self, one.name) + getattr(other, one.name))


class Flight:
    """One flight along a random route; the estimator starts from `believed`, the truth from `start`."""

    def __init__(
        self,
        site: Site,
        seed: int,
        trouble: Trouble,
        *,
        start: str = "",
        believed: str = "",
        floor: Site | None = None,
    ) -> None:
        """`floor` has the paint as it is; None: it is worn as `trouble` says."""
        self.site = site
        self._rng = rng = random.Random(f"crossings {seed}")
        self._trouble = trouble
        self._here = start or site.home.node
        floor = floor or worn(site, trouble.missing, trouble.false, rng)
        camera = CONFIG.camera
        errors = EyeErrors(1.0, 0.002, trouble.flicker)
        self._eye = IdealEye(floor, camera.lens(), camera.mount(), errors, seed)
        self._points = None if trouble.bare else FloorPoints(seed)
        self._estimator = StateEstimator(site, CONFIG, SURE, (believed or self._here, 0.0))
        self._estimator.begin((believed or self._here, 0.0), armed=True)
        node = site.nodes[self._here]
        self._ref_m = node.x_m, node.y_m
        self._motion = Motion(rng, self._ref_m, trouble.gust_mps, trouble.yaw_rad)
        self._yaw_rad = 0.0
        self._nodes = NodeIndex(site)
        self._steps = 0
        self._blind_s = 0.0
        self._coming: LineSet | None = None
        self._attitudes = [self._motion.attitude]
        self._along = rng.random() < 0.5
        self._speed_mps = 0.0
        self._half_m = 0.5 * min(site.distance_m(edge.a, edge.b) for edge in site.edges)
        self._pose: GridPose | None = None
        self._before = ""
        self.astray = False
        """Was sure of a place that is another since the last node."""

    @property
    def node(self) -> str:
        """The node that the drone is really nearest to: it lags behind the point that it follows."""
        x_m, y_m = self._motion.at_m
        return self._nodes.node(x_m, y_m).id

    @property
    def pose(self) -> GridPose:
        """What the estimator said last."""
        assert self._pose is not None
        return self._pose

    @property
    def localiser(self) -> GridLocaliser:
        return self._estimator.localiser

    @property
    def wrong_and_sure(self) -> bool:
        return self.pose.node != self.node and self.pose.integrity >= SURE

    def hover(self, seconds: float) -> GridPose:
        """Stay over the node."""
        for _ in range(max(round(seconds / STEP_S), 1)):
            self._step((0.0, 0.0))
        return self.pose

    def fly(self, crossings: int, dwell_s: float = 1.0) -> Count:
        """Fly over so many nodes along a random route."""
        return self.follow(self._random_route(), crossings, dwell_s)

    def follow(self, route: Iterator[str], crossings: int, dwell_s: float = 1.0) -> Count:
        """Fly over so many nodes of a route, each a neighbour of the one before."""
        count, rng = Count(), self._rng
        self.hover(dwell_s)
        goal = next(route)
        while count.crossings < crossings:
            self.astray = False
            onward = next(route, self._here)
            turns = abs(wrap_pi(self._bearing(goal, onward) - self._bearing(self._here, goal))) > _SKEW_RAD
            stops = turns or rng.random() < 0.3
            self._leg(goal, stops=stops)
            if stops:
                self.hover(dwell_s)
            wrong, sure = self.pose.node != self.node, self.pose.integrity >= SURE
            count.crossings += 1
            count.sure += sure
            count.undetected += self.astray or (wrong and sure)
            count.doubted_wrong += wrong and not sure
            goal = onward
        return count

    def _random_route(self) -> Iterator[str]:
        """Straight on rather than not, and back only from a dead end."""
        before, node = self._before, self._here
        while True:
            onward = [way for way in self.site.neighbours(node) if way != before] or [before]
            if before and self._rng.random() < _STRAIGHT:
                came = self._bearing(before, node)
                ahead = [w for w in onward if abs(wrap_pi(self._bearing(node, w) - came)) < _SKEW_RAD]
                onward = ahead or onward
            before, node = node, self._rng.choice(onward)
            yield node

    def _bearing(self, start: str, end: str) -> float:
        a, b = self.site.nodes[start], self.site.nodes[end]
        return math.atan2(b.y_m - a.y_m, b.x_m - a.x_m)

    def _leg(self, goal: str, *, stops: bool) -> None:
        rng, a, b = self._rng, self.site.nodes[self._here], self.site.nodes[goal]
        bearing = self._bearing(self._here, goal)
        if self._along:
            self._turn_to(bearing)
        if rng.random() < self._trouble.blind:
            self._blind_s = rng.uniform(0.2, 1.0)
        c, s = math.cos(bearing), math.sin(bearing)
        length, most_mps, gone_m = self.site.distance_m(self._here, goal), rng.uniform(0.6, 1.2), 0.0
        while gone_m < length:
            braked = math.sqrt(2.0 * _ACCEL_MPS2 * (length - gone_m)) + 0.05 if stops else math.inf
            self._speed_mps = min(self._speed_mps + _ACCEL_MPS2 * STEP_S, most_mps, braked)
            gone_m = min(gone_m + self._speed_mps * STEP_S, length)
            self._ref_m = a.x_m + c * gone_m, a.y_m + s * gone_m
            self._step((c * self._speed_mps, s * self._speed_mps))
        self._before, self._here, self._ref_m = self._here, goal, (b.x_m, b.y_m)
        if stops:
            self._speed_mps = 0.0

    def _turn_to(self, yaw_rad: float) -> None:
        """Turn on the spot."""
        while (left := wrap_pi(yaw_rad - self._yaw_rad)) != 0.0:
            most = _TURN_RADPS * STEP_S
            self._yaw_rad = (
                yaw_rad if abs(left) < most else wrap_pi(self._yaw_rad + math.copysign(most, left))
            )
            self._step((0.0, 0.0))

    def _step(self, speed_mps: tuple[float, float]) -> None:
        motion = self._motion
        motion.step(self._ref_m, speed_mps, self._yaw_rad)
        self._attitudes.append(motion.attitude)
        self._blind_s -= STEP_S
        self._steps += 1
        if self._steps % _FRAME_STEPS == 0:
            self._coming = self._see()
        if self._coming is None or self._steps % _FRAME_STEPS != _LATE_STEPS:
            return
        tick = TickInput(
            motion.now_ns, (self._coming,), motion.told(self._attitudes[-1]), tuple(self._attitudes)
        )
        self._attitudes.clear()
        self._estimator.take(tick, None)
        told = self._estimator.step(motion.now_ns)
        self._pose = told.pose
        if self._pose is not None:
            off_m = math.dist(motion.at_m, (self._pose.x_m, self._pose.y_m))
            self.astray |= off_m > self._half_m and self._pose.integrity >= SURE

    def _see(self) -> LineSet:
        """What a detector would tell of a picture taken now."""
        rng, seen = self._rng, self._eye.see(self._motion.kinematics, self._steps, self._motion.now_ns)
        points = self._points
        if self._blind_s > 0.0:
            if points is not None:
                points.lose()
            return replace(seen, lines=(), junctions=(), pads=())
        if points is not None:
            seen = replace(seen, features=points.see(self._eye.view(self._motion.kinematics)))
        told = (self._mistaken(one) for one in seen.junctions if rng.random() < _JUNCTION_SEEN)
        return replace(seen, junctions=tuple(one for one in told if one is not None))

    def _mistaken(self, junction: Junction) -> Junction | None:
        """The junction, now and then with an arm too many or too few."""
        if self._rng.random() >= self._trouble.arms_wrong:
            return junction
        other = junction.arms_rad[0] + self._rng.randrange(4) * math.pi / 2
        arms = tuple(arm for arm in junction.arms_rad if abs(wrap_pi(arm - other)) > math.pi / 4)
        if len(arms) == len(junction.arms_rad):
            arms = *arms, wrap_pi(other)
        return replace(junction, kind=_KINDS[len(arms)], arms_rad=arms) if arms else None


def bench(
    crossings: int,
    grid: Grid = Grid.UNIFORM,
    trouble: Trouble | None = None,
    first_seed: int = 1,
    told: Callable[[int, Count], None] = lambda _seed, _count: None,
) -> Count:
    """Fly over so many nodes, on a new site with each flight; `told` hears of each flight."""
    total = Count()
    seed = first_seed
    while total.crossings < crossings:
        flight = Flight(grid.site(seed), seed, trouble or Trouble())
        count = flight.fly(min(_CHUNK, crossings - total.crossings))
        told(seed, count)
        total.add(count)
        seed += 1
    return total


def _number(least: float, most: float, kind: type[int | float] = float) -> Callable[[str], float]:
    def parsed(text: str) -> float:
        with suppress(ValueError):
            if least <= kind(text) <= most:
                return kind(text)
        raise argparse.ArgumentTypeError(f"{text!r} is no {_WORDS[kind]} from {least:.8g} to {most:.8g}")

    return parsed


def main(arguments: Sequence[str]) -> int:
    """Exit 0 where no node was miscounted unnoticed and enough were told surely."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("crossings", type=_number(1, 10_000_000, int), nargs="?", default=10_000)
    parser.add_argument("--grid", choices=[grid.value for grid in Grid], default=Grid.UNIFORM.value)
    usual = Trouble()
    share, lines = _number(0.0, 1.0), _number(0.0, 5.0)
    parser.add_argument("--missing", type=share, default=usual.missing, help="share of the lines' parts")
    parser.add_argument("--false", type=lines, default=usual.false, help="lines in each cell")
    parser.add_argument("--blind", type=share, default=usual.blind, help="share of the ways between nodes")
    parser.add_argument("--gusts", type=_number(0.0, 10.0), default=1.0, help="times the usual ones")
    parser.add_argument("--bare", action="store_true", help="a floor that shows nothing but its lines")
    parser.add_argument("--from", dest="first", type=_number(0, 10**9, int), default=1, help="first seed")
    given = parser.parse_args(arguments)

    def told(seed: int, count: Count) -> None:
        print(f"seed {seed}: {count.words}", flush=True)

    trouble = Trouble(
        given.missing, given.false, gust_mps=given.gusts * usual.gust_mps, blind=given.blind, bare=given.bare
    )
    total = bench(given.crossings, Grid(given.grid), trouble, given.first, told)
    print(f"in all: {total.words}")
    return 0 if total.undetected == 0 and total.availability >= LEAST_AVAILABILITY else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
