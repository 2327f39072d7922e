"""The places where the drone may be, each with its own position, line identities and weight.

A place is one discrete hypothesis ("I am where I think", "one node further along x", ...).  All move by
the same odometry, but each matches the tracked lines to the map by itself and takes its position from
its own matches, so that none drifts.  Row 0 stands for everywhere else: it matches nothing and never
moves into the map.  Arrays have N rows, one for each place.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flightd.core.geometry import Matrix
from flightd.core.tracks import TrackedLine
from flightd.localisation.observation_model import Flags, Indices, SensorModel, line_density
from flightd.site.painted_lines import AxisLines, PaintMap

_FAR_M = 1e7
_DRIFT_MPS, _CARRIED_MPS, _CARRIED_SHARE = 0.15, 0.03, 0.04
"""Growth of a position's sigma while no line is seen, and while features of the floor tell the motion, to
which a wrong height adds its share."""
_RIVAL = 0.01
"""Another map line is considered too where it explains the track so well, against the nearest one."""
_MATCH_SIGMAS = 4.0
_MATCH_SLACK_M = 0.06
_SURVEY_SIGMA_M = 0.01
_FRESH_S = 0.3
"""A line seen so recently counts as seen: pictures come late and now and then without a line."""
_SAME_M = 0.2
"""Places closer than this in both axes are one."""
_NEGLIGIBLE = 1e-7
_UNMATCHED, _FALSE = -1, -2
"""Instead of a map line: none fits yet, or this place holds the track to be no line of the map."""


class Places:
    """A discrete probability over places; `weights` sum to 1."""

    def __init__(self, paint: PaintMap, model: SensorModel) -> None:
        self._paint = paint
        self._model = model
        self.at_m: Matrix = np.full((1, 2), _FAR_M)
        self.sigma_m: Matrix = np.ones((1, 2))
        self.weights: Matrix = np.ones(1)
        self._matches: tuple[dict[int, Indices], dict[int, Indices]] = ({}, {})
        self._known: list[Flags] = [np.zeros((1, len(a.at_m)), dtype=bool) for a in paint.axes]
        self._missed: list[Flags] = [np.zeros((1, len(a.at_m)), dtype=bool) for a in paint.axes]
        self._dwell_s: list[Matrix] = [np.zeros((1, len(a.at_m))) for a in paint.axes]
        self._ends_done: Flags = np.zeros((1, len(paint.ends.line)), dtype=bool)
        self._ends_dwell_s: Matrix = np.zeros((1, len(paint.ends.line)))
        self.best = 0

    def __len__(self) -> int:
        return len(self.weights)

    def matched(self, axis: int, track_id: int) -> Indices:
        """(N) indices of the map lines that the track is, negative where it is none."""
        return self._matches[axis][track_id]

    def lines(self, axis: int) -> dict[int, int]:
        """The map line of each track at the likeliest place, negative where it is none."""
        return {track: int(index[self.best]) for track, index in self._matches[axis].items()}

    def unmatched(self, axis: int, track_id: int) -> bool:
        """Whether at some place the track may still turn out to be a map line."""
        return bool((self._matches[axis][track_id][1:] == _UNMATCHED).any())

    def strange(self, axis: int, tracks: Sequence[TrackedLine], offset_m: float) -> Flags:
        """(N) where what is tracked `offset_m` from the drone is no line of the map."""
        flags: Flags = np.zeros(len(self), dtype=bool)
        for track in tracks:
            if track.id in self._matches[axis] and abs(track.offset_m - offset_m) < _SAME_M:
                flags |= self._matches[axis][track.id] < 0
        return flags

    # Motion

    def move(self, axis: int, velocity_mps: float, dt_s: float, *, carried: bool = False) -> None:
        """Carry all places on by the odometry, which is better while features of the floor have `carried`
        it."""
        self.at_m[1:, axis] += velocity_mps * dt_s
        carried_mps = _CARRIED_MPS + _CARRIED_SHARE * abs(velocity_mps)
        self.sigma_m[:, axis] += (carried_mps if carried else _DRIFT_MPS) * dt_s

    def settle(self, axis: int, tracks: Sequence[TrackedLine], now_ns: int, carried_ns: int = 0) -> None:
        """Take each place's position from the lines that it has matched; forget tracks that are gone.  Until
        `carried_ns` features of the floor have told where lines out of sight are."""
        held = {track.id: track for track in tracks}
        matches = self._matches[axis]
        for gone in [id_ for id_ in matches if id_ not in held]:
            del matches[gone]
        if not matches:
            return
        lines = self._paint.axes[axis].at_m
        weight: Matrix = np.zeros(len(self))
        total: Matrix = np.zeros(len(self))
        for id_, index in matches.items():
            track = held[id_]
            told_ns = max(track.seen_ns, carried_ns)
            unseen_m = _DRIFT_MPS * max((now_ns - told_ns) * 1e-9 - _FRESH_S, 0.0)
            told = 1.0 / (track.sigma_m**2 + _SURVEY_SIGMA_M**2 + unseen_m**2)
            share = np.where(index >= 0, told, 0.0)
            weight += share
            total += share * (lines[index] - track.offset_m)
        there = (weight > 0.0).nonzero()[0]
        weight = weight[there]
        self.at_m[there, axis] = total[there] / weight
        self.sigma_m[there, axis] = weight**-0.5

    # Evidence

    def weigh(self, factors: Matrix) -> None:
        """Bayes: multiply the likelihoods in and normalise."""
        self.weights = self.weights * factors
        self.weights /= self.weights.sum()

    def match(self, axis: int, track: TrackedLine, reach_m: float, judge: bool) -> None:
        """Say at each place which painted line the track is; `judge` also weighs the places by it.

        A match that moves a place by more than `_SAME_M` is in doubt: the line may be a false one, or the
        next of the map.  Beside the place that is moved to the nearest line one is kept for either."""
        lines = self._paint.axes[axis]
        matches = self._matches[axis]
        index = matches.setdefault(track.id, np.full(len(self), _UNMATCHED, dtype=np.int64))
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
        gate = _MATCH_SIGMAS * sigma + _MATCH_SLACK_M
        taken = np.zeros((len(self), len(lines.at_m)), dtype=bool)
        for id_, already in matches.items():
            if id_ != track.id:
                taken |= (already >= 0)[:, None] & (lines.at_m[already][:, None] == lines.at_m[None, :])
        new = (index == _UNMATCHED) & (found <= gate) & ~taken[rows, best]
        if not (judge or new.any()):
            return
        density = line_density(self._model, residual, sigma, covered)
        told = density.max(axis=1) + self._model.false_line_per_m
        if judge:
            again = self._missed[axis][rows, best] & (found < _SAME_M)
            factors = np.where(again, told / (1.0 - self._model.line_seen), told)
            factors[0] = self._model.elsewhere_line_per_m
            self.weigh(factors)
        moved = np.flatnonzero(new & (found > _SAME_M) & (self.weights > _NEGLIGIBLE))
        index[new] = best[new]
        self._known[axis][new] |= other[new] <= 1e-6  # every piece of that line
        if not len(moved):
            return
        rival = np.where(other > 1e-6, density, 0.0)[moved]
        second = rival.argmax(axis=1)
        share = rival[np.arange(len(moved)), second] / told[moved]
        share[taken[moved, second] | (share < _RIVAL)] = 0.0
        self._branch(axis, track.id, moved, self._model.false_line_per_m / told[moved], second, share)

    def _branch(
        self, axis: int, track_id: int, rows: Indices, false: Matrix, second: Indices, rival: Matrix
    ) -> None:
        """Beside each of these places put its like to which the line just matched is none of the map, with
        the share `false` of its weight, and where `rival` is not 0 one to which it is the line `second`."""
        at_m = self._paint.axes[axis].at_m
        also = np.flatnonzero(rival)
        size, parents = len(self), np.concatenate([rows, rows[also]])
        shares = np.concatenate([false, rival[also]])
        lines = np.concatenate([np.full(len(rows), _FALSE), second[also]])
        first = self._matches[axis][track_id][parents]
        known = self._known[axis][parents] & (at_m[None, :] != at_m[first][:, None])
        known |= (lines >= 0)[:, None] & (at_m[None, :] == at_m[lines][:, None])
        weights = self.weights[parents] * shares
        self.weights[rows] *= 1.0 - false
        self._take(np.concatenate([np.arange(size), parents]))
        self.weights[size:] = weights
        self._matches[axis][track_id][size:] = lines
        self._known[axis][size:] = known
        self.weights /= self.weights.sum()

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
        factors: Matrix = (1.0 - self._model.line_seen) ** new.sum(axis=1)
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
        factors: Matrix = np.power(1.0 - self._model.end_found, overlooked)
        return factors

    # Which places there are

    def add(self, at_m: Sequence[tuple[float, float]], weights: Sequence[float], sigma_m: float) -> None:
        """Consider these places too; a place that is there already gains the weight."""
        fresh_at, fresh_weights = [], []
        for point, weight in zip(at_m, weights, strict=True):
            apart = np.abs(self.at_m - point).max(axis=1)
            near = int(apart.argmin())
            if apart[near] < _SAME_M:
                self.weights[near] += weight
            else:
                fresh_at.append(point)
                fresh_weights.append(weight)
        if fresh_at:
            self._grow(np.array(fresh_at), np.array(fresh_weights), sigma_m)
        self.weights /= self.weights.sum()

    def _grow(self, at_m: Matrix, weights: Matrix, sigma_m: float) -> None:
        count = len(weights)
        self.at_m = np.concatenate([self.at_m, at_m])
        self.sigma_m = np.concatenate([self.sigma_m, np.full((count, 2), sigma_m)])
        self.weights = np.concatenate([self.weights, weights])
        for matches in self._matches:
            for id_, index in matches.items():
                matches[id_] = np.concatenate([index, np.full(count, _UNMATCHED, dtype=np.int64)])
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
        keep: Flags = self.weights >= _NEGLIGIBLE
        if np.count_nonzero(keep) > most:
            keep &= self.weights >= np.partition(self.weights, -most)[-most]
        self._keep(keep)
        close = np.abs(self.at_m[:, None, :] - self.at_m[None, :, :]).max(axis=2) < _SAME_M
        if np.count_nonzero(close) > len(self):
            keep = np.ones(len(self), dtype=bool)
            for row in np.argsort(-self.weights):
                if keep[row] and row:
                    twins = close[row] & keep
                    twins[row] = False
                    self.weights[row] += self.weights[twins].sum()
                    if twins[self.best]:
                        self.best = int(row)
                    keep &= ~twins
            self._keep(keep)
        self.weights /= self.weights.sum()

    def _keep(self, keep: Flags) -> None:
        """Drop the other places, but neither elsewhere nor the best one."""
        keep[[0, self.best]] = True
        if not keep.all():
            self.best = int(np.count_nonzero(keep[: self.best]))
            self._take(np.flatnonzero(keep))

    def _take(self, rows: Indices) -> None:
        self.at_m, self.sigma_m, self.weights = self.at_m[rows], self.sigma_m[rows], self.weights[rows]
        for matches in self._matches:
            for id_, index in matches.items():
                matches[id_] = index[rows]
        for axis in (0, 1):
            self._known[axis] = self._known[axis][rows]
            self._missed[axis] = self._missed[axis][rows]
            self._dwell_s[axis] = self._dwell_s[axis][rows]
        self._ends_done, self._ends_dwell_s = self._ends_done[rows], self._ends_dwell_s[rows]
