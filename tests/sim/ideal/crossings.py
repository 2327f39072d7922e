"""A bench for counting nodes: thousands of simulated crossings, at the level of tracked lines.

The drone flies random routes on a floor whose paint differs from the map: cross lines are missing, false
ones were stuck down.  Gusts push it about, its heading sways, its height changes, lines flicker and the
camera is blind now and then.  Only what the line tracker tells reaches the localiser; the truth judges
what it says at each node flown over.

    python -m tests.sim.ideal.crossings 10000      # the whole bench: two minutes or so
"""

from __future__ import annotations

import math
import random
import sys
from dataclasses import dataclass, replace

from flightd.config.localisation import LocalisationConfig
from flightd.core.camera_view import FloorReach
from flightd.core.tracks import FloorJunction, TrackedLine, TrackSet
from flightd.core.types import GridPose
from flightd.localisation.grid_localiser import GridLocaliser
from flightd.sim.random_sites import random_site
from flightd.site.painted_lines import PaintMap
from flightd.site.site import PaintedLine, Site

STEP_S = 0.06
SURE = 0.95
_HALF_LONG, _HALF_SHORT = 0.80, 0.44
"""Half the picture's sides at unit height, a little inside 80 deg x 50 deg."""


@dataclass(frozen=True, slots=True)
class Trouble:
    """What differs from the map and disturbs the flight: shares per cross line or node, metres, radians."""

    missing: float = 0.05
    false: float = 0.02
    gust_m: float = 0.06
    yaw_rad: float = math.radians(5.0)
    heading_error_rad: float = math.radians(0.4)
    offset_m: float = 0.008
    velocity_mps: float = 0.04
    blind: float = 0.02
    flicker: float = 0.04
    arms_wrong: float = 0.03


@dataclass(slots=True)
class Count:
    """Nodes flown over, and how often the node told was wrong: while sure of it, and while in doubt."""

    crossings: int = 0
    undetected: int = 0
    doubted_wrong: int = 0
    sure: int = 0

    @property
    def availability(self) -> float:
        return self.sure / max(self.crossings, 1)

    def add(self, other: Count) -> None:
        self.crossings += other.crossings
        self.undetected += other.undetected
        self.doubted_wrong += other.doubted_wrong
        self.sure += other.sure


def worn(site: Site, trouble: Trouble, rng: random.Random) -> Site:
    """The floor as it really is: paint of the site less some cross lines, with some false ones."""
    lines = [p for p in site.lines if p.x0_m != p.x1_m or rng.random() >= trouble.missing]
    for aisle in site.aisles:
        for _ in range(aisle.size):
            if rng.random() < trouble.false:
                x = rng.uniform(aisle.x_m, aisle.end_x_m)
                reach = rng.uniform(0.2, 0.6)
                if min(abs(x - p.x0_m) for p in site.lines if p.x0_m == p.x1_m) > 0.15:
                    lines.append(PaintedLine(x, aisle.y_m - reach, x, aisle.y_m + reach, site.line_width_m))
    return replace(site, lines=tuple(lines))


class Flight:
    """One flight along a random route; the localiser starts from `believed`, the truth from `start`."""

    def __init__(
        self,
        site: Site,
        seed: int,
        trouble: Trouble,
        *,
        start: str = "",
        believed: str = "",
        config: LocalisationConfig | None = None,
    ) -> None:
        self.site = site
        self._rng = random.Random(f"crossings {seed}")
        self._trouble = trouble
        floor = worn(site, trouble, self._rng)
        self._lines = floor.lines
        paint = PaintMap.of(floor)
        self._features = [
            (float(x), float(y), int(arms))
            for features in (paint.crossings, paint.ends)
            for (x, y), arms in zip(features.at_m, features.arms, strict=True)
        ]
        self._here = start or self._rng.choice(sorted(site.nodes))
        self.localiser = GridLocaliser(
            site, believed or self._here, FloorReach(), config or LocalisationConfig()
        )
        node = site.nodes[self._here]
        self._x, self._y = node.x_m, node.y_m
        self._gust = [0.0, 0.0]
        self._sway = self._heading_error = 0.0
        self._height = self._rng.uniform(1.2, 2.4)
        self._yaw = 0.0
        self._now_ns = 10**9
        self._blind_s = 0.0
        self._tracks: dict[int, tuple[int, int, int]] = {}
        self._next_id = 0
        self._before = ""

    @property
    def node(self) -> str:
        """The node that the drone is really at."""
        return self._here

    @property
    def pose(self) -> GridPose:
        """What the localiser said last."""
        return self._pose

    @property
    def wrong_and_sure(self) -> bool:
        return self._pose.node != self._here and self._pose.integrity >= SURE

    def hover(self, seconds: float) -> GridPose:
        """Stay over the node."""
        node = self.site.nodes[self._here]
        for _ in range(max(round(seconds / STEP_S), 1)):
            self._step(node.x_m, node.y_m)
        return self._pose

    def fly(self, crossings: int, dwell_s: float = 1.0) -> Count:
        """Fly over so many nodes."""
        count = Count()
        self.hover(dwell_s)
        while count.crossings < crossings:
            self._leg(self._choose())
            node = self._here
            if self._rng.random() < 0.3:
                self.hover(dwell_s)
            pose = self._pose
            wrong = pose.node != node
            sure = pose.integrity >= SURE
            count.crossings += 1
            count.sure += sure
            count.undetected += wrong and sure
            count.doubted_wrong += wrong and not sure
        return count

    def _choose(self) -> str:
        ways = self.site.neighbours(self._here)
        ways = tuple(way for way in ways if self._painted(way))
        onward = [way for way in ways if way != self._before] or list(ways)
        self._before = self._here
        return self._rng.choice(onward)

    def _painted(self, goal: str) -> bool:
        """The line to this neighbour is there: without it nobody flies it."""
        a, b = self.site.nodes[self._here], self.site.nodes[goal]
        if a.aisle == b.aisle:
            return True
        low, high = sorted((a.y_m, b.y_m))
        return any(
            p.x0_m == p.x1_m
            and abs(p.x0_m - a.x_m) < 0.02
            and min(p.y0_m, p.y1_m) <= low
            and high <= max(p.y0_m, p.y1_m)
            for p in self._lines
        )

    def _leg(self, goal: str) -> None:
        a, b = self.site.nodes[self._here], self.site.nodes[goal]
        length = math.hypot(b.x_m - a.x_m, b.y_m - a.y_m)
        speed = self._rng.uniform(0.6, 1.2)
        self._yaw = math.atan2(b.y_m - a.y_m, b.x_m - a.x_m)
        if self._rng.random() < self._trouble.blind:
            self._blind_s = self._rng.uniform(0.2, 1.0)
        steps = max(round(length / (speed * STEP_S)), 1)
        for i in range(1, steps + 1):
            share = i / steps
            self._step(a.x_m + share * (b.x_m - a.x_m), a.y_m + share * (b.y_m - a.y_m))
        self._here = goal

    def _step(self, x_m: float, y_m: float) -> None:
        rng, t = self._rng, self._trouble
        keep = math.exp(-STEP_S / 1.0)
        stir = math.sqrt(1.0 - keep * keep)
        self._gust = [keep * g + stir * rng.gauss(0.0, t.gust_m) for g in self._gust]
        self._sway = max(
            -t.yaw_rad, min(t.yaw_rad, keep * self._sway + stir * rng.gauss(0.0, t.yaw_rad / 1.5))
        )
        self._heading_error = keep * self._heading_error + stir * rng.gauss(0.0, t.heading_error_rad)
        self._height = min(max(self._height + rng.gauss(0.0, 0.02), 1.0), 3.0)
        x, y = x_m + self._gust[0], y_m + self._gust[1]
        vx, vy = (x - self._x) / STEP_S, (y - self._y) / STEP_S
        self._x, self._y = x, y
        self._now_ns += round(STEP_S * 1e9)
        self._blind_s -= STEP_S
        self._pose = self.localiser.step(self._seen(vx, vy), self._height)

    def _seen(self, vx: float, vy: float) -> TrackSet:
        """What the line tracker would tell now."""
        rng, t = self._rng, self._trouble
        across: tuple[list[TrackedLine], list[TrackedLine]] = ([], [])
        junctions: list[FloorJunction] = []
        if self._blind_s <= 0.0:
            for index, line in enumerate(self._lines):
                visible = self._clip(line)
                if visible is not None and rng.random() >= t.flicker:
                    id_, hits, _ = self._tracks.get(index, (self._next_id, 0, 0))
                    self._next_id += id_ == self._next_id
                    self._tracks[index] = (id_, hits + 2, self._now_ns)
            for x, y, arms in self._features:
                dx, dy = x - self._x, y - self._y
                if self._inside(dx, dy, 0.92) and rng.random() < 0.85:
                    flip = 1 << rng.randrange(4) if rng.random() < t.arms_wrong else 0
                    if arms ^ flip:
                        junctions.append(
                            FloorJunction(dx + rng.gauss(0, 0.015), dy + rng.gauss(0, 0.015), arms ^ flip)
                        )
        for index, (id_, hits, seen_ns) in list(self._tracks.items()):
            line = self._lines[index]
            visible = self._clip(line)
            if visible is None or self._now_ns - seen_ns > 2_000_000_000:
                del self._tracks[index]
                continue
            axis = 0 if line.x0_m == line.x1_m else 1
            offset = line.x0_m - self._x if axis == 0 else line.y0_m - self._y
            middle = 0.5 * (visible[0] + visible[1])
            offset += rng.gauss(0.0, t.offset_m) + self._heading_error * middle
            sigma = math.hypot(t.offset_m, 0.01 * middle) + 0.004
            across[axis].append(
                TrackedLine(id_, offset, sigma, line.width_m, seen_ns, hits, visible[0], visible[1])
            )
        return TrackSet(
            self._now_ns,
            self._now_ns,
            self._yaw + self._sway,
            0.01,
            vx + rng.gauss(0.0, t.velocity_mps),
            vy + rng.gauss(0.0, t.velocity_mps),
            0.0,
            0.0,
            tuple(across[0]),
            tuple(across[1]),
            junctions=tuple(junctions),
            junctions_ns=self._now_ns,
        )

    def _inside(self, dx: float, dy: float, share: float) -> bool:
        c, s = math.cos(self._yaw + self._sway), math.sin(self._yaw + self._sway)
        return (
            abs(c * dx + s * dy) < share * _HALF_LONG * self._height
            and abs(c * dy - s * dx) < share * _HALF_SHORT * self._height
        )

    def _clip(self, line: PaintedLine) -> tuple[float, float] | None:
        """The part of the line in the picture, along it from the drone (Liang-Barsky), if it is 0.15 m."""
        x0, y0 = line.x0_m - self._x, line.y0_m - self._y
        dx, dy = line.x1_m - line.x0_m, line.y1_m - line.y0_m
        reach = 0.92 * self._height
        if (abs(x0) > reach) if dx == 0.0 else (abs(y0) > reach):
            return None
        c, s = math.cos(self._yaw + self._sway), math.sin(self._yaw + self._sway)
        low, high = 0.0, 1.0
        for start, way, half in (
            (c * x0 + s * y0, c * dx + s * dy, _HALF_LONG * self._height),
            (c * y0 - s * x0, c * dy - s * dx, _HALF_SHORT * self._height),
        ):
            if abs(way) < 1e-9:
                if abs(start) > half:
                    return None
                continue
            a, b = sorted(((-half - start) / way, (half - start) / way))
            low, high = max(low, a), min(high, b)
        length = math.hypot(dx, dy)
        if (high - low) * length < 0.15:
            return None
        origin, way = (y0, dy) if dx == 0.0 else (x0, dx)
        ends = sorted((origin + low * way, origin + high * way))
        return ends[0], ends[1]


def bench(crossings: int, trouble: Trouble | None = None, per_flight: int = 40, first_seed: int = 1) -> Count:
    """Fly over at least so many nodes on random sites, a new one for each flight."""
    total = Count()
    seed = first_seed
    while total.crossings < crossings:
        flight = Flight(random_site(seed), seed, trouble or Trouble())
        total.add(flight.fly(min(per_flight, crossings - total.crossings)))
        seed += 1
    return total


if __name__ == "__main__":
    counted = bench(int(sys.argv[1]) if len(sys.argv) > 1 else 10_000)
    print(counted, f"availability {counted.availability:.4f}")
