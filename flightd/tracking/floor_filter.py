"""One Kalman filter for the drone's motion over the lines and for what it does not know of its own sensors.

Its state, and how that goes on, is the `motion_model`.  What is wrong with the told attitude shows twice,
in the acceleration and in the picture; what is wrong with the mount shows in the picture alone; a wrong delay
shows whenever the drone tilts or turns, as the attitude of another moment.  So a frame in which the drone
turns says more of the delay than of the position, and the filter weighs it so: what is not known yet cannot
make the position loop swing.

The measurement is taken in implicit form, g(state, picture) = 0 (Jazwinski, Stochastic Processes and
Filtering Theory, 1970, 8.3), with Joseph's form of the update.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from flightd.config.tracking import MotionNoise, SensorPriors
from flightd.core.geometry import Matrix
from flightd.core.learnt import LearntSensors, estimate_of, whole_delay_sigma_s
from flightd.core.tracks import SensorEstimate
from flightd.tracking.delay_leap import DelayLeap
from flightd.tracking.first_doubt import LEAST_HEIGHT_SHARE, drift_of, first_sigmas
from flightd.tracking.forgotten_lines import FEATURE_NS, forgotten_features, forgotten_lines
from flightd.tracking.frame_measurement import FrameMeasurement, offset_error, placed
from flightd.tracking.held_lines import HeldLine, SeenLine, associate, refound, unsurveyed
from flightd.tracking.innovations import Innovations
from flightd.tracking.kalman import corrected, predicted
from flightd.tracking.line_sight import FeatureSight, LineSight, Rates
from flightd.tracking.motion_model import (
    DELAY,
    FIRST_LINE,
    HEIGHT,
    HEIGHT_S,
    HEIGHT_SCALE,
    LEAK,
    MOUNT_YAW,
    PITCH,
    PSI,
    PSI_RATE,
    PUSH,
    PUSH_X,
    PUSH_Y,
    ROLL,
    SCALE,
    VX,
    VY,
    Carrier,
    Told,
    lean,
    moved,
)
from flightd.tracking.standing_tilt import tilt_error

_UNSEEN_S = 0.1
"""An axis without a line for so long is dead-reckoned: the gust that was last felt on it fades."""
_SENSORS, _LASTING = slice(ROLL, FIRST_LINE), slice(LEAK, FIRST_LINE)
"""What is wrong with the sensors, and what of it is learnt for good."""
_TILTS = [HEIGHT, *range(ROLL, DELAY), SCALE, HEIGHT_SCALE]
"""All of the sensors but the delay."""
_BUT_MOTION = [PSI, PSI_RATE, *range(LEAK, FIRST_LINE)]
"""All but velocities, disturbances, the error of the attitude and the lines."""
_DIAGONAL = np.diag_indices(FIRST_LINE)
_MOST_HEIGHT_SHARE = 0.05
_MOST_LEAK_PER_S = 1.0
_MOST_SCALE = 0.5
_MOST_SIGMAS = 4.0
"""A delay further off than so many sigmas of what was thought possible is not believed."""
_OUTLIER_SIGMAS = 3.0
"""What errs by more is weighed less (Huber)."""
_FRESH, _TELLING, _FEATURE_SIGMAS = 3, 2, 4.0
"""So many features are followed from one frame, so many tell the motion; none that errs by more."""
_CARRIED_M = 0.12
"""A line whose place features of the floor have told this well is held on, however long it is not seen."""
_SURVEY_SIGMAS = 4.0
_SAME_LINE_M = 0.01
"""Two tracks of one line differ by what its paint is skew."""
_BETWEEN = 0.3
"""Share of what was thought possible by which a sensor can have changed between two flights."""


class FloorFilter:
    """Call `predict` up to each exposure, then `update` with what was seen in it."""

    def __init__(
        self,
        noise: MotionNoise,
        priors: SensorPriors,
        gate_m: float,
        forget_ns: int,
        latency_s: float = math.inf,
    ) -> None:
        """`latency_s` is the delay that the frames' stamps assume."""
        self._latency_s = latency_s
        self._noise, self._priors = noise, priors
        self._gate_m, self._forget_ns = gate_m, forget_ns
        self._next_id, self.held = 0, list[HeldLine]()
        self._first_sigmas = first_sigmas(noise, priors)
        self._x: Matrix = np.zeros(FIRST_LINE)
        self._x[LEAK] = priors.leak_per_s
        self._p: Matrix = np.diag(self._first_sigmas**2)
        self._drift = drift_of(priors)
        self.height_known_to(0.0)
        self._steady, self._unseen_s, self._followed_ns = [0.0, 0.0], [0.0, 0.0], [0, 0]
        self._refused: dict[int | None, int] = {}  # features that were none, and when they were told last
        self._innovations = Innovations(priors.shake_rad, priors.shake_bounds_rad)
        self.delay_leap = DelayLeap()

    # What is known

    def mean(self, index: int) -> float:
        return self._x.item(index)

    def sigma(self, index: int) -> float:
        return math.sqrt(max(self._p.item(index, index), 0.0))

    @property
    def delay_sigma_s(self) -> float:
        """How well the delay of the frames is known."""
        return whole_delay_sigma_s(self.sigma(DELAY))

    def without_errors(self) -> Matrix:
        """The first states, were the told attitude right."""
        state = self._x[:FIRST_LINE].copy()
        state[[ROLL, PITCH]] = 0.0
        return state

    def offset(self, line: int) -> tuple[float, float]:
        """Of the line held at that place: its offset from the drone, and sigma."""
        return self.mean(FIRST_LINE + line), self.sigma(FIRST_LINE + line)

    def push_after(self, axis: int, ahead_s: float) -> float:
        """What is expected of the disturbance so much later: the gust in it fades."""
        steady = self._steady[axis]
        return steady + (self.mean(PUSH[axis]) - steady) * math.exp(-ahead_s / self._noise.gust_s)

    def speed_sigma_after(self, axis: int, ahead_s: float) -> float:
        """Of the speed so much later: the push on it may be another one meanwhile."""
        return math.hypot(self.sigma(VX + axis), self.sigma(PUSH[axis]) * ahead_s)

    def carrier(self) -> Carrier:
        """What carries the drone on while nothing new is known."""
        roll, pitch, psi = self.mean(ROLL), self.mean(PITCH), self.mean(PSI)
        gusts = self.mean(PUSH_X) - self._steady[0], self.mean(PUSH_Y) - self._steady[1]
        return Carrier(roll, pitch, psi, (self._steady[0], self._steady[1]), gusts, self._noise.gust_s)

    def sensors(self) -> SensorEstimate:
        """What is known of the sensors, for people."""
        return estimate_of(self.learnt(), self._innovations.shake_rad)

    def learnt(self) -> LearntSensors:
        """What is known of the sensors, from `ROLL` to `HEIGHT_SCALE`."""
        covariance = self._p[_SENSORS, _SENSORS]
        return LearntSensors(tuple(self._x[_SENSORS].tolist()), tuple(covariance.ravel().tolist()))

    def begin_with(self, learnt: LearntSensors) -> None:
        """Begin with what another filter has learnt of the same sensors: less surely, for a mount can have
        been knocked since, and with another error of the attitude.  What is no number, or of a version
        that learnt other things, is ignored."""
        known = FIRST_LINE - ROLL
        if (len(learnt.means), len(learnt.covariance)) != (known, known**2):
            return
        means, covariance = np.array(learnt.means), np.reshape(learnt.covariance, (known, known))
        if not (np.isfinite(means).all() and np.isfinite(covariance).all()):
            return
        self._x[_SENSORS], self._p[_SENSORS, _SENSORS] = means, covariance
        lasting = np.arange(FIRST_LINE)[_LASTING]
        self._p[lasting, lasting] += (_BETWEEN * self._first_sigmas[_LASTING]) ** 2
        self._begin_anew([ROLL, PITCH])

    # What happens

    def tells(self, axis: int, lines: Sequence[int]) -> bool:
        """Whether one of these lines held is surely one, across the axis."""
        return any(self.held[line].axis == axis and self.held[line].is_sure for line in lines)

    def speeds(self, stamp_ns: int) -> tuple[float | None, float | None]:
        """Speed along each axis, None where no line seen in the frame of that time tells it."""
        seen = [
            line for line, held in enumerate(self.held) if held.feature is None and held.seen_ns == stamp_ns
        ]
        x, y = (self.mean(VX + axis) if self.tells(axis, seen) else None for axis in range(2))
        return x, y

    def lines_seen(self, stamp_ns: int) -> dict[int, SeenLine]:
        """The lines seen in the frame of that time, by their ids."""
        seen = (one for one in self.held if one.feature is None and one.seen_ns == stamp_ns)
        return {one.id: SeenLine(one.axis, one.sight_m, one.is_sure) for one in seen}

    def turn_to(self, offset_rad: float, sigma_rad: float) -> None:
        """The heading offset is another one, and all that it was correlated with is no longer."""
        self._begin_anew([PSI, PSI_RATE])
        self._x[PSI], self._p[PSI, PSI] = offset_rad, sigma_rad**2

    def turn_mount_by(self, angle_rad: float) -> None:
        """The camera has turned in its mount, clockwise as seen from above; the heading is as before."""
        turned_rad = self.mean(MOUNT_YAW) + angle_rad
        self._begin_anew([MOUNT_YAW])
        self._x[MOUNT_YAW] = turned_rad

    def stand(self) -> None:
        """The drone stands, or has hardly risen: it moves as little as at first, whatever it leans."""
        self._begin_anew([VX, VY, PUSH_X, PUSH_Y])

    def stand_level(self, told_rad: tuple[float, float]) -> None:
        """The drone stands in that roll and pitch, as they are told."""
        self._begin_anew([ROLL, PITCH])
        for state, tilt_rad in zip((ROLL, PITCH), told_rad, strict=True):
            error = tilt_error(tilt_rad, self._p.item(state, state), self._priors.stand_rad**2)
            self._x[state], self._p[state, state] = error

    def forget(self) -> None:
        """Know no line and no motion any more; what was learnt of the sensors stays."""
        self._drop(range(len(self.held)))
        self.stand()
        self._innovations.forget()

    def height_known_to(self, share: float) -> None:
        """Standard deviation of the told height, as a share of it."""
        share = min(max(share, LEAST_HEIGHT_SHARE), _MOST_HEIGHT_SHARE)
        self._drift[HEIGHT] = share * math.sqrt(2.0 / HEIGHT_S)

    def predict(self, dt_s: float, roll_rad: float, pitch_rad: float, yaw_rad: float) -> None:
        """Advance by `dt_s` in the told attitude; `yaw_rad` is the vehicle's own."""
        noise = self._noise
        axes = [line.axis for line in self.held]
        told = Told(roll_rad, pitch_rad, yaw_rad)
        step = moved(self._x, axes, told, dt_s, noise.drag_per_s, self._priors.attitude_s)
        self._x, by_accel = step.state, step.by_accel
        rough = self._innovations.rough
        noise_q = by_accel @ by_accel.T * ((rough * noise.accel_mps2) ** 2 / dt_s)
        for axis, push in enumerate(PUSH):
            changed = self._innovations.one_sided(axis)
            self._drift[push] = noise.changed_mps2 if changed else noise.disturbance_mps2
        noise_q[_DIAGONAL] += self._drift**2 * dt_s
        self._p = predicted(self._p, step.jacobian, noise_q)
        self.delay_leap.moved(step.jacobian, self.mean(DELAY), self.sigma(DELAY), dt_s)
        self._fade(dt_s)

    def update(
        self,
        sights: list[LineSight],
        rates: Rates,
        stamp_ns: int,
        features: Sequence[FeatureSight] = (),
        *,
        assumed: bool = False,
        exact: bool = True,
    ) -> frozenset[int]:
        """Take the lines of one frame, and the features of the floor; those that belong to none held start
        new ones.  Of an attitude that is only `assumed` nothing is learnt for good; of lines whose tilt was
        not compensated in an `exact` form nothing but the delay.  Across which axes
        features told the motion where no line did."""
        self._mind_refused(features, stamp_ns)
        self._drop(forgotten_features(self.held, self._refused, stamp_ns))
        before = self._x[:FIRST_LINE].copy()
        for line, held in enumerate(self.held):  # it was dead-reckoned on, if it was not seen
            held.lever_to(self.mean(FIRST_LINE + line))
        known, fresh = associate(
            sights,
            self.held,
            lambda sight, line: self._innovation(sight, line, rates),
            self._gate_m,
            stamp_ns,
        )
        bare = [axis for axis in range(2) if not self.tells(axis, [line for _, line in known])]
        of_bare = [seen.across[axis] for axis in bare for seen in features]
        followed, strange = self._followed(of_bare, rates, stamp_ns)
        told = FrameMeasurement()
        for sight, line in known:
            told.add_offset(sight, line, self.held[line].lever_m, self._x, rates)
        told.add_turns(sights, self._x, self._p, rates, self._innovations)
        self._take(told, self._unmoved(assumed=assumed, exact=exact), tested=not assumed)
        carried = FrameMeasurement()
        for sight, line in followed:
            carried.add_offset(sight, line, self.held[line].lever_m, self._x, rates, before)
        # a feature lives too short to tell more than the motion
        self._take(carried, _BUT_MOTION, minded=False, tested=False)
        for sight, line in known + followed:
            held = self.held[line]
            if held.feature is not None:
                self._followed_ns[held.axis] = stamp_ns
            self._unseen_s[held.axis] = 0.0
            held.take(sight, stamp_ns)
        self._refind([line for _, line in known], stamp_ns)
        for sight in fresh:
            self._add(sight, rates, stamp_ns, before)
        told_by = [sight.axis for sight, _ in followed]
        for axis in bare:
            room = max(_FRESH - told_by.count(axis), 0)
            for sight in [sight for sight in strange if sight.axis == axis][:room]:
                self._add(sight, rates, stamp_ns, before)
        self._forget_old(stamp_ns)
        return frozenset(axis for axis in bare if told_by.count(axis) >= _TELLING)

    # How

    def survey(self, axis: int, places_m: Mapping[int, float], sigma_m: float) -> None:
        """Lines held, by their ids, are at such places on the map, whose distances are known to `sigma_m`.
        Each line is held against another one once: what the map errs by does not average out."""
        for line, at in unsurveyed(self.held, axis, places_m, lambda one: self.sigma(FIRST_LINE + one)):
            held, other = self.held[line], self.held[at]
            apart_m = places_m[held.id] - places_m[other.id]
            row = self._between(line, at)
            off_m = float(row @ self._x) - apart_m
            spread_m = math.sqrt(float(row @ self._p @ row) + sigma_m**2)
            held.surveyed = other.surveyed = True
            if abs(off_m) < _SURVEY_SIGMAS * spread_m:
                self._correct(row[None, :], np.array([off_m]), np.array([[sigma_m**2]]))

    def _refind(self, seen: Sequence[int], stamp_ns: int) -> None:
        """Take lines `seen` in this frame for those that were lost and should be there."""
        pairs = refound(self.held, seen, self._apart, self._gate_m, stamp_ns)
        for new, old in pairs:
            self._join(old, new)
        self._drop({new for new, _ in pairs})

    def _apart(self, one: int, other: int) -> tuple[float, float]:
        """How far one line held is beyond another one, and the standard deviation of that."""
        row = self._between(one, other)
        return float(row @ self._x), math.sqrt(max(float(row @ self._p @ row), 0.0))

    def _between(self, one: int, other: int) -> Matrix:
        row = np.zeros(len(self._x))
        row[FIRST_LINE + one], row[FIRST_LINE + other] = 1.0, -1.0
        return row

    def _join(self, old: int, new: int) -> None:
        """What was followed as two lines is one, and lies where the new one was seen."""
        row = self._between(new, old)
        errors, noise = np.array([float(row @ self._x)]), np.array([[_SAME_LINE_M**2]])
        # a dead-reckoned line tells of the motion, not of the sensors
        self._correct(row[None, :], errors, noise, _BUT_MOTION)
        self._bound_push()
        kept, found = self.held[old], self.held[new]
        kept.seen_ns, kept.hits, kept.width_m = found.seen_ns, kept.hits + found.hits, found.width_m
        kept.from_m, kept.to_m = found.from_m, found.to_m
        kept.lever_m, kept.sight_m = found.lever_m, found.sight_m

    def _begin_anew(self, states: list[int]) -> None:
        """These are as unknown as at first, and nothing that is known says anything of them."""
        self._x[states] = self.delay_leap.off[states] = 0.0
        self._p[states, :] = 0.0
        self._p[:, states] = 0.0
        self._p[states, states] = self._first_sigmas[states] ** 2

    def accel(self, told: Told) -> tuple[float, float]:
        """Acceleration along the grid axes that the told attitude makes at constant height."""
        return lean(self._x, told)[0]

    def _fade(self, dt_s: float) -> None:
        for axis, push in enumerate(PUSH):
            if self._unseen_s[axis] > _UNSEEN_S:
                self._x[push] = self.push_after(axis, dt_s)
                kept = math.exp(-dt_s / self._noise.gust_s)  # and with the gust what is not known of it
                self.delay_leap.off[push] *= kept
                self._p[push, :] *= kept
                self._p[:, push] *= kept
            else:
                share = min(dt_s / self._noise.steady_s, 1.0)
                self._steady[axis] += share * (self.mean(push) - self._steady[axis])
            self._unseen_s[axis] += dt_s

    def _innovation(self, sight: LineSight, line: int, rates: Rates) -> tuple[float, float]:
        """How far the line held is from the sight, and the standard deviation of that; 0 where it is too
        far to be asked."""
        apart_m = sight.offset_m - self.mean(FIRST_LINE + line)
        if abs(apart_m) > self._gate_m:
            return apart_m, 0.0
        row, _ = offset_error(sight, line, self.held[line].lever_m, self._x, rates)
        shaken = self._innovations.shake_variance(sight.offset_per_tilt)
        return apart_m, math.sqrt(max(float(row @ self._p @ row), 0.0) + sight.sigma_m**2 + shaken)

    def _unmoved(self, *, assumed: bool, exact: bool) -> slice | list[int] | None:
        if exact:
            return _LASTING if assumed else None
        return _SENSORS if assumed else _TILTS

    def _mind_refused(self, features: Sequence[FeatureSight], stamp_ns: int) -> None:
        """Forget those that are told no more; where several detectors take turns, each tells its own."""
        told = {sight.feature for seen in features for sight in seen.across}
        self._refused |= dict.fromkeys(self._refused.keys() & told, stamp_ns)
        self._refused = {one: ns for one, ns in self._refused.items() if stamp_ns - ns <= FEATURE_NS}

    def _followed(
        self, sights: Sequence[LineSight], rates: Rates, stamp_ns: int
    ) -> tuple[list[tuple[LineSight, int]], list[LineSight]]:
        """The features that are held across their axis, and those that are not.  One that is not where it
        should be was no point of the floor: it is refused for as long as it is told."""
        places = {(held.feature, held.axis): line for line, held in enumerate(self.held)}
        known: list[tuple[LineSight, int]] = []
        strange: list[LineSight] = []
        for sight in sights:
            line = places.get((sight.feature, sight.axis))
            if sight.feature in self._refused:
                continue
            if line is None:
                strange.append(sight)
                continue
            apart_m, sigma_m = self._innovation(sight, line, rates)
            if abs(apart_m) < _FEATURE_SIGMAS * sigma_m:
                known.append((sight, line))
            else:
                self._refused[sight.feature] = stamp_ns
        return known, strange

    def _take(
        self,
        measured: FrameMeasurement,
        unmoved: slice | list[int] | None,
        *,
        minded: bool = True,
        tested: bool = True,
    ) -> None:
        """Bring g to 0, but for the states that are `unmoved`.  What shakes moves all lines alike.  The noise
        follows what is `minded`; a delay that leaps shows in what is `tested`."""
        if not measured.rows:
            return
        rows, errors, by_tilt = map(np.array, (measured.rows, measured.errors, measured.by_tilt))
        shake_rad = self._innovations.shake_rad
        if not minded:  # what is least believed of a line's offset covers it, but not what features share
            shake_rad = max(shake_rad, self._priors.shake_rad)
        noise = np.diag(measured.variances) + by_tilt @ by_tilt.T * shake_rad**2
        expected = np.einsum("ij,jk,ik->i", rows, self._p, rows) + np.diag(noise)
        outlying = np.maximum(np.abs(errors) / np.sqrt(expected) / _OUTLIER_SIGMAS, 1.0)
        noise += np.diag((outlying - 1.0) * expected)
        by_leap, spread = self._correct(rows, errors, noise, unmoved)
        delay_s = _MOST_SIGMAS * self._priors.delay_s
        self._bound_push()
        self._bound(LEAK, 0.0, _MOST_LEAK_PER_S)
        self._bound(SCALE, -_MOST_SCALE, _MOST_SCALE)
        self._bound(HEIGHT_SCALE, -_MOST_SCALE, _MOST_SCALE)
        self._bound(DELAY, -delay_s, min(delay_s, self._latency_s))  # no frame arrives before it is exposed
        if minded:
            self._innovations.mind(errors, spread, by_tilt, measured.axes)
        off = self.delay_leap.found(by_leap, errors, spread) if tested else None
        if off is not None:  # as unknown as at first, and with it all that has been made of it since
            self._p += np.outer(off, off) * self._priors.delay_s**2

    def _correct(
        self, rows: Matrix, errors: Matrix, noise: Matrix, unmoved: slice | list[int] | None = None
    ) -> tuple[Matrix, Matrix]:
        """Bring the errors (m,) to 0; (m, 2) what of them a leap of the delay would have made, and (m, m) how
        they were expected to spread."""
        leap = self.delay_leap
        by_leap = rows @ leap.off
        states, off = np.column_stack((self._x, leap.off)), np.column_stack((errors, by_leap))
        states, self._p, spread = corrected(states, self._p, rows, off, noise, unmoved)
        self._x, leap.off = states[:, 0].copy(), states[:, 1:]
        return by_leap, spread

    def _bound_push(self) -> None:
        for push in PUSH:
            self._bound(push, -self._noise.max_disturbance_mps2, self._noise.max_disturbance_mps2)

    def _bound(self, index: int, least: float, most: float) -> None:
        self._x[index] = min(max(self._x[index], least), most)

    def _add(self, sight: LineSight, rates: Rates, stamp_ns: int, before: Matrix) -> None:
        """A line where it was seen, as wrong as everything by which it was placed; moved by what the frame
        has corrected of that, for it was placed with the state `before`."""
        n = len(self._x)
        row = placed(sight, self._x, rates)
        grown = np.zeros((n + 1, n + 1))
        grown[:n, :n] = self._p
        grown[n, :n] = grown[:n, n] = self._p @ row
        shaken = self._innovations.shake_variance(sight.offset_per_tilt)
        grown[n, n] = row @ self._p @ row + sight.sigma_m**2 + shaken
        offset_m = sight.offset_m + float(row[:FIRST_LINE] @ (self._x[:FIRST_LINE] - before))
        self._x, self._p = np.append(self._x, offset_m), grown
        self.delay_leap.grow(row)
        self.held.append(HeldLine.first(self._next_id, sight, stamp_ns, offset_m))
        self._next_id += 1

    def _forget_old(self, stamp_ns: int) -> None:
        """Drop lines that were not seen for long, but those that features have carried on well."""

        def is_carried(line: int) -> bool:
            carried = stamp_ns - self._followed_ns[self.held[line].axis] <= FEATURE_NS
            return carried and self.offset(line)[1] < _CARRIED_M

        for held in self.held:
            if held.feature is None and held.is_lost(stamp_ns):
                held.from_m = held.to_m = 0.0  # where it was in view is no longer known
        self._drop(forgotten_lines(self.held, is_carried, self._forget_ns, stamp_ns))

    def _drop(self, lines: set[int] | range) -> None:
        if not lines:
            return
        kept = [line for line in range(len(self.held)) if line not in lines]
        rows = [*range(FIRST_LINE), *(FIRST_LINE + line for line in kept)]
        self._x, self._p = self._x[rows], self._p[np.ix_(rows, rows)]
        self.delay_leap.keep(rows)
        self.held = [self.held[line] for line in kept]
