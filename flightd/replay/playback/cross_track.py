"""How far the drone was beside the way that it flew."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np

from flightd.replay.playback.flight import Array, Leg
from flightd.replay.playback.legs import way_to
from flightd.site.site import Node, Site


def cross_track_m(site: Site, start: str, legs: Sequence[Leg], t_s: Array, x_m: Array, y_m: Array) -> Array:
    """Signed distance of each pose from the nearest line of its leg's way: + towards +y on an aisle, towards
    +x on a cross line; NaN where no leg is flown, and on one that has no line.  `start` is the node at which
    the first leg begins, empty where nobody knows; `t_s` rises."""
    offset = np.full(t_s.shape, math.nan)
    flown = [(leg.t_s, (*before.via[-1:], *leg.via)) for before, leg in itertools.pairwise(legs)]
    if legs:
        flown.insert(0, (legs[0].t_s, (start, *way_to(site, start, legs[0].via[-1]))))
    begun = [(start_s, way) for start_s, way in flown if start_s is not None]
    ends = [start_s for start_s, _ in begun[1:]] + [math.inf]
    for (start_s, way), end_s in zip(begun, ends, strict=True):
        part = (t_s >= start_s) & (t_s < end_s)
        if part.any():
            offset[part] = _beside(_lines(site, way), x_m[part], y_m[part])
    return offset


def _lines(site: Site, way: Sequence[str]) -> list[tuple[Node, Node]]:
    """The lines from node to node; of a way that begins where it ends, those of its only node."""
    known = [site.nodes[node] for node in dict.fromkeys(way) if node in site.nodes]
    if len(known) == 1:
        return [(known[0], site.nodes[other]) for other in site.neighbours(known[0].id)]
    return list(itertools.pairwise(known))


def _beside(lines: Sequence[tuple[Node, Node]], x_m: Array, y_m: Array) -> Array:
    nearest = np.full(x_m.shape, math.inf)
    offset = np.full(x_m.shape, math.nan)
    for a, b in lines:
        length_m = max(math.hypot(b.x_m - a.x_m, b.y_m - a.y_m), 1e-6)
        along = ((x_m - a.x_m) * (b.x_m - a.x_m) + (y_m - a.y_m) * (b.y_m - a.y_m)) / length_m**2
        part = np.clip(along, 0.0, 1.0)
        away_x, away_y = (
            x_m - a.x_m - part * (b.x_m - a.x_m),
            y_m - a.y_m - part * (b.y_m - a.y_m),
        )
        distance = np.hypot(away_x, away_y)
        closer = distance < nearest
        nearest = np.where(closer, distance, nearest)
        runs_along_x = abs(b.x_m - a.x_m) >= abs(b.y_m - a.y_m)
        offset = np.where(closer, away_y if runs_along_x else away_x, offset)
    return offset
