"""Where on the warehouse grid: lines tracked on the floor are matched to the painted lines of the map.

Each track is matched once, when it is new, to the map line nearest to where the drone believes it to
be, and keeps that identity while it is tracked; position follows from all matched tracks together.
Between lines the position is carried on by the tracked velocity.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from flightd.core.types import GridPose
from flightd.grid.site import Site
from flightd.tracking.lines import TrackSet
from flightd.tracking.motion import TrackedLine

_SURVEY_SIGMA_M = 0.01
_MATCH_SHARE = 0.4
"""A track is matched within this share of the distance to the next map line (0.5 would be ambiguous)."""
_MATCH_SIGMAS = 4.0
_MATCH_SLACK_M = 0.06
_MIN_HITS = 3
_DRIFT_MPS = 0.15
"""Growth of the position's sigma while no line is seen."""
_FRESH_NS = 300_000_000
"""A line seen so recently counts as seen: pictures come late and now and then without a line."""


@dataclass(frozen=True, slots=True)
class _MapLine:
    """A painted line across one axis: its coordinate on that axis and its extent along the other."""

    at_m: float
    from_m: float
    to_m: float


class _Axis:
    """Position on one axis of the map."""

    def __init__(self, lines: Sequence[_MapLine], position_m: float, sigma_m: float) -> None:
        self._lines = sorted(lines, key=lambda line: line.at_m)
        self._matched: dict[int, float] = {}
        self.position_m = position_m
        self.sigma_m = sigma_m
        self.ever_matched = False
        self.seen_ns = 0

    def step(
        self,
        tracks: Sequence[TrackedLine],
        now_ns: int,
        velocity_mps: float,
        dt_s: float,
        other_m: float,
        reach_m: float,
    ) -> None:
        self.position_m += velocity_mps * dt_s
        self.sigma_m += _DRIFT_MPS * dt_s
        held = {track.id for track in tracks}
        tracks = sorted(tracks, key=lambda track: -track.seen_ns)
        self._matched = {id_: at for id_, at in self._matched.items() if id_ in held}
        weight = total = 0.0
        for track in tracks:
            if track.id not in self._matched and track.hits >= _MIN_HITS:
                at = self._match(track, other_m, reach_m)
                if at is not None and at not in self._matched.values():
                    self._matched[track.id] = at
                    self.ever_matched = True
            if track.id in self._matched:
                unseen_m = _DRIFT_MPS * max(now_ns - track.seen_ns - _FRESH_NS, 0) * 1e-9
                w = 1.0 / (track.sigma_m**2 + _SURVEY_SIGMA_M**2 + unseen_m**2)
                self.seen_ns = max(self.seen_ns, track.seen_ns)
                weight += w
                total += w * (self._matched[track.id] - track.offset_m)
        if weight:
            self.position_m = total / weight
            self.sigma_m = weight**-0.5

    def _match(self, track: TrackedLine, other_m: float, reach_m: float) -> float | None:
        """The coordinate of the painted line that the track is, if that is near enough and unambiguous."""
        seen_at_m = self.position_m + track.offset_m
        near = {line.at_m for line in self._lines if line.from_m - reach_m <= other_m <= line.to_m + reach_m}
        by_distance = sorted(near, key=lambda at: abs(at - seen_at_m))
        if not by_distance:
            return None
        best = by_distance[0]
        gap = min((abs(at - best) for at in by_distance[1:]), default=math.inf)
        doubt_m = _MATCH_SIGMAS * math.hypot(self.sigma_m, track.sigma_m) + _MATCH_SLACK_M
        gate = min(_MATCH_SHARE * gap, doubt_m)
        return best if abs(best - seen_at_m) <= gate else None


class GridLocaliser:
    """Position and node on the map, from `start_node` on."""

    def __init__(self, site: Site, start_node: str, start_sigma_m: float = 0.15) -> None:
        self._site = site
        node = site.nodes[start_node]
        across_x = [
            _MapLine(s.x0_m, min(s.y0_m, s.y1_m), max(s.y0_m, s.y1_m)) for s in site.lines if s.x0_m == s.x1_m
        ]
        across_y = [
            _MapLine(s.y0_m, min(s.x0_m, s.x1_m), max(s.x0_m, s.x1_m)) for s in site.lines if s.y0_m == s.y1_m
        ]
        self._x = _Axis(across_x, node.x_m, start_sigma_m)
        self._y = _Axis(across_y, node.y_m, start_sigma_m)
        self._stamp_ns: int | None = None

    @property
    def seen_ns(self) -> tuple[int, int]:
        """When a line of the map was last seen that tells x, and y; 0 before the first."""
        return self._x.seen_ns, self._y.seen_ns

    @property
    def ever_matched(self) -> tuple[bool, bool]:
        """Whether a map line has been recognised yet in x and in y: before that, position is belief."""
        return self._x.ever_matched, self._y.ever_matched

    def step(self, tracks: TrackSet, height_m: float) -> GridPose:
        """The pose at the tracks' time."""
        dt_s = 0.0 if self._stamp_ns is None else (tracks.stamp_ns - self._stamp_ns) * 1e-9
        self._stamp_ns = tracks.stamp_ns
        reach_m = max(1.5 * height_m, 0.3)
        x_before = self._x.position_m
        now_ns = tracks.stamp_ns
        self._x.step(tracks.across_x, now_ns, tracks.vx_mps, dt_s, self._y.position_m, reach_m)
        self._y.step(tracks.across_y, now_ns, tracks.vy_mps, dt_s, x_before, reach_m)
        x, y = self._x.position_m, self._y.position_m
        node = self._site.nearest(x, y)
        sx, sy = self._x.sigma_m, self._y.sigma_m
        return GridPose(
            stamp_ns=tracks.stamp_ns,
            node=node.id,
            along_m=x - node.x_m,
            across_m=y - node.y_m,
            yaw_rad=tracks.yaw_rad,
            x_m=x,
            y_m=y,
            vx_mps=tracks.vx_mps,
            vy_mps=tracks.vy_mps,
            height_m=height_m,
            covariance=(sx**2, 0.0, 0.0, 0.0, sy**2, 0.0, 0.0, 0.0, tracks.yaw_sigma_rad**2),
            integrity=self._integrity(node.id, sx, sy),
        )

    def _integrity(self, node: str, sigma_x_m: float, sigma_y_m: float) -> float:
        """Probability that the nearest node is the true one: no axis is off by half a cell."""
        here = self._site.nodes[node]
        others = [self._site.nodes[other] for other in self._site.neighbours(node)]
        half = 0.5 * min((math.hypot(n.x_m - here.x_m, n.y_m - here.y_m) for n in others), default=1.0)
        return math.erf(half / (math.sqrt(2.0) * sigma_x_m)) * math.erf(half / (math.sqrt(2.0) * sigma_y_m))
