"""Flying past the shelves of an aisle: which levels at once, from which end to which, how fast.  Pure."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

from flightd.core.geometry import wrap_pi
from flightd.core.scanning import BodyPose
from flightd.mission.plan.itinerary import in_best_order
from flightd.mission.plan.leg_times import Pace, profile_s
from flightd.mission.plan.sweep_leg import SweepLeg
from flightd.mission.scan.code_assignment import Assigner
from flightd.mission.scan.sweep_speed import Shelf, StopCause, SweepOptics, SweepSpeed, sweep_speed
from flightd.mission.scan.views import View, ViewPlanner, up_and_down
from flightd.site.coverage import Legibility
from flightd.site.site import Location, Side, Site
from flightd.site.ways import NoWayError

_WHOLE_SHARE = 0.9
"""Levels are flown past together only where each place of them is so far in the picture."""
_APART_M = 0.05
"""Lanes that are nearer to each other in height show the same: all is flown past at once."""
_LEADS_OUT = 2
"""So many nodes beyond what is counted a way is flown on to leave the aisle: farther may be for nothing."""
_LEAST_NODES = 2
"""Places before fewer nodes are sooner counted by stopping."""


@dataclass(frozen=True, slots=True)
class Lane:
    """The levels of one side of an aisle that are flown past at once, from their height: `places` on them by
    the node that faces each.  `legibility` is that of their labels where the drone stops before them."""

    aisle: str
    side: Side
    levels: tuple[int, ...]
    height_m: float
    yaw_rad: float
    distance_m: float
    speed: SweepSpeed
    places: tuple[Location, ...]
    legibility: Legibility


@dataclass(frozen=True, slots=True)
class _Way:
    """Past a lane from one node of its aisle to another, by their places along it."""

    lane: Lane
    start: int
    target: int

    def passed(self, nodes: Sequence[str]) -> tuple[str, ...]:
        """The nodes that it leads over."""
        step = 1 if self.target > self.start else -1
        return tuple(nodes[i] for i in range(self.start, self.target + step, step))


@dataclass(frozen=True, slots=True)
class JudgedLane:
    """A lane, and why it is not flown past; None: it is."""

    lane: Lane
    stops_for: StopCause | None


class SweepPlanner:
    """The legs past the shelves of one aisle after the other."""

    def __init__(self, site: Site, views: ViewPlanner, assigner: Assigner, optics: SweepOptics) -> None:
        self._site = site
        self._views = views
        self._assigner = assigner
        self._optics = optics

    @property
    def sharp_mps(self) -> float:
        """The speed at which a picture of the usual exposure is blurred by as much as it may be."""
        return self._optics.view.speed_limit_mps()

    def lanes(self, aisle: str, wanted: Iterable[str]) -> list[Lane]:
        """What is flown past in an aisle to see the `wanted` locations, side by side and from the lowest
        level up; also what cannot be, with why."""
        here = [place for code in wanted if (place := self._site.locations[code]).aisle == aisle]
        found = []
        for side in Side:
            places = sorted((place for place in here if place.side is side), key=_by_height)
            if places:
                found += self._on_side(places)
        return found

    def legs(
        self, run: Sequence[str], wanted: frozenset[str], here: str, yaw_rad: float, height_m: float
    ) -> tuple[SweepLeg, ...]:
        """The legs over the nodes `run` of one aisle for a drone over its node `here`, from end to end, up
        one side and down the other; none where all is sooner counted by stopping, or may only be so."""
        nodes = self._nodes(here)
        ways = self._ways(nodes, self._lanes_at(run, wanted, here), here, yaw_rad, height_m)
        flown = [nodes.index(node) for node in run]
        for end in (min(flown), max(flown)):
            self._lead_over(nodes, ways, end)
        self._lead_out(nodes, ways)
        legs = [_leg(way.lane, way.passed(nodes)) for way in ways]
        return (*legs[:-1], replace(legs[-1], last=True)) if legs else ()

    def stop_by_stop(
        self, run: Sequence[str], wanted: frozenset[str], yaw_rad: float, height_m: float
    ) -> Iterator[tuple[SweepLeg, ...]]:
        """What `legs` answers a drone that visits the nodes `run` of one aisle in this order and asks at each
        stop anew, as a flight does: what could not be flown past from one may be from the next."""
        nodes, left, rest = self._nodes(run[0]), wanted, list(run)
        while rest:
            lanes = self._lanes_at(rest, left, rest[0])
            near = self._open_ends(nodes, [one for one in lanes if self._hindrance(nodes, one) is None])
            if not near:
                return
            # from a node that no open line of theirs touches all is closed: nobody need ask there
            skipped = list(itertools.takewhile(lambda node: node not in near, rest))  # noqa: B023
            rest = rest[len(skipped) :]
            if not rest:
                return
            here = rest[0]
            left -= {code for code in left if self._node(code) in set(skipped)}
            legs = self.legs(rest, left, here, yaw_rad, height_m)
            passed = {code for leg in legs for code in leg.locations}
            if legs:
                yield legs
                here = legs[-1].end
            left -= passed or {code for code in left if self._node(code) == here}
            rest = [node for node in rest if any(self._node(code) == node for code in left)]
            if legs and rest:
                rest = list(in_best_order(self._site, here, rest, (), self._site.home.node)[0])

    def judged(
        self, run: Sequence[str], wanted: frozenset[str], yaw_rad: float, height_m: float
    ) -> list[JudgedLane]:
        """All lanes past what is wanted at the nodes `run`, in the order of `lanes`, and which of them are
        flown past from stop to stop: of a lane that is so beyond its first nodes only, each part."""
        nodes = self._nodes(run[0])
        judged = []
        legs = [leg for flown in self.stop_by_stop(run, wanted, yaw_rad, height_m) for leg in flown]
        passed = {code for leg in legs for code in leg.locations}
        for lane in self._lanes_at(run, wanted, run[0]):
            flown = tuple(place for place in lane.places if place.code in passed)
            stopped = tuple(place for place in lane.places if place.code not in passed)
            why = self._hindrance(nodes, lane) or StopCause.LINE
            parts = (flown, None), (stopped, why)
            judged += [JudgedLane(replace(lane, places=part), cause) for part, cause in parts if part]
        return judged

    def _open_ends(self, nodes: Sequence[str], lanes: Sequence[Lane]) -> set[str]:
        """The nodes from which the line to a neighbour is open for one of the lanes."""
        links = range(len(nodes) - 1)
        open_from = {at for at in links if any(self._is_open(nodes, at, at + 1, lane) for lane in lanes)}
        return {node for at in open_from for node in nodes[at : at + 2]}

    def _node(self, code: str) -> str:
        return self._site.locations[code].node

    def _nodes(self, here: str) -> list[str]:
        """Those of the aisle of a node, along it."""
        return [node.id for node in self._site.aisle_nodes(self._site.nodes[here].aisle)]

    def _lanes_at(self, run: Sequence[str], wanted: frozenset[str], here: str) -> list[Lane]:
        """Past what is wanted at the nodes `run`."""
        counted = [code for code in wanted if self._node(code) in set(run)]
        return self.lanes(self._site.nodes[here].aisle, counted)

    def _ways(
        self, nodes: Sequence[str], lanes: Sequence[Lane], here: str, yaw_rad: float, height_m: float
    ) -> list[_Way]:
        """Past those of the lanes that can be flown past, joined, from the node `here`."""
        ways: list[_Way] = []
        at = nodes.index(here)
        passed = [lane for lane in lanes if self._hindrance(nodes, lane) is None]
        for lane in _ordered(passed, yaw_rad, height_m):
            low, high = _reach(nodes, lane)
            if not self._is_open(nodes, min(low, at), max(high, at), lane):
                continue
            near, far = (low, high) if abs(low - at) <= abs(high - at) else (high, low)
            if low < at < high and self._leads_on(nodes, ways, near):
                ways[-1] = replace(ways[-1], target=near)
                at = near
            for target in (near, far) if low < at < high else (far,):
                ways.append(_Way(lane, at, target))
                at = target
        return ways

    def _hindrance(self, nodes: Sequence[str], lane: Lane) -> StopCause | None:
        """What keeps a lane from being flown past, wherever the drone is; None: nothing."""
        low, high = _reach(nodes, lane)
        if lane.speed.stops_for is None and high - low + 1 < _LEAST_NODES:
            return StopCause.NODES
        return lane.speed.stops_for

    def _lead_over(self, nodes: Sequence[str], ways: list[_Way], end: int) -> None:
        """Fly one of the ways on over this node, beyond what is counted, sooner than visit it afterwards: the
        last way where that ends there, and so need not come back."""
        ends = [index for way in ways for index in (way.start, way.target)]
        if not ends or min(ends) <= end <= max(ends):
            return
        outermost = max(ends) if end > max(ends) else min(ends)
        turning = [k for k, way in enumerate(ways) if way.target == outermost]
        if not turning:
            return
        k = turning[-1] if turning[-1] == len(ways) - 1 else turning[0]
        flown = ways[k : k + 2]
        low, high = min(end, outermost), max(end, outermost)
        if all(self._is_open(nodes, low, high, way.lane) for way in flown):
            ways[k : k + 2] = [
                replace(flown[0], target=end),
                *(replace(way, start=end) for way in flown[1:]),
            ]

    def _lead_out(self, nodes: Sequence[str], ways: list[_Way]) -> None:
        """Fly the last way on to the next node from which the aisle is left: any way on leads there, unless
        something was left open."""
        if not ways:
            return
        step = 1 if ways[-1].target > ways[-1].start else -1
        ahead = range(ways[-1].target, len(nodes) if step > 0 else -1, step)
        exits = (index for index in ahead[: _LEADS_OUT + 1] if self._is_exit(nodes[index]))
        target = next(exits, ways[-1].target)
        if self._leads_on(nodes, ways, target):
            ways[-1] = replace(ways[-1], target=target)

    def _is_exit(self, node: str) -> bool:
        nodes = self._site.nodes
        return any(nodes[other].aisle != nodes[node].aisle for other in self._site.neighbours(node))

    def _leads_on(self, nodes: Sequence[str], ways: Sequence[_Way], target: int) -> bool:
        """Whether the last way may be flown on to there without stopping."""
        if not ways or target == ways[-1].target:
            return False
        last = ways[-1]
        low, high = min(last.target, target), max(last.target, target)
        onwards = (target > last.target) == (last.target > last.start)
        return onwards and self._is_open(nodes, low, high, last.lane)

    def seconds(self, legs: Sequence[SweepLeg], pace: Pace, yaw_rad: float) -> float:
        """How long the legs take, from the flying height and `yaw_rad` on."""
        total, height_m = 0.0, pace.height_m
        for leg in legs:
            turn_s = pace.turn_s(abs(wrap_pi(leg.yaw_rad - yaw_rad)))
            total += max(pace.climb_s(leg.height_m - height_m), turn_s)
            length_m = self._site.distance_m(leg.nodes[0], leg.end)
            total += profile_s(length_m, leg.speed_mps, pace.accel_mps2) + pace.settle_s
            yaw_rad, height_m = leg.yaw_rad, leg.height_m
        return total

    def _on_side(self, places: Sequence[Location]) -> list[Lane]:
        """The lanes of one side: levels whose places are in one picture share a lane."""
        samples = {place.level: place for place in places}
        at = self._site.nodes[places[0].node]
        views: list[View] = []
        for view in self._views.column(at.id, list(samples.values())):
            whole = len(view.locations) == 1 or self._shows(view)
            singles = [[self._site.locations[code]] for code in view.locations]
            views += [view] if whole else [v for one in singles for v in self._views.column(at.id, one)]
        lanes = []
        for view in _merged(views):
            levels = tuple(self._site.locations[code].level for code in view.locations)
            on = tuple(place for place in places if place.level in levels)
            distance_m = abs(on[0].y_m - at.y_m)
            cells = (self._assigner.cells[place.code] for place in on)
            legibility = self._optics.view.legibility(self._views.nearest_m(distance_m))
            shelf = Shelf(distance_m, max(cell.x1_m - cell.x0_m for cell in cells))
            lanes.append(
                Lane(
                    at.aisle, on[0].side, levels, view.height_m, view.yaw_rad, distance_m,
                    sweep_speed(shelf, self._optics), on, legibility,
                )
            )  # fmt: skip
        return lanes

    def _shows(self, view: View) -> bool:
        """Whether the places of a view are wholly in the picture, each from before itself."""
        return all(self.share(code, view.height_m, view.yaw_rad) >= _WHOLE_SHARE for code in view.locations)

    def share(self, code: str, height_m: float, yaw_rad: float) -> float:
        """The most of a location that is in the picture of a drone on its aisle's line at that height."""
        place = self._site.locations[code]
        y_m = self._site.nodes[place.node].y_m
        pose = BodyPose(0, place.x_m, y_m, height_m, 0.0, 0.0, yaw_rad, 0.0, 0.0, 0.0, True)
        return next((seen.share for seen in self._assigner.places(pose, (code,))), 0.0)

    def _is_open(self, nodes: Sequence[str], low: int, high: int, lane: Lane) -> bool:
        """Whether the line is open both ways, and clear at the lane's height."""
        site = self._site
        try:
            straight = all(
                site.path(a, b) == (a, b) and site.path(b, a) == (b, a)
                for a, b in itertools.pairwise(nodes[low : high + 1])
            )
        except NoWayError:
            return False
        one, other = site.nodes[nodes[low]], site.nodes[nodes[high]]
        h = lane.height_m
        return straight and site.is_clear((one.x_m, one.y_m, h), (other.x_m, other.y_m, h))


def _reach(nodes: Sequence[str], lane: Lane) -> tuple[int, int]:
    """The first and the last of the nodes that face its places."""
    faced = [nodes.index(place.node) for place in lane.places]
    return min(faced), max(faced)


def _merged(views: Sequence[View]) -> list[View]:
    """Those of one column, from the lowest up, that are looked at from one height taken as one: limits of the
    height may leave different levels the same."""
    merged: list[View] = []
    for view in views:
        below = merged[-1] if merged else None
        if below is not None and abs(view.height_m - below.height_m) < _APART_M:
            merged[-1] = replace(below, locations=below.locations + view.locations)
        else:
            merged.append(view)
    return merged


def _ordered(lanes: Sequence[Lane], yaw_rad: float, height_m: float) -> list[Lane]:
    """Up one side, down the other: the least turning and climbing."""
    sides = sorted(
        {lane.side: lane.yaw_rad for lane in lanes}.items(), key=lambda item: abs(wrap_pi(item[1] - yaw_rad))
    )
    return up_and_down(([lane for lane in lanes if lane.side is side] for side, _ in sides), height_m)


def _leg(lane: Lane, nodes: tuple[str, ...]) -> SweepLeg:
    return SweepLeg(
        lane.aisle,
        lane.side,
        lane.levels,
        nodes,
        tuple(place.code for place in lane.places),
        lane.height_m,
        lane.yaw_rad,
        lane.speed.speed_mps,
        lane.speed.exposure,
    )


def _by_height(place: Location) -> tuple[float, float]:
    return place.height_m, place.x_m
