"""The map as flown logs have it: where the painted lines and their nodes lie, and how surely.

Places are measured from the home pad's node, whose two lines stay where the map has them and whose aisle
keeps its direction.  The scale of it all is a question of its own: see `map_scale`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from flightd.config.schema import Config
from flightd.core.errors import RunError
from flightd.core.geometry import Matrix
from flightd.site.layout import SAME_X_M, LayoutError
from flightd.site.moved_lines import moved
from flightd.site.painted_lines import AxisLines, PaintMap
from flightd.site.site import Aisle, Site
from flightd.studies.flight_fit.fit import LineBelief, fit_flights
from flightd.studies.flight_fit.motion import BELIEVED, Sensor
from flightd.studies.flight_fit.record import FlightRecord
from flightd.studies.map_scale import Distance, MapScale, map_scale

_MAP_SIGMA_M, _ANGLE_SIGMA_RAD = 0.15, math.radians(0.3)
LEAST_SIGHTINGS, MOST_SIGMA_M = 5, 0.05
"""A line seen in fewer frames, or known less surely, was not seen enough: it stays where the map has it."""
_DECIMALS = 3


@dataclass(frozen=True, slots=True)
class FittedLine:
    """One painted line: its place on the axis that it crosses ("x" or "y"), metres, on the map and as fitted,
    with its sigma; its angle from that of the home pad's aisle, clockwise; in how many frames it was seen.
    `given`: places are measured from it."""

    name: str
    axis: str
    nodes: tuple[str, ...]
    map_m: float
    fitted_m: float
    sigma_m: float
    angle_rad: float
    angle_sigma_rad: float
    sightings: int
    given: bool

    @property
    def difference_m(self) -> float:
        return self.fitted_m - self.map_m

    @property
    def seen_enough(self) -> bool:
        return self.given or (self.sightings >= LEAST_SIGHTINGS and self.sigma_m <= MOST_SIGMA_M)


@dataclass(frozen=True, slots=True)
class FittedNode:
    """A node, by the lines that cross on it: the one across the aisles, and its aisle's."""

    id: str
    across: FittedLine
    along: FittedLine

    @property
    def sightings(self) -> int:
        return min(self.across.sightings, self.along.sightings)

    @property
    def sigma_m(self) -> float:
        return max(self.across.sigma_m, self.along.sigma_m)

    @property
    def seen_enough(self) -> bool:
        return self.across.seen_enough and self.along.seen_enough


@dataclass(frozen=True, slots=True)
class MapFit:
    """`site` is the one proposed: what was seen enough lies where it was fitted, to the millimetre.  `misfit`
    is about 1 where the lines fit as well as they say."""

    site: Site
    lines: tuple[FittedLine, ...]
    nodes: tuple[FittedNode, ...]
    scale: MapScale
    misfit: float
    frames: int

    @property
    def aisles(self) -> Mapping[str, Aisle]:
        """Those of the proposed site, by name."""
        return {aisle.id: aisle for aisle in self.site.aisles}


def fit_map(
    records: Sequence[FlightRecord],
    configs: Sequence[Config],
    site: Site,
    measured: Sequence[Distance] = (),
) -> MapFit:
    """Fit the map by which all these flights were flown.  InputError for a measured distance of unknown
    nodes, RunError where the lines seen say nothing of it."""
    for one in measured:
        site.require(one.a)
        site.require(one.b)
    across_x, across_y = PaintMap.of(site).axes
    split, home = len(across_x.at_m), site.nodes[site.home.node]
    map_m = np.concatenate([across_x.at_m, across_y.at_m])
    at = {
        node.id: (_through(across_x, node.x_m, node.y_m), _through(across_y, node.y_m, node.x_m) + split)
        for node in site.nodes.values()
    }
    given = np.isin(np.arange(len(map_m)), at[home.id])
    sensors = BELIEVED.copy()
    # A fit that may stretch the floor makes it too small: all motion in it is smaller then, and likelier.
    sensors[[Sensor.FOCAL, Sensor.HEIGHT, Sensor.BEND]] = 0.0
    aisle_given = given & (np.arange(len(map_m)) >= split)
    belief = LineBelief(np.where(given, 0.0, _MAP_SIGMA_M), np.where(aisle_given, 0.0, _ANGLE_SIGMA_RAD))
    fit = fit_flights(records, configs, site, belief, sensors)
    seen = (fit.sightings >= LEAST_SIGHTINGS) & ~given
    if not seen.any():
        raise RunError(f"no line but the home pad's was seen in {LEAST_SIGHTINGS} frames: the map stays")
    origin_m = np.where(np.arange(len(map_m)) < split, home.x_m, home.y_m)
    from_home_m = map_m + fit.offset_m - origin_m
    lengths = [(one, _apart(from_home_m + origin_m, at[one.a], at[one.b])) for one in measured]
    scale = map_scale(fit.flights, site.line_width_m, ((map_m - origin_m)[seen], from_home_m[seen]), lengths)
    fitted_m = origin_m + from_home_m * scale.factor
    sigma_m = np.hypot(fit.offset_sigma_m, np.abs(from_home_m) * scale.sigma)
    lines = tuple(
        FittedLine(
            *_named(i, split, at),
            float(map_m[i]),
            float(fitted_m[i]),
            float(sigma_m[i]),
            float(fit.angle_rad[i]),
            float(fit.angle_sigma_rad[i]),
            int(fit.sightings[i]),
            bool(given[i]),
        )
        for i in range(len(map_m))
    )
    nodes = tuple(FittedNode(node, lines[at[node][0]], lines[at[node][1]]) for node in site.nodes)
    frames = sum(len(record.frames) for record in records)
    return MapFit(_proposed(site, nodes), lines, nodes, scale, fit.misfit, frames)


def _through(lines: AxisLines, at_m: float, along_m: float) -> int:
    """The line of an axis that goes through a point of it."""
    near = np.abs(lines.at_m - at_m) <= SAME_X_M
    near &= (lines.from_m - SAME_X_M <= along_m) & (along_m <= lines.to_m + SAME_X_M)
    return int(np.flatnonzero(near)[0])


def _apart(place_m: Matrix, a: tuple[int, int], b: tuple[int, int]) -> float:
    return math.hypot(place_m[a[0]] - place_m[b[0]], place_m[a[1]] - place_m[b[1]])


def _named(line: int, split: int, at: Mapping[str, tuple[int, int]]) -> tuple[str, str, tuple[str, ...]]:
    """A line's name, the axis that it crosses, and its nodes."""
    if line < split:
        nodes = tuple(node for node, (across, _) in at.items() if across == line)
        return f"across {' '.join(nodes)}", "x", nodes
    nodes = tuple(node for node, (_, along) in at.items() if along == line)
    return f"aisle {nodes[0].rstrip('0123456789')}", "y", nodes


def _proposed(site: Site, nodes: Sequence[FittedNode]) -> Site:
    x_m = {
        node.id: round(node.across.fitted_m, _DECIMALS)
        for node in nodes
        if node.across.seen_enough and not node.across.given
    }
    y_m = {
        site.nodes[node.id].aisle: round(node.along.fitted_m, _DECIMALS)
        for node in nodes
        if node.along.seen_enough and not node.along.given
    }
    try:
        return moved(site, y_m, x_m)
    except LayoutError as err:
        raise RunError(
            f"the fitted lines make no floor ({err})",
            remedy="fly over the whole map, and fit all logs at once",
        ) from None
