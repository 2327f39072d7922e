"""Which nodes a drone cannot tell apart by the floor alone, however well it counts.

Two nodes are alike within n crossings when what is seen above them is the same (arms, line ends) and
the same ways lead on from both, equally long up to what the localiser resolves, to nodes alike within
n - 1 crossings.
"""

from __future__ import annotations

import math
from collections import defaultdict
from functools import cache
from itertools import combinations

import numpy as np

from flightd.site.painted_lines import PaintMap
from flightd.site.site import Site

_SPACING_M = 0.10
"""Ways that differ by less take a drone equally long."""
_END_M = 0.25
_SIGHT_M = 0.8
"""Ends of lines are compared up to this far from the node."""


def alike(site: Site, crossings: int) -> list[tuple[str, ...]]:
    """The groups of two and more nodes that look alike within so many crossings, in the map's order."""
    looks = _looks(site)
    ways = {
        node: {_direction(site, node, other): other for other in site.neighbours(node)} for node in site.nodes
    }

    @cache
    def same(a: str, b: str, left: int) -> bool:
        if not _look_same(looks[a], looks[b]) or ways[a].keys() != ways[b].keys():
            return False
        return left == 0 or all(
            abs(site.distance_m(a, to_a) - site.distance_m(b, ways[b][way])) < _SPACING_M
            and same(to_a, ways[b][way], left - 1)
            for way, to_a in ways[a].items()
        )

    by_arms: defaultdict[int, list[str]] = defaultdict(list)
    for node, (arms, _) in looks.items():
        by_arms[arms].append(node)
    group = {node: node for node in site.nodes}
    for nodes in by_arms.values():
        for a, b in combinations(nodes, 2):
            if group[a] != group[b] and same(a, b, crossings):
                joined = group[b]
                group = {node: group[a] if head == joined else head for node, head in group.items()}
    members: defaultdict[str, list[str]] = defaultdict(list)
    for node, head in group.items():
        members[head].append(node)
    return [tuple(nodes) for nodes in members.values() if len(nodes) > 1]


_Look = tuple[int, tuple[tuple[int, float], ...]]
"""Arms of the crossing; the ends in sight with their distance."""


def _looks(site: Site) -> dict[str, _Look]:
    paint = PaintMap.of(site)
    seen: dict[str, _Look] = {}
    for node in site.nodes.values():
        here = node.x_m, node.y_m
        crossing = np.abs(paint.crossings.at_m - here).max(axis=1)
        arms = int(paint.crossings.arms[int(crossing.argmin())])
        apart = np.abs(paint.ends.at_m - here).max(axis=1)
        ends = ((int(paint.ends.arms[i]), float(apart[i])) for i in np.flatnonzero(apart < _SIGHT_M))
        seen[node.id] = arms, tuple(sorted(ends))
    return seen


def _look_same(a: _Look, b: _Look) -> bool:
    return (
        a[0] == b[0]
        and len(a[1]) == len(b[1])
        and all(
            one == other and abs(far - away) < _END_M
            for (one, far), (other, away) in zip(a[1], b[1], strict=True)
        )
    )


def _direction(site: Site, a: str, b: str) -> int:
    """0 to 3 for +x, +y, -x, -y."""
    one, two = site.nodes[a], site.nodes[b]
    return round(math.atan2(two.y_m - one.y_m, two.x_m - one.x_m) / (math.pi / 2)) % 4
