"""From where the locations of a node are looked at: which way, how high, how near."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Protocol, TypeVar

import numpy as np

from flightd.config.scan import ScanConfig
from flightd.core.camera_view import ForwardMount
from flightd.core.geometry import wrap_pi
from flightd.core.scanning import BodyPose, Light
from flightd.mission.plan.leg_times import Pace
from flightd.mission.scan.code_assignment import Assigner, FrontSight
from flightd.mission.scan.legibility import nearest_look_m
from flightd.site.shelf_cells import by_node
from flightd.site.site import Location, Side, Site


@dataclass(frozen=True, slots=True)
class View:
    """A place to look from.  `yaw_rad` is the drone's heading; `retake` counts the places before, `exposure`
    is a part of the front camera's usual one."""

    node: str
    aisle: str
    side: Side
    x_m: float
    y_m: float
    height_m: float
    yaw_rad: float
    locations: tuple[str, ...]
    retake: int = 0
    exposure: float = 1.0


class AtHeight(Protocol):
    """What is looked at from a height above the floor, m."""

    @property
    def height_m(self) -> float: ...


_T = TypeVar("_T", bound=AtHeight)


def up_and_down(columns: Iterable[list[_T]], height_m: float) -> list[_T]:
    """One column after the other from `height_m` on, each from that end which is nearer in height."""
    ordered: list[_T] = []
    for column in columns:
        if column and abs(column[-1].height_m - height_m) < abs(column[0].height_m - height_m):
            column.reverse()
        ordered += column
        height_m = column[-1].height_m if column else height_m
    return ordered


class ViewPlanner:
    """The views of each node of a site, and where to look from again.

    Nothing is looked at from above `highest_m`, nor from farther along the aisle than `aside_per_height` of
    the height: the node's own lines must stay in the down camera's picture."""

    def __init__(
        self,
        site: Site,
        sight: FrontSight,
        assigner: Assigner,
        params: ScanConfig,
        highest_m: float = math.inf,
        aside_per_height: float = 0.35,
    ) -> None:
        self._site = site
        self._sight = sight
        self._assigner = assigner
        self._params = params
        self._highest_m = params.highest_m(highest_m)
        self._aside_per_height = aside_per_height
        self._by_node = by_node(site.locations.values())

    def locations(self, node: str) -> tuple[str, ...]:
        """The codes of all locations that are counted from a node."""
        return tuple(location.code for location in self._by_node.get(node, ()))

    def nearest_m(self, distance_m: float) -> float:
        """How near to a shelf at that distance from the aisle's line it is looked at from."""
        return nearest_look_m(distance_m, self._params)

    def views(self, node: str, wanted: frozenset[str], height_m: float, yaw_rad: float) -> list[View]:
        """The views of the `wanted` locations of a node, in the order of least turning and climbing for a
        drone that hovers there at `height_m`, heading `yaw_rad`: up one side, down the other."""
        here = [location for location in self._by_node.get(node, ()) if location.code in wanted]
        sides = sorted(
            {location.side for location in here}, key=lambda side: abs(wrap_pi(self._yaw(side) - yaw_rad))
        )
        columns = (self.column(node, [one for one in here if one.side is side]) for side in sides)
        return up_and_down(columns, height_m)

    def relit(self, view: View, left: Mapping[str, Light]) -> View | None:
        """The same place with another exposure, if something of what is `left` comes out so dark or so light
        that its code may be lost; None if nothing does, or the exposure cannot be another."""
        p = self._params
        for light, part in ((Light.DIM, p.expert.brighter), (Light.BURNT, p.expert.darker)):
            exposure = min(max(view.exposure * part, p.expert.darker), p.expert.brighter)
            if light in left.values() and exposure != view.exposure:
                return replace(view, locations=tuple(left), exposure=exposure)
        return None

    def retake(self, view: View, left: Sequence[str]) -> View | None:
        """Another place to look at what is `left` of a view, None after the last: nearer and squarely in
        front of what is left on one hand, then of the other; where there is only one, from a little
        farther and aside, where reflections fall otherwise.  Where a keep-out is near, only as far as that
        leaves room."""
        places = (self._aside(view, left, number) for number in range(view.retake, self._params.retakes))
        return next((again for again in places if again is not None), None) if left else None

    def _aside(self, view: View, left: Sequence[str], number: int) -> View | None:
        """The re-take of that number, None where there is no room for it."""
        p = self._params
        node = self._site.nodes[view.node]
        hands = _hands([self._site.locations[code] for code in left], node.x_m)
        places = hands[number % len(hands)]
        middle_m = math.fsum(place.x_m for place in places) / len(places)
        label_m = math.fsum(place.height_m for place in places) / len(places)
        shelf_m = places[0].y_m
        towards = math.copysign(1.0, shelf_m - node.y_m)
        distance_m = abs(shelf_m - node.y_m)
        near = number < len(hands)
        step_m = distance_m - nearest_look_m(distance_m, p) if near else -p.step_m / 2
        height_m = self._height(label_m, distance_m - step_m)
        most_m = min(p.aside_m, self._aside_per_height * height_m)
        aside_m = _clamp(middle_m - node.x_m + (0.0 if near else p.step_m), most_m)
        first, *_, last = self._site.aisle_nodes(view.aisle)
        x_m = min(max(node.x_m + aside_m, first.x_m), last.x_m)  # the aisle's line ends behind its end nodes
        y_m = node.y_m + towards * step_m
        ways = (view.x_m, view.y_m, view.height_m), (node.x_m, node.y_m, view.height_m)
        for x, y in ((x_m, y_m), (x_m, node.y_m), (node.x_m, y_m)):
            if all(self._site.is_clear(way, (x, y, height_m)) for way in ways):
                codes = tuple(left)
                return replace(view, x_m=x, y_m=y, height_m=height_m, locations=codes, retake=number + 1)
        return None

    def column(self, node: str, places: Sequence[Location]) -> list[View]:
        """One side's views from the lowest level up; levels whose labels fit one picture share a view."""
        at = self._site.nodes[node]
        groups: list[list[Location]] = []
        for place in sorted(places, key=lambda place: place.height_m):
            if groups and self._fits([*groups[-1], place], at.y_m):
                groups[-1].append(place)
            else:
                groups.append([place])
        return [self._view(node, group) for group in groups]

    def _view(self, node: str, group: Sequence[Location]) -> View:
        at, first = self._site.nodes[node], group[0]
        middle_m = (group[0].height_m + group[-1].height_m) / 2
        height_m = self._height(middle_m, abs(first.y_m - at.y_m))
        codes = tuple(place.code for place in group)
        return View(node, first.aisle, first.side, at.x_m, at.y_m, height_m, self._yaw(first.side), codes)

    def _height(self, label_m: float, distance_m: float) -> float:
        heights_m = self._params.min_height_m, self._highest_m
        return view_height_m(label_m, distance_m, self._sight.mount, heights_m)

    def _yaw(self, side: Side) -> float:
        """The heading in which the camera faces a side; a side camera needs no turn."""
        outward = math.pi / 2 if side is Side.RIGHT else -math.pi / 2
        return wrap_pi(outward - self._sight.mount.yaw_rad)

    def _fits(self, group: Sequence[Location], node_y_m: float) -> bool:
        """Whether all labels of a group, with room around each, are in one picture."""
        reach_m = self._params.expert.label_reach_m
        distance_m = abs(group[0].y_m - node_y_m)
        low, high = group[0].height_m - reach_m, group[-1].height_m + reach_m
        height_m = self._height((low + high) / 2, distance_m)
        pose = BodyPose(
            0, group[0].x_m, node_y_m, height_m, 0.0, 0.0, self._yaw(group[0].side), 0.0, 0.0, 0.0, True
        )
        view, lens = self._sight.view(pose), self._sight.lens
        ends = np.array([(group[0].x_m, group[0].y_m, h_m) for h_m in (low, high)])
        rows = view.project(ends)[:, 1]
        return bool(np.all((rows >= 0.0) & (rows <= lens.height_px - 1)))


def views_s(views: Sequence[View], pace: Pace, look_s: float) -> float:
    """Seconds over `views` in their order, from the flying height on: climbing and turning at once, then
    settling, and `look_s` from each."""
    total, height_m, yaw_rad = 0.0, pace.height_m, views[0].yaw_rad + math.pi if views else 0.0
    for view in views:
        way_s = max(pace.climb_s(view.height_m - height_m), pace.turn_s(wrap_pi(view.yaw_rad - yaw_rad)))
        total += way_s + look_s
        height_m, yaw_rad = view.height_m, view.yaw_rad
    return total


def view_height_m(
    label_m: float, distance_m: float, mount: ForwardMount, heights_m: tuple[float, float]
) -> float:
    """Flying height at which the camera's axis meets the shelf at the labels' height, as far as it may:
    between the lowest and the highest of `heights_m`."""
    forward_m, _, down_m = mount.offset_m
    wanted = label_m + down_m - (distance_m - forward_m) * math.tan(mount.pitch_rad)
    return min(max(wanted, heights_m[0]), heights_m[1])


def _clamp(value: float, limit: float) -> float:
    return min(max(value, -limit), limit)


def _hands(places: Sequence[Location], x_m: float) -> list[list[Location]]:
    """Places at higher x than the node and those at lower x; either may be missing."""
    higher = [place for place in places if place.x_m >= x_m]
    lower = [place for place in places if place.x_m < x_m]
    return [hand for hand in (higher, lower) if hand]
