"""The places where the drone may be, each with its own position, line identities and weight.

A place is one discrete hypothesis ("I am where I think", "one node further along x", ...).  All move by
the same odometry, but each matches the tracked lines to the map by itself and takes its position from
its own matches, so that none drifts.  Row 0 stands for everywhere else: it matches nothing and never
moves into the map.  Arrays have N rows, one for each place.  Weights are held jointly with the C states that
the floor may be in: one floor lies below all places, but each makes another of it.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence

import numpy as np

from flightd.core.geometry import Matrix
from flightd.core.tracks import TrackedLine
from flightd.localisation.observation_model import Flags, Indices, SensorModel, line_density
from flightd.site.painted_lines import AxisLines, PaintMap

_FAR_M = 1e7
_CARRIED_MPS, _CARRIED_SHARE = 0.03, 0.04
"""Least growth of a position's sigma while features of the floor tell the motion: what they err by stays, and
a wrong height adds its share."""
_RIVAL = 0.01
"""Another map line is considered too where it explains the track so well, against the nearest one."""
_MATCH_SIGMAS = 4.0
_MATCH_SLACK_M = 0.06
_SURVEY_SIGMA_M = 0.01
_DOUBT_SIGMAS, _DOUBT_M = 2.0, 0.08
"""A match that moves a place by more, of both, or by `_SAME_M` is in doubt, and so is any where the place is
not known better than that."""
_SAME_M = 0.2
_LEAST_M = 0.05
"""Places are one that are closer than either is known in both axes, but at least so close and not further
apart than `_SAME_M`, once no line in view is another one there."""
_NEGLIGIBLE, _TINY = 1e-7, 1e-300
_ALIKE_M = 0.05
_UNMATCHED, _FALSE = -1, -2
"""Instead of a map line: none fits yet, or this place holds the track to be no line of the map."""


class Places:
    """A discrete probability over places and states of the floor, which sums to 1."""

    def __init__(self, paint: PaintMap, model: SensorModel, elsewhere: float) -> None:
        """None is thought of yet, and `elsewhere` is the weight of that they all are wrong against those
        that are `add`ed first."""
        self._paint = paint
        self._model = model
        self.at_m: Matrix = np.full((1, 2), _FAR_M)
        self.sigma_m: Matrix = np.ones((1, 2))
        self._joint: Matrix = elsewhere * model.floor_prior[None, :]
        self._matches: tuple[dict[int, Indices], dict[int, Indices]] = ({}, {})
        self._found: tuple[dict[int, Matrix], dict[int, Matrix]] = ({}, {})
        """(N, 2) how far from each track its line was expected when it was matched, and sigma of that."""
        self._known: list[Flags] = [np.zeros((1, len(a.at_m)), dtype=bool) for a in paint.axes]
        self._missed: list[Flags] = [np.zeros((1, len(a.at_m)), dtype=bool) for a in paint.axes]
        self._dwell_s: list[Matrix] = [np.zeros((1, len(a.at_m))) for a in paint.axes]
        self._ends_done: Flags = np.zeros((1, len(paint.ends.line)), dtype=bool)
        self._ends_dwell_s: Matrix = np.zeros((1, len(paint.ends.line)))
        self.best = 0

    def __len__(self) -> int:
        return len(self._joint)

    @property
    def weights(self) -> Matrix:
        """(N) the probability of each place."""
        weights: Matrix = self._joint.sum(axis=1)
        return weights

    @property
    def floor(self) -> Matrix:
        """(C) the probability of each state of the floor where the likeliest place is the true one."""
        here: Matrix = self._joint[self.best]
        total = float(here.sum())
        return here / total if total > _TINY else self._model.floor_prior

    def matched(self, axis: int, track_id: int) -> Indices:
        """(N) indices of the map lines that the track is, negative where it is none."""
        return self._matches[axis][track_id]

    def knows(self, axis: int, track_id: int) -> bool:
        """Whether the track was given to `match`."""
        return track_id in self._matches[axis]

    def lines(self, axis: int) -> dict[int, int]:
        """The map line of each track at the likeliest place, negative where it is none."""
        return {track: int(index[self.best]) for track, index in self._matches[axis].items()}

    def agreed(self, axis: int, tracks: Collection[int]) -> dict[int, float]:
        """How likely each of these tracks is a map line as far from the drone as at the likeliest place."""
        if not tracks:
            return {}
        index = np.stack([self._matches[axis][track] for track in tracks])
        off_m = self._lines_m(axis, index) - self.at_m[:, axis]
        agree = (index >= 0) & (np.abs(off_m - off_m[:, [self.best]]) < _ALIKE_M)
        return dict(zip(tracks, (agree @ self.weights).tolist(), strict=True))

    def _lines_m(self, axis: int, index: Indices) -> Matrix:
        """Where these map lines are, of any where the index says that there is none."""
        at_m = self._paint.axes[axis].at_m
        return at_m[np.maximum(index, 0)] if len(at_m) else np.zeros(index.shape)

    def unmatched(self, axis: int, track_id: int) -> bool:
        """Whether at some place the track may still turn out to be a map line."""
        return bool((self._matches[axis][track_id][1:] == _UNMATCHED).any())

    def strange(self, axis: int, tracks: Sequence[TrackedLine], offset_m: float) -> Flags:
        """(N) where what is tracked `offset_m` from the drone is no line of the map."""
        flags: Flags = np.zeros(len(self), dtype=bool)
        flags[0] = True
        for track in tracks:
            if track.id in self._matches[axis] and abs(track.offset_m - offset_m) < _SAME_M:
                flags |= self._matches[axis][track.id] < 0
        return flags

    # Motion

    def move(
        self, axis: int, velocity_mps: float, sigma_mps: float, dt_s: float, *, carried: bool = False
    ) -> None:
        """Carry all places on by the odometry.  Its error lasts (a wind, a lean that is told wrong), so
        sigmas add up; while features of the floor have `carried` it, no better than those are."""
        self.at_m[1:, axis] += velocity_mps * dt_s
        least_mps = _CARRIED_MPS + _CARRIED_SHARE * abs(velocity_mps) if carried else 0.0
        self.sigma_m[:, axis] += max(sigma_mps, least_mps) * dt_s

    def settle(self, axis: int, tracks: Sequence[TrackedLine]) -> None:
        """Take each place's position from the lines that it has matched; forget tracks that are gone."""
        held = {track.id: track for track in tracks}
        matches = self._matches[axis]
        for gone in [id_ for id_ in matches if id_ not in held]:
            del matches[gone], self._found[axis][gone]
        if not matches:
            return
        weight: Matrix = np.zeros(len(self))
        total: Matrix = np.zeros(len(self))
        for id_, index in matches.items():
            track = held[id_]
            told = 1.0 / (track.sigma_m**2 + _SURVEY_SIGMA_M**2)
            share = np.where(index >= 0, told, 0.0)
            weight += share
            total += share * (self._lines_m(axis, index) - track.offset_m)
        there = (weight > 0.0).nonzero()[0]
        weight = weight[there]
        self.at_m[there, axis] = total[there] / weight
        self.sigma_m[there, axis] = weight**-0.5

    # Evidence

    def weigh(self, factors: Matrix) -> None:
        """Bayes: multiply the likelihoods (N, C or 1) in and normalise."""
        self._joint = self._joint * factors
        self._joint /= self._joint.sum()

    def doubt(self, weight: float, other_floor: float) -> None:
        """Give elsewhere so much more, and with the probability `other_floor` let it be any floor from here
        on."""
        self._joint += other_floor * (self.weights[:, None] * self._model.floor_prior - self._joint)
        self._joint[0] += weight * self._model.floor_prior
        self._joint /= self._joint.sum()

    def match(
        self, axis: int, track: TrackedLine, beside: Collection[int], reach_m: float, judge: bool
    ) -> None:
        """Say at each place which painted line the track is; `judge` also weighs the places by it.  What the
        tracks `beside` it, in view now, are it is not.

        A match of a place that is badly known, or that moves it further than expected, is in doubt: the line
        may be a false one, beside the true one or instead of it, or another one of the map.  Beside the place
        that is moved to the nearest line one is kept for each."""
        lines = self._paint.axes[axis]
        matches = self._matches[axis]
        index = matches.setdefault(track.id, np.full(len(self), _UNMATCHED, dtype=np.int64))
        self._found[axis].setdefault(track.id, np.ones((len(self), 2)))
        if not len(lines.at_m):
            return
        residual = lines.at_m[None, :] - (self.at_m[:, axis, None] + track.offset_m)
        covered = self._covered(axis, lines, track, reach_m)
        sigma = np.hypot(self.sigma_m[:, axis], track.sigma_m)
        rows = np.arange(len(self))
        apart = np.where(covered, np.abs(residual), np.inf)
        best = apart.argmin(axis=1)
        found = apart[rows, best]
        other = np.abs(lines.at_m[None, :] - lines.at_m[best][:, None])
        fits = (index == _UNMATCHED) & (found <= _MATCH_SIGMAS * sigma + _MATCH_SLACK_M)
        if not (judge or fits.any()):
            return
        taken = np.zeros((len(self), len(lines.at_m)), dtype=bool)
        seen = taken.copy()
        for id_, already in matches.items():
            if id_ != track.id:
                held = (already >= 0)[:, None] & (
                    self._lines_m(axis, already)[:, None] == lines.at_m[None, :]
                )
                taken |= held
                if id_ in beside:
                    seen |= held
        new = fits & ~taken[rows, best]
        model = self._model
        density = line_density(model, residual, sigma, covered & ~seen)
        told = model.line_seen * density.max(axis=1)[:, None] + model.false_line_per_m
        if judge:
            again = self._missed[axis][rows, best] & (found < _SAME_M)
            factors = np.where(again[:, None], told / (1.0 - model.line_seen), told)
            factors[0] = model.elsewhere_line_per_m
            self.weigh(factors)
        expected = np.clip(_DOUBT_SIGMAS * sigma, _DOUBT_M, _SAME_M)
        doubted = (found > expected) | (_DOUBT_SIGMAS * sigma > _SAME_M)
        moved = np.flatnonzero(new & doubted & (self.weights > _NEGLIGIBLE))
        index[new] = best[new]
        self._found[axis][track.id][new] = np.stack([residual[rows, best], sigma], axis=1)[new]
        self._known[axis][new] |= other[new] <= 1e-6  # every piece of that line
        if not len(moved):
            return
        rival = np.where((other > 1e-6) & ~taken, density, 0.0)[moved]
        share = model.line_seen * rival[:, :, None] / told[moved][:, None, :]
        share[share.max(axis=2) < _RIVAL] = 0.0
        if not judge:  # it was weighed before, as a line that is none of the map
            self._joint[moved] /= 1.0 + share.sum(axis=1)
        self._branch(axis, track.id, moved, model.false_line_per_m / told[moved], share)

    def _branch(self, axis: int, track_id: int, rows: Indices, false: Matrix, rival: Matrix) -> None:
        """Beside each of these places put its like to which the line just matched is none of the map, with
        the share `false` (M, C) of its weight, and for each line whose share `rival` (M, L, C) is not 0 one
        to which it is that line."""
        at_m = self._paint.axes[axis].at_m
        also, others = np.nonzero(rival.any(axis=2))
        size, parents = len(self), np.concatenate([rows, rows[also]])
        shares = np.concatenate([false, rival[also, others]])
        lines = np.concatenate([np.full(len(rows), _FALSE), others])
        first = self._matches[axis][track_id][parents]
        known = self._known[axis][parents] & (at_m[None, :] != self._lines_m(axis, first)[:, None])
        known |= (lines >= 0)[:, None] & (at_m[None, :] == self._lines_m(axis, lines)[:, None])
        weights = self._joint[parents] * shares
        self._joint[rows] *= 1.0 - false
        self._take(np.concatenate([np.arange(size), parents]))
        self._joint[size:] = weights
        self._matches[axis][track_id][size:] = lines
        beyond = self._lines_m(axis, lines) - self._lines_m(axis, first)
        self._found[axis][track_id][size:, 0] += np.where(lines >= 0, beyond, 0.0)
        self._known[axis][size:] = known
        self._joint /= self._joint.sum()

    def goes_on(self, axis: int, track_id: int, more_m: float) -> None:
        """So much more of the track has come into view."""
        strange = self._matches[axis][track_id] < 0
        self.weigh(np.where(strange, math.exp(-more_m / self._model.strange_run_m), 1.0)[:, None])

    def contest(self, axis: int, track: TrackedLine, other: TrackedLine) -> None:
        """Of two lines close beside each other, both in view, one is the map's: where it is `other`, which
        was seen first, put beside the place its like to which it is the `track`, by how well either was where
        it was expected then."""
        matches = self._matches[axis]
        mine, its = matches[track.id], matches[other.id]
        rows = np.flatnonzero((mine < 0) & (its >= 0) & (self.weights > _NEGLIGIBLE))
        if not len(rows):
            return
        residual, sigma = self._found[axis][other.id][rows].T
        residuals = np.stack([residual, residual + other.offset_m - track.offset_m], axis=1)
        told = line_density(self._model, residuals, sigma, np.ones(residuals.shape, dtype=bool))
        share = (told[:, 1] / told.sum(axis=1))[:, None]
        size, lines, joint = len(self), its[rows], self._joint[rows] * share
        self._joint[rows] *= 1.0 - share
        self._take(np.concatenate([np.arange(size), rows]))
        self._joint[size:] = joint
        matches[track.id][size:], matches[other.id][size:] = lines, _FALSE
        self._found[axis][track.id][size:] = np.stack([residuals[:, 1], sigma], axis=1)

    def part(self, axis: int, track: TrackedLine, other: TrackedLine) -> None:
        """The two are surely two lines: where one is the map's the other is none, unless the map has another
        one nearer to where it lies.  However long the first is out of sight, or its paint gone: the other one
        does not become it."""
        at_m = self._paint.axes[axis].at_m
        for one, its in ((track, other), (other, track)):
            mine, theirs = self._matches[axis][one.id], self._matches[axis][its.id]
            rows = np.flatnonzero((mine == _UNMATCHED) & (theirs >= 0))
            if not len(rows):
                continue
            line_m = at_m[theirs[rows]]
            lies_m = line_m + one.offset_m - its.offset_m
            nearest = np.abs(lies_m[:, None] - at_m[None, :]).argmin(axis=1)
            mine[rows[at_m[nearest] == line_m]] = _FALSE

    def spread(self, within_m: float, least: float) -> tuple[float, float]:
        """Sigmas of x and y at the likeliest place, with what the others within so much of it, `least` likely
        or more, differ: it may be any of them."""
        off_m = self.at_m - self.at_m[self.best]
        near = (np.abs(off_m).max(axis=1) < within_m) & (self.weights >= least)
        weights = np.where(near, self.weights, 0.0)
        among = weights @ np.where(near[:, None], off_m, 0.0) ** 2 / max(float(weights.sum()), _TINY)
        x_m, y_m = np.sqrt(self.sigma_m[self.best] ** 2 + among).tolist()
        return x_m, y_m

    def _covered(self, axis: int, lines: AxisLines, track: TrackedLine, reach_m: float) -> Flags:
        """(N, L): the map line has paint where the track was seen; by the drone's own place and `reach_m`
        when the visible part is not known."""
        here = self.at_m[:, 1 - axis, None]
        seen_m = track.to_m - track.from_m
        if seen_m <= 0.0:
            near: Flags = (here >= lines.from_m - reach_m) & (here <= lines.to_m + reach_m)
            return near
        shared = np.minimum(here + track.to_m, lines.to_m) - np.maximum(here + track.from_m, lines.from_m)
        enough: Flags = shared >= 0.5 * seen_m
        return enough

    def pass_by(self, axis: int, sure_m: float, leave_m: float, due_s: float, dt_s: float) -> Matrix:
        """Factors (N) of the painted lines that have been within `sure_m` for `due_s` and were not seen;
        each counts once until it is more than `leave_m` away."""
        lines = self._paint.axes[axis]
        away = np.abs(lines.at_m[None, :] - self.at_m[:, axis, None])
        other = self.at_m[:, 1 - axis, None]
        margin = 0.15
        inside = (away < sure_m) & (other > lines.from_m + margin) & (other < lines.to_m - margin)
        known, missed, dwell = self._known[axis], self._missed[axis], self._dwell_s[axis]
        dwell += inside * dt_s
        new = (dwell > due_s) & ~known & ~missed
        missed |= new
        gone = away > leave_m
        known &= ~gone
        missed &= ~gone
        dwell[gone] = 0.0
        factors: Matrix = (1.0 - self._model.line_seen) ** new.sum(axis=1, keepdims=True)
        return factors

    def pass_ends(self, seen_m: Matrix, sure_m: float, leave_m: float, due_s: float, dt_s: float) -> Matrix:
        """The same for ends of lines that are seen themselves; `seen_m` (K, 2) are the ends seen, from
        the drone."""
        ends = self._paint.ends
        dx = ends.at_m[:, 0] - self.at_m[:, 0, None]
        dy = ends.at_m[:, 1] - self.at_m[:, 1, None]
        near: Flags = (np.abs(dx) < leave_m) & (np.abs(dy) < leave_m)
        self._ends_done &= near
        self._ends_dwell_s[~near] = 0.0
        row, end = np.nonzero(near)  # few: the rest is done on these pairs alone
        off_m = np.stack([dx[row, end], dy[row, end]], axis=1)
        tracked: Flags = np.zeros(len(row), dtype=bool)
        for axis in (0, 1):
            for index in self._matches[axis].values():
                tracked |= (ends.axis[end] == axis) & (ends.line[end] == index[row])
        sure = np.abs(off_m).max(axis=1, initial=0.0) < sure_m
        dwell_s = self._ends_dwell_s[row, end] + (tracked & sure) * dt_s
        self._ends_dwell_s[row, end] = dwell_s
        done = self._ends_done[row, end]
        for seen in seen_m:
            done |= np.abs(off_m - seen).max(axis=1, initial=0.0) < self._model.feature_gate_m
        new = (dwell_s > due_s) & ~done
        self._ends_done[row, end] = done | new
        overlooked = np.bincount(row[new], minlength=len(self)).astype(np.float64)
        factors: Matrix = np.power(1.0 - self._model.end_found, overlooked[:, None])
        return factors

    # Which places there are

    def add(self, at_m: Sequence[tuple[float, float]], weights: Sequence[float], sigma_m: float) -> None:
        """Consider these places too, of the floor as it looks from the likeliest; a place that is there
        already gains the weight."""
        fresh_at, fresh_weights, floor = [], [], self.floor
        for point, weight in zip(at_m, weights, strict=True):
            apart = np.abs(self.at_m - point).max(axis=1)
            near = int(apart.argmin())
            if apart[near] < _SAME_M:
                self._joint[near] += weight * floor
            else:
                fresh_at.append(point)
                fresh_weights.append(weight)
        if fresh_at:
            self._grow(np.array(fresh_at), np.array(fresh_weights)[:, None] * floor, sigma_m)
        self._joint /= self._joint.sum()

    def _grow(self, at_m: Matrix, joint: Matrix, sigma_m: float) -> None:
        count = len(joint)
        self.at_m = np.concatenate([self.at_m, at_m])
        self.sigma_m = np.concatenate([self.sigma_m, np.full((count, 2), sigma_m)])
        self._joint = np.concatenate([self._joint, joint])
        for matches in self._matches:
            for id_, index in matches.items():
                matches[id_] = np.concatenate([index, np.full(count, _UNMATCHED, dtype=np.int64)])
        for found in self._found:
            for id_, residual in found.items():
                found[id_] = np.concatenate([residual, np.ones((count, 2))])
        for axis in (0, 1):
            width = self._known[axis].shape[1]
            # what is in view now was not watched from here: neither seen nor missed yet
            self._known[axis] = np.concatenate([self._known[axis], np.zeros((count, width), dtype=bool)])
            self._missed[axis] = np.concatenate([self._missed[axis], np.zeros((count, width), dtype=bool)])
            self._dwell_s[axis] = np.concatenate([self._dwell_s[axis], np.zeros((count, width))])
        ends = self._ends_done.shape[1]
        self._ends_done = np.concatenate([self._ends_done, np.zeros((count, ends), dtype=bool)])
        self._ends_dwell_s = np.concatenate([self._ends_dwell_s, np.zeros((count, ends))])

    def thin(self, most: int) -> None:
        """Join places that have become one, drop the negligible and all but the `most` likeliest."""
        weights = self.weights
        keep: Flags = weights >= _NEGLIGIBLE
        if np.count_nonzero(keep) > most:
            keep &= weights >= np.partition(weights, -most)[-most]
        self._keep(keep)
        reach_m = np.clip(_DOUBT_SIGMAS * self.sigma_m, _LEAST_M, _SAME_M)
        near = np.abs(self.at_m[:, None, :] - self.at_m[None, :, :]) < reach_m[:, None, :]
        close: Flags = near[:, :, 0] & near[:, :, 1]
        close |= close.T  # by whichever is known worse: else an unlikely one would swallow a likelier
        if np.count_nonzero(close) > len(self):
            close &= self._alike()
        if np.count_nonzero(close) > len(self):
            keep = np.ones(len(self), dtype=bool)
            for row in np.argsort(-self.weights):
                if keep[row] and row:
                    twins = close[row] & keep
                    twins[row] = False
                    self._joint[row] += self._joint[twins].sum(axis=0)
                    if twins[self.best]:
                        self.best = int(row)
                    keep &= ~twins
            self._keep(keep)
        self._joint /= self._joint.sum()

    def _alike(self) -> Flags:
        """(N, N) no track is one line at the one place and another one, or none, at the other."""
        alike: Flags = np.ones((len(self), len(self)), dtype=bool)
        for matches in self._matches:
            for index in matches.values():
                known = index != _UNMATCHED
                alike[(index[:, None] != index[None, :]) & known[:, None] & known[None, :]] = False
        return alike

    def _keep(self, keep: Flags) -> None:
        """Drop the other places, but neither elsewhere nor the best one."""
        keep[[0, self.best]] = True
        if not keep.all():
            self.best = int(np.count_nonzero(keep[: self.best]))
            self._take(np.flatnonzero(keep))

    def _take(self, rows: Indices) -> None:
        self.at_m, self.sigma_m, self._joint = self.at_m[rows], self.sigma_m[rows], self._joint[rows]
        for matches in self._matches:
            for id_, index in matches.items():
                matches[id_] = index[rows]
        for found in self._found:
            for id_, residual in found.items():
                found[id_] = residual[rows]
        for axis in (0, 1):
            self._known[axis] = self._known[axis][rows]
            self._missed[axis] = self._missed[axis][rows]
            self._dwell_s[axis] = self._dwell_s[axis][rows]
        self._ends_done, self._ends_dwell_s = self._ends_done[rows], self._ends_dwell_s[rows]
