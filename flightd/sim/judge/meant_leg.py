"""The painted lines along which the drone meant to fly, at any time of a flight.

What is meant comes from the daemon's statuses: the stop that it flies to, the node at which it believed to be
when it chose that stop, and the place beside it from which it looks at a shelf again.  Where it really was is
no part of it, so a drone in the wrong aisle is as far from its leg as the aisles are from each other.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from flightd.core.types import Phase, Status
from flightd.sim.judge.hover_error import Place, told_view
from flightd.sim.judge.motion import TrueMotion, Values
from flightd.site.site import Site
from flightd.site.ways import NoWayError

_ROUND_A_CORNER_S = 2.0
"""So long after a stop is reached the leg to it still counts: the drone comes to rest, and turns."""
_BESIDE_M = 1.0
"""A view from further beside its node is none that a scan takes: it is not believed."""
_WHEREVER, _WHEREVER_S = frozenset({Phase.RELOCATE, Phase.RECOVER}), 31.0
"""It says itself that it does not know where it is: any line is right, for as long as `mission.relocate_s`
as shipped, and the tick that ends it; who has not found out by then has to land."""

Segment = tuple[float, float, float, float]
"""x and y of both ends, m."""


@dataclass(frozen=True, slots=True)
class _Leg:
    """From `begins_s` on: the lines to the goal, and those of the leg before that still count until
    `before_until_s`."""

    begins_s: float
    lines: tuple[Segment, ...]
    before: tuple[Segment, ...]
    before_until_s: float


def off_leg(site: Site, start: str, statuses: Sequence[Status], motion: TrueMotion) -> Values:
    """How far beside the leg that was meant each sample of `motion` is, (n,) metres on the floor.  `start` is
    the node at which the flight begins; `statuses` in time order.  Infinite before the first."""
    legs = list(_legs(site, start, statuses))
    begins = [leg.begins_s for leg in legs]
    off = np.full(len(motion), math.inf)
    numbers = np.array([bisect_right(begins, stamp_s) - 1 for stamp_s in motion.stamp_s], int)
    for number in np.unique(numbers[numbers >= 0]):
        leg, within = legs[number], numbers == number
        still = within & (motion.stamp_s < leg.before_until_s)
        off[within] = _to_lines(leg.lines, motion.x_m[within], motion.y_m[within])
        if leg.before and still.any():
            off[still] = np.minimum(off[still], _to_lines(leg.before, motion.x_m[still], motion.y_m[still]))
    return off


def _legs(site: Site, start: str, statuses: Sequence[Status]) -> Iterator[_Leg]:
    everywhere = tuple(_between(site, edge.a, edge.b) for edge in site.edges)
    goal, wherever, here, lost_s = "", False, start, math.inf
    view: Place | None = None
    way: tuple[Segment, ...] = ()
    lines: tuple[Segment, ...] = ()
    for status in statuses:
        lost_s = min(lost_s, status.stamp_ns * 1e-9) if status.phase in _WHEREVER else math.inf
        anywhere = lost_s <= status.stamp_ns * 1e-9 < lost_s + _WHEREVER_S
        here = status.node or here  # on a pad it sees no lines, and tells no node
        looks_from = _view(site, status)
        stays = (status.goal, anywhere) == (goal, wherever)
        if stays and looks_from == view:
            continue
        begins_s, before = status.stamp_ns * 1e-9, lines
        until_s = begins_s + _ROUND_A_CORNER_S
        if not stays:
            arrived = here == goal
            before = _incident(site, before, here, arrived=arrived)
            until_s = until_s if arrived else math.inf
            goal, wherever, view = status.goal, anywhere, None
            way = everywhere if anywhere else _way(site, here, goal)
        lines = (*way, *_to_view(site, goal, view, looks_from))
        view = looks_from
        yield _Leg(begins_s, lines, before, until_s)


def _view(site: Site, status: Status) -> Place | None:
    """The place beside the node of its stop from which it looks at a shelf; None where it does not."""
    view, node = told_view(status), site.nodes.get(status.goal)
    if view is None or node is None:
        return None
    return view if math.dist(view, (node.x_m, node.y_m)) <= _BESIDE_M else None


def _to_view(site: Site, goal: str, before: Place | None, view: Place | None) -> tuple[Segment, ...]:
    """From the node of a stop, and from the view before, to a place beside it."""
    if view is None:
        return ()
    node = site.nodes[goal]
    starts = [(node.x_m, node.y_m), *([] if before is None else [before])]
    return tuple((*start, *view) for start in starts)


def _incident(site: Site, before: tuple[Segment, ...], here: str, *, arrived: bool) -> tuple[Segment, ...]:
    """Of the leg before, what still counts: all where its end was reached, else the lines that pass the node
    at which the drone turned to another goal."""
    if arrived or here not in site.nodes:
        return before
    node = site.nodes[here]
    at = np.array([node.x_m]), np.array([node.y_m])
    return tuple(line for line in before if _to_lines((line,), *at)[0] < 1e-6)


def _way(site: Site, here: str, goal: str) -> tuple[Segment, ...]:
    """The lines of the shortest way, and to the pads at its ends."""
    if here not in site.nodes or goal not in site.nodes:
        return ()
    try:
        nodes = site.path(here, goal, against_one_way=True)
    except NoWayError:
        nodes = (here, goal)
    ends = {here, goal}
    pads = [
        (*site.pad_centre(pad), site.nodes[pad.node].x_m, site.nodes[pad.node].y_m)
        for pad in site.pads
        if pad.node in ends
    ]
    lines = [_between(site, a, b) for a, b in pairwise(nodes)] or [_between(site, goal, goal)]
    return (*lines, *pads)


def _between(site: Site, a: str, b: str) -> Segment:
    return site.nodes[a].x_m, site.nodes[a].y_m, site.nodes[b].x_m, site.nodes[b].y_m


def _to_lines(lines: Sequence[Segment], x_m: Values, y_m: Values) -> Values:
    """Distance of each point, (n,) each, to the nearest of the lines; infinite without any."""
    least = np.full(x_m.shape, math.inf)
    for ax, ay, bx, by in lines:
        dx, dy = bx - ax, by - ay
        share = ((x_m - ax) * dx + (y_m - ay) * dy) / max(dx * dx + dy * dy, 1e-12)
        share = np.clip(share, 0.0, 1.0)
        least = np.minimum(least, np.hypot(x_m - ax - share * dx, y_m - ay - share * dy))
    return least
