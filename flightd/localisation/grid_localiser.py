"""Where on the warehouse grid: a discrete Bayes filter over the places where the drone may be.

States.  A place is a whole position on the map: the one that the start node gives, and every other node
near enough to be confused with it.  Each place carries its own position (mean and sigma per axis) and
knows, for each tracked line, which painted line that is there (`flightd.localisation.hypotheses`).

Transition.  Between ticks all places move by the tracked velocity; lines seen on pin each place's
position down, so a place stays the same place however long the flight.  What could still make the count
wrong (a slip while no line is seen, a carried drone) leaks a little weight to the neighbouring nodes
at each new node, much more after a gap without lines, so that no belief is ever beyond doubt.

Likelihoods (`localisation.observation_model`).  Each observation counts once: a line seen where the map has
one, or none; how far it goes on; a painted line that passed below and was not seen; the arms of a crossing
(cross, tee, corner); the end of a line, seen or not where it should be; a pad's mat; a floor marker or a
shelf label of known place.  How much each says depends on how worn the floor is, which is learnt with the
place.

`GridPose.integrity` is the posterior probability that the node told is the right one.  The recursion is
the discrete Bayes filter of Thrun, Burgard, Fox: Probabilistic Robotics, 2005, table 4.1.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np

from flightd.config.localisation import LocalisationConfig
from flightd.core.camera_view import FloorReach
from flightd.core.tracks import TrackedLine, TrackSet
from flightd.core.types import GridPose
from flightd.localisation.hypotheses import Places
from flightd.localisation.junction_landmarks import Landmark, LandmarkBook
from flightd.localisation.line_runs import BESIDE_M, SEEN_NS, Approached, LineRuns
from flightd.localisation.observation_model import (
    SensorModel,
    crossing_likelihood,
    end_likelihood,
    fix_likelihood,
    mat_likelihood,
)
from flightd.localisation.position_fixes import FixBook
from flightd.localisation.safe_moves import Reach
from flightd.localisation.seen_beside import SeenBeside
from flightd.site.nearest_node import NodeIndex
from flightd.site.painted_lines import PaintMap
from flightd.site.site import Site

_MIN_HITS = 3
_ENDS_ALONG_X = (1, 4)
"""Arms of the ends of a line that runs along x."""
_CELL_M = 0.3
"""Places that differ by less are the same node."""
_JUDGE_NS = 100_000_000
"""What was passed and what is left to match is looked at so often."""
_SWITCH = 1.5
"""Another place is believed when it is so much likelier."""
_MOST_AT_ONCE = 4
"""Times the places that are kept there may be until the next look at what was passed."""
_BELOW = 0.3
"""Part of the height within which a line is below the drone, and what lies beside it in view."""
_CARRIED_NS = 400_000_000
"""So lately features of the floor must have been followed to carry a position on."""
_SURE = 0.99
"""Places this likely together say how far a line of the map is."""
_LEAST = 1e-3
"""A place less likely than this is none where the drone may be."""
_CREEP_MPS = 0.1
"""A hover counts as so fast: what carries a position drifts at rest, too."""
_OTHER_FLOOR = 5e-3
"""Probability, at each new node, that the floor is as worn from here on as any may be."""
_GAP_S = 0.6
"""Without a line for so long, the count may have slipped."""


_DEFAULTS = LocalisationConfig()


class GridLocaliser:
    """Position and node on the map, from `start_node` on, by a camera whose picture surely shows `view`."""

    def __init__(
        self,
        site: Site,
        start_node: str,
        view: FloorReach,
        config: LocalisationConfig = _DEFAULTS,
        model: SensorModel | None = None,
    ) -> None:
        self._site = site
        self._view = view
        self._params = config.expert
        self._model = model or SensorModel()
        self._paint = PaintMap.of(site)
        self._nodes = NodeIndex(site)
        self._places = Places(self._paint, self._model, self._params.elsewhere)
        self._marks = LandmarkBook()
        self._fixes = FixBook(site)
        self._approached = Approached(), Approached()
        self._runs = LineRuns(), LineRuns()
        self._beside = SeenBeside(), SeenBeside()
        self._judged: tuple[list[float], list[float]] = ([], [])
        self._seen_ns = [0, 0]
        self._told_ns = [0, 0]
        self._carried_m = [0.0, 0.0]
        self._ever_matched = [False, False]
        self._stamp_ns: int | None = None
        self._judge_ns = 0
        self._junctions_ns = 0
        self._node = start_node
        self._gap = False
        self._reach = Reach(site, self._paint)
        self.corrections = 0
        """How often another place was believed than before."""
        self._way: tuple[float, float] | None = None
        self._start(start_node)

    @property
    def told_ns(self) -> tuple[int, int]:
        """When x, and y, was last told: by a line of the map, or by what else of the floor carried it on for
        no more than `by_features_m`; 0 before the first line."""
        return self._told_ns[0], self._told_ns[1]

    @property
    def ever_matched(self) -> tuple[bool, bool]:
        """Whether a map line has been recognised yet in x and in y: before that, position is belief."""
        return self._ever_matched[0], self._ever_matched[1]

    def rivals(self) -> list[tuple[str, float]]:
        """Every node where the drone may be with its probability, the likeliest first."""
        places = self._places
        by_node: dict[str, float] = {}
        for row in range(1, len(places)):
            node = self._nodes.node(float(places.at_m[row, 0]), float(places.at_m[row, 1])).id
            by_node[node] = by_node.get(node, 0.0) + float(places.weights[row])
        return sorted(((n, w) for n, w in by_node.items() if w >= _LEAST), key=lambda item: -item[1])

    def map_lines(self, axis: int) -> dict[int, float]:
        """Where on the map (m, across the axis) each track is that is surely a line of it, seen from the
        likeliest place: wherever else the drone may be, the line there lies as far from it.  Lines that the
        drone came nearer to: another one beside it would have come into view."""
        lines = {
            track: line
            for track, line in self._places.lines(axis).items()
            if line >= 0 and self._approached[axis].has(track)
        }
        agreed = self._places.agreed(axis, lines)
        return {
            track: float(self._paint.axes[axis].at_m[line])
            for track, line in lines.items()
            if agreed[track] > _SURE
        }

    def way_out(self) -> tuple[float, float] | None:
        """A move (dx, dy) along open lines that is safe wherever the drone may be, towards where
        those places differ; None when there is none."""
        places = self._places
        rows = np.argsort(-places.weights)
        rows = rows[(places.weights[rows] >= _LEAST) & (rows != places.best)]
        if 0 in rows:
            return None
        at_m = places.at_m[[places.best, *rows]]
        self._way = self._reach.way_out(self._node, at_m, self._way)
        return self._way

    def step(self, tracks: TrackSet, height_m: float) -> GridPose:
        """The pose at the tracks' time."""
        now_ns, places = tracks.stamp_ns, self._places
        dt_s = 0.0 if self._stamp_ns is None else (now_ns - self._stamp_ns) * 1e-9
        self._stamp_ns = now_ns
        reach_m = max(1.5 * height_m, 0.3)
        due = now_ns - self._judge_ns >= _JUDGE_NS
        for axis, velocity in ((0, tracks.vx_mps), (1, tracks.vy_mps)):
            lines = tracks.across_y if axis else tracks.across_x
            self._beside[axis].step(lines, partial(self._is_of_map, axis))
            carried = now_ns - self._followed_ns(axis, tracks) < _CARRIED_NS
            places.move(axis, velocity, tracks.velocity_sigma_mps[axis], dt_s, carried=carried)
            self._match(axis, lines, reach_m, due)
            if due:
                self._part(axis, lines)
            places.settle(axis, lines)
            self._carry(axis, tracks, dt_s)
            self._approached[axis].step(lines, _BELOW * height_m)
        if tracks.junctions_ns > self._junctions_ns:
            self._junctions_ns = tracks.junctions_ns
            self._see(tracks, height_m)
        if due:
            self._pass(tracks, height_m, min((now_ns - self._judge_ns) * 1e-9, 0.5))
            self._judge_ns = now_ns
        return self._pose(tracks, height_m)

    def marker(self, at_m: tuple[float, float], dx_m: float, dy_m: float, sigma_m: float = 0.1) -> None:
        """A floor marker that lies at map point `at_m` is seen (`dx_m`, `dy_m`) from the drone."""
        self._fix(at_m[0] - dx_m, at_m[1] - dy_m, sigma_m)

    def sighted(self, location: str, dx_m: float, dy_m: float, sigma_m: float = 0.3) -> None:
        """The label of a location was read by the front camera (`dx_m`, `dy_m`) from the drone, in map
        axes.  A location that the site does not have says nothing, nor does a label that has been seen
        here before: one that hangs wrong would not hang better the second time."""
        known = self._site.locations.get(location)
        here = self._places.at_m[self._places.best]
        if known is not None and self._fixes.is_new(location, float(here[0]), float(here[1])):
            self._fix(known.x_m - dx_m, known.y_m - dy_m, sigma_m)

    # The parts of a step

    def _is_of_map(self, axis: int, track_id: int) -> bool:
        return self._places.lines(axis).get(track_id, -1) >= 0

    def _part(self, axis: int, tracks: Sequence[TrackedLine]) -> None:
        """Tell the places which tracks are surely two lines."""
        known = {track.id: track for track in tracks if self._places.knows(axis, track.id)}
        for one, other in self._beside[axis].pairs():
            if one in known and other in known:
                self._places.part(axis, known[one], known[other])

    def _followed_ns(self, axis: int, tracks: TrackSet) -> int:
        """When the floor itself last told the motion across the axis: its features, or a line that was seen
        to keep its distance from another one, be it of the map or not."""
        lines = tracks.across_y if axis else tracks.across_x
        return max(tracks.features_ns[axis], self._beside[axis].told_ns(lines))

    def _carry(self, axis: int, tracks: TrackSet, dt_s: float) -> None:
        """Count how far the floor has carried the position on since a line of the map told it.  Once neither
        tells it, only a line of the map does again."""
        seen_ns, features_ns = self._seen_ns[axis], self._followed_ns(axis, tracks)
        if tracks.pads_ns - seen_ns < SEEN_NS:
            self._carried_m[axis] = 0.0
        elif tracks.stamp_ns - max(self._told_ns[axis], seen_ns) > _CARRIED_NS:
            self._carried_m[axis] = math.inf
        else:
            self._carried_m[axis] += max(math.hypot(tracks.vx_mps, tracks.vy_mps), _CREEP_MPS) * dt_s
        carries = seen_ns > 0 and self._carried_m[axis] < self._params.by_features_m
        told_ns = max(seen_ns, features_ns) if carries else seen_ns
        self._told_ns[axis] = max(self._told_ns[axis], told_ns)

    def _start(self, node: str) -> None:
        """Believe in the start node, and a little in every other, the less the further."""
        params, here = self._params, self._site.nodes[node]
        others = [
            (other, apart_m)
            for other, apart_m in self._nodes.nearest(here.x_m, here.y_m, params.most_places)
            if other.id != node
        ]
        odds = [params.carried / (1.0 + (apart_m / params.carried_m) ** 2) for _, apart_m in others]
        at_m = [(n.x_m, n.y_m) for n in (here, *(other for other, _ in others))]
        self._places.add(at_m, [1.0, *odds], params.start_sigma_m)
        self._places.best = 1

    def _match(self, axis: int, tracks: Sequence[TrackedLine], reach_m: float, due: bool) -> None:
        places = self._places
        newest_ns = max((track.seen_ns for track in tracks), default=0)
        in_view = {track.id: track for track in tracks if newest_ns - track.seen_ns < SEEN_NS}
        for track in sorted(tracks, key=lambda t: -t.seen_ns):
            if track.hits < _MIN_HITS:
                continue
            if not places.knows(axis, track.id):
                self._match_new(axis, track, in_view, reach_m)
                places.settle(axis, tracks)  # the next one is looked for from there
                if len(places) > _MOST_AT_ONCE * self._params.most_places:
                    places.thin(self._params.most_places)
            elif due and places.unmatched(axis, track.id):
                places.match(axis, track, in_view, reach_m, judge=False)
            if places.matched(axis, track.id)[places.best] >= 0:
                self._ever_matched[axis] = True
                self._seen_ns[axis] = max(self._seen_ns[axis], track.seen_ns)

    def _match_new(
        self, axis: int, track: TrackedLine, in_view: Mapping[int, TrackedLine], reach_m: float
    ) -> None:
        places, judged = self._places, self._judged[axis]
        at_m = float(places.at_m[places.best, axis]) + track.offset_m
        judge = all(abs(at_m - other) > 0.15 for other in judged)
        if judge:
            judged.append(at_m)
        places.match(axis, track, in_view, reach_m, judge)
        for other in in_view.values():
            beside = other is not track and abs(other.offset_m - track.offset_m) < BESIDE_M
            if beside and places.knows(axis, other.id):
                places.contest(axis, track, other)

    def _see(self, tracks: TrackSet, height_m: float) -> None:
        """Weigh the places by junctions that have become sure."""
        places = self._places
        sure_m = 1.5 * height_m * min(self._view.ahead, self._view.aside)
        here = places.at_m[places.best]
        for mark in self._marks.frame(
            tracks.junctions, float(here[0]), float(here[1]), sure_m, self._leave_m(height_m)
        ):
            self._weigh_mark(mark, tracks)
        for known, seen in self._fixes.markers(tracks.markers, float(here[0]), float(here[1])):
            self.marker((known.x_m, known.y_m), seen.x_m, seen.y_m)
        if sure := self._fixes.mat(tracks.pads, float(here[0]), float(here[1])):
            mat, mats_m = sure
            places.weigh(mat_likelihood(self._model, mats_m, places.at_m + np.array([mat.x_m, mat.y_m])))

    def _weigh_mark(self, mark: Landmark, tracks: TrackSet) -> None:
        places = self._places
        off_m = np.array([mark.x_m, mark.y_m]) - places.at_m[places.best]
        at_m = places.at_m + off_m
        if mark.arms.bit_count() == 1:
            axis, lines = (1, tracks.across_y) if mark.arms in _ENDS_ALONG_X else (0, tracks.across_x)
            strange = places.strange(axis, lines, float(off_m[axis]))
            factors = end_likelihood(self._model, self._paint.ends, at_m, mark.arms, strange)
        else:
            factors = crossing_likelihood(self._model, self._paint.crossings, at_m, mark.arms)
        places.weigh(factors)

    def _pass(self, tracks: TrackSet, height_m: float, dt_s: float) -> None:
        """Weigh what was passed and not seen, doubt, and believe in the likeliest place."""
        places, params = self._places, self._params
        lines_age_s = (tracks.stamp_ns - max(self._seen_ns)) * 1e-9
        if lines_age_s < 0.3 and height_m > 0.3:
            leave_m = self._leave_m(height_m)
            view_m = self._view_m(tracks.yaw_rad, height_m)
            for axis in (0, 1):
                places.weigh(places.pass_by(axis, view_m[axis], leave_m, params.due_s, dt_s))
            here = places.at_m[places.best]
            for axis, lines in enumerate((tracks.across_x, tracks.across_y)):
                grown_m = self._runs[axis].grown_m(lines, float(here[1 - axis]), tracks.stamp_ns)
                for track, more_m in grown_m.items():
                    if places.knows(axis, track):
                        places.goes_on(axis, track, more_m)
            ends = [(m.x_m, m.y_m) for m in self._marks.marks if m.arms.bit_count() == 1]
            seen = np.array(ends, dtype=float).reshape(-1, 2) - here
            places.weigh(places.pass_ends(seen, min(view_m), leave_m, 2 * params.due_s, dt_s))
            for axis in (0, 1):
                near = float(here[axis])
                self._judged[axis][:] = [at for at in self._judged[axis] if abs(at - near) < leave_m]
        self._gap |= max(self._seen_ns) > 0 and lines_age_s > _GAP_S
        if self._gap and lines_age_s < 0.3:
            self._gap = False
            self._leak(params.slip_in_gap)
        self._believe()
        places.thin(params.most_places)

    def _view_m(self, yaw_rad: float, height_m: float) -> tuple[float, float]:
        """How far the picture surely reaches along x and along y."""
        ahead, aside = self._view.ahead * height_m, self._view.aside * height_m
        c, s = abs(math.cos(yaw_rad)) + 1e-6, abs(math.sin(yaw_rad)) + 1e-6
        return min(ahead / c, aside / s), min(ahead / s, aside / c)

    def _leave_m(self, height_m: float) -> float:
        return 1.5 * height_m + 0.5

    def _believe(self) -> None:
        """Follow the likeliest place, and leak weight to the neighbours of each new node."""
        places = self._places
        likeliest = 1 + int(places.weights[1:].argmax())
        if places.weights[likeliest] > _SWITCH * places.weights[places.best]:
            jump = places.at_m[likeliest] - places.at_m[places.best]
            self._marks.shift(float(jump[0]), float(jump[1]))
            self._fixes.shift(float(jump[0]), float(jump[1]))
            for axis in (0, 1):
                self._judged[axis][:] = [at + float(jump[axis]) for at in self._judged[axis]]
            places.best = likeliest
            self.corrections += 1
        here = places.at_m[places.best]
        node = self._nodes.node(float(here[0]), float(here[1])).id
        if node != self._node:
            self._node = node
            self._leak(self._params.slip)

    def _leak(self, share: float) -> None:
        places, nodes = self._places, self._site.nodes
        here, node = places.at_m[places.best], nodes[self._node]
        weight = share * float(places.weights[places.best])
        at_m = [
            (float(here[0]) + nodes[other].x_m - node.x_m, float(here[1]) + nodes[other].y_m - node.y_m)
            for other in self._site.neighbours(self._node)
        ]
        places.doubt(self._params.elsewhere, _OTHER_FLOOR)
        places.add(at_m, [weight] * len(at_m), max(0.05, float(places.sigma_m[places.best].max())))

    def _fix(self, x_m: float, y_m: float, sigma_m: float) -> None:
        """The drone is at this map point, says something that has a known place."""
        places = self._places
        places.add([(x_m, y_m)], [self._params.slip], sigma_m)
        error_m = np.hypot(places.at_m[:, 0] - x_m, places.at_m[:, 1] - y_m)
        places.weigh(fix_likelihood(self._model, error_m, sigma_m))
        self._believe()

    # What is told

    def _pose(self, tracks: TrackSet, height_m: float) -> GridPose:
        places = self._places
        x, y = (float(v) for v in places.at_m[places.best])
        sx, sy = (float(v) for v in places.sigma_m[places.best])
        told_x_m, told_y_m = places.spread(_CELL_M, _LEAST)
        node = self._nodes.node(x, y)
        near = np.abs(places.at_m - places.at_m[places.best]).max(axis=1) < _CELL_M
        same = float(places.weights[near].sum())
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
            covariance=(told_x_m**2, 0.0, 0.0, 0.0, told_y_m**2, 0.0, 0.0, 0.0, tracks.yaw_sigma_rad**2),
            integrity=same * self._nodes.inside(node.id, sx, sy),
        )
