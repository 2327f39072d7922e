"""One Kalman filter for the drone's motion over the lines and for what it does not know of its own sensors.

An extended filter with the state

    heading offset and its drift | velocity, disturbance of both grid axes | error of the told attitude
    | mount of the camera | delay of its frames | scale of lengths | offsets of all lines held

Lines stand still, so all of them move with the one velocity; the control input is the acceleration that the
attitude makes, g tan(tilt).  What is wrong with the told attitude shows twice, in the acceleration and in the
picture; what is wrong with the mount shows in the picture alone; a wrong delay shows whenever the drone tilts
or turns, as the attitude of another moment.  So a frame in which the drone turns says more of the delay than
of the position, and the filter weighs it so: what is not known yet cannot make the position loop swing.

The measurement is taken in implicit form, g(state, picture) = 0 (Jazwinski, Stochastic Processes and
Filtering Theory, 1970, 8.3), with Joseph's form of the update.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from flightd.config.tracking import MotionNoise, SensorPriors
from flightd.core.geometry import GRAVITY_MPS2, Matrix
from flightd.core.tracks import SensorEstimate
from flightd.tracking.held_lines import HeldLine, associate
from flightd.tracking.innovations import Innovations
from flightd.tracking.kalman import corrected, predicted
from flightd.tracking.line_sight import LineSight, Rates

PSI, PSI_RATE, VX, VY, PUSH_X, PUSH_Y, ROLL, PITCH, MOUNT_ROLL, MOUNT_PITCH, DELAY, SCALE = range(12)
FIRST_LINE = 12

_UNSEEN_S = 0.1
"""An axis without a line for so long is dead-reckoned: the gust that was last felt on it fades."""
_SENSORS, _LASTING = slice(ROLL, FIRST_LINE), slice(MOUNT_ROLL, FIRST_LINE)
"""What is wrong with the sensors, and what of it is learnt for good."""
_YAW_SIGMA_RAD, _YAW_RATE_SIGMA_RADPS = math.radians(5.0), 0.005
"""Of the heading before it is told at all, and of its drift whenever it is."""
_MOST_SIGMAS = 4.0
"""A delay further off than so many sigmas of what was thought possible is not believed."""
_BETWEEN = 0.3
"""Share of what was thought possible by which a sensor can have changed between two flights."""


class Axis(NamedTuple):
    """Where one grid axis stands in the state."""

    velocity: int
    push: int


AXES = Axis(VX, PUSH_X), Axis(VY, PUSH_Y)


class FloorFilter:
    """Call `predict` up to each exposure, then `update` with what was seen in it."""

    def __init__(
        self,
        noise: MotionNoise,
        priors: SensorPriors,
        gate_m: float,
        forget_ns: int,
        latency_s: float = math.inf,
        max_lines: int = 16,
    ) -> None:
        """`latency_s` is the delay that the frames' stamps assume."""
        self._latency_s = latency_s
        self._noise, self._priors = noise, priors
        self._gate_m, self._forget_ns, self._max_lines = gate_m, forget_ns, max_lines
        self._next_id = 0
        self.held: list[HeldLine] = []
        sigmas = np.zeros(FIRST_LINE)
        sigmas[[PSI, PSI_RATE]] = _YAW_SIGMA_RAD, _YAW_RATE_SIGMA_RADPS
        sigmas[[VX, VY]] = noise.start_velocity_mps
        sigmas[[PUSH_X, PUSH_Y]] = noise.start_disturbance_mps2
        sigmas[[ROLL, PITCH]] = priors.attitude_rad
        sigmas[[MOUNT_ROLL, MOUNT_PITCH]] = priors.mount_rad
        sigmas[DELAY], sigmas[SCALE] = priors.delay_s, priors.scale_share
        self._first_sigmas = sigmas
        self._x: Matrix = np.zeros(FIRST_LINE)
        self._p: Matrix = np.diag(sigmas**2)
        drift = np.zeros(FIRST_LINE)
        drift[[PSI, PSI_RATE]] = priors.heading_radps, 0.1 * priors.heading_radps
        drift[[ROLL, PITCH]] = priors.attitude_rad * math.sqrt(2.0 / priors.attitude_s)
        drift[[MOUNT_ROLL, MOUNT_PITCH]] = priors.mount_rad * 0.002
        drift[DELAY], drift[SCALE] = priors.delay_s * 0.01, priors.scale_share * 0.01
        self._drift = drift
        self._steady = [0.0, 0.0]
        self._unseen_s = [0.0, 0.0]
        self._innovations = Innovations(priors.shake_rad, priors.shake_bounds_rad)

    # What is known

    def mean(self, index: int) -> float:
        return float(self._x[index])

    def sigma(self, index: int) -> float:
        return math.sqrt(max(float(self._p[index, index]), 0.0))

    def offset(self, line: int) -> tuple[float, float]:
        """Of the line held at that place: its offset from the drone, and sigma."""
        return self.mean(FIRST_LINE + line), self.sigma(FIRST_LINE + line)

    def push_after(self, axis: int, ahead_s: float) -> float:
        """What is expected of the disturbance so much later: the gust in it fades."""
        steady = self._steady[axis]
        return steady + (self.mean(AXES[axis].push) - steady) * math.exp(-ahead_s / self._noise.gust_s)

    def sensors(self) -> SensorEstimate:
        """What is known of the sensors, for people."""
        return SensorEstimate(
            delay_s=self.mean(DELAY),
            delay_sigma_s=self.sigma(DELAY),
            mount_roll_rad=self.mean(MOUNT_ROLL),
            mount_pitch_rad=self.mean(MOUNT_PITCH),
            mount_sigma_rad=max(self.sigma(MOUNT_ROLL), self.sigma(MOUNT_PITCH)),
            tilt_roll_rad=self.mean(ROLL),
            tilt_pitch_rad=self.mean(PITCH),
            tilt_sigma_rad=max(self.sigma(ROLL), self.sigma(PITCH)),
            scale_share=self.mean(SCALE),
            scale_sigma=self.sigma(SCALE),
            shake_rad=self._innovations.shake_rad,
        )

    def learnt(self) -> tuple[Matrix, Matrix]:
        """What is known of the sensors: (6,) means and (6, 6) covariance from `ROLL` to `SCALE`."""
        return self._x[_SENSORS].copy(), self._p[_SENSORS, _SENSORS].copy()

    def begin_with(self, learnt: tuple[Matrix, Matrix]) -> None:
        """Begin with what another filter has learnt of the same sensors: less surely, for a mount can have
        been knocked since, and with another error of the attitude.  What is no number is ignored."""
        means, covariance = learnt
        if not (np.isfinite(means).all() and np.isfinite(covariance).all()):
            return
        self._x[_SENSORS], self._p[_SENSORS, _SENSORS] = means, covariance
        lasting = np.arange(FIRST_LINE)[_LASTING]
        self._p[lasting, lasting] += (_BETWEEN * self._first_sigmas[_LASTING]) ** 2
        self._begin_anew([ROLL, PITCH])

    # What happens

    def turn_to(self, offset_rad: float, sigma_rad: float) -> None:
        """The heading offset is another one, and all that it was correlated with is no longer."""
        self._begin_anew([PSI, PSI_RATE])
        self._x[PSI], self._p[PSI, PSI] = offset_rad, sigma_rad**2

    def forget(self) -> None:
        """Know no line and no motion any more; what was learnt of the sensors stays."""
        self._drop(range(len(self.held)))
        self._begin_anew([VX, VY, PUSH_X, PUSH_Y])
        self._innovations.forget()

    def predict(self, dt_s: float, roll_rad: float, pitch_rad: float, yaw_rad: float) -> None:
        """Advance by `dt_s` in the told attitude; `yaw_rad` is the vehicle's own."""
        noise, priors, x = self._noise, self._priors, self._x
        n = len(x)
        (ax, ay), by_roll, by_pitch = self._lean(roll_rad, pitch_rad, yaw_rad)
        drag = noise.drag_per_s
        accel = np.array([ax + x[PUSH_X] - drag * x[VX], ay + x[PUSH_Y] - drag * x[VY]])
        jacobian = np.eye(n)
        jacobian[PSI, PSI_RATE] = dt_s
        for axis, (velocity, push) in enumerate(AXES):
            jacobian[velocity, velocity] = 1.0 - drag * dt_s
            jacobian[velocity, push] = dt_s
            jacobian[velocity, ROLL] = by_roll[axis] * dt_s
            jacobian[velocity, PITCH] = by_pitch[axis] * dt_s
        jacobian[VX, PSI], jacobian[VY, PSI] = -ay * dt_s, ax * dt_s
        keep = math.exp(-dt_s / priors.attitude_s)
        jacobian[ROLL, ROLL] = jacobian[PITCH, PITCH] = keep
        reach = np.zeros((n, 2))
        reach[VX, 0] = reach[VY, 1] = dt_s
        moved = x[[VX, VY]] * dt_s + 0.5 * accel * dt_s * dt_s
        for row, line in enumerate(self.held, FIRST_LINE):
            velocity, _ = AXES[line.axis]
            jacobian[row] -= 0.5 * dt_s * jacobian[velocity]
            jacobian[row, velocity] -= 0.5 * dt_s
            reach[row, line.axis] = -0.5 * dt_s * dt_s
            x[row] -= moved[line.axis]
        x[PSI] += x[PSI_RATE] * dt_s
        x[[VX, VY]] += accel * dt_s
        x[[ROLL, PITCH]] *= keep
        rough = self._innovations.rough
        noise_q = reach @ reach.T * ((rough * noise.accel_mps2) ** 2 / dt_s)
        for axis, (_, push) in enumerate(AXES):
            changed = self._innovations.one_sided(axis)
            self._drift[push] = noise.changed_mps2 if changed else noise.disturbance_mps2
        noise_q[np.diag_indices(FIRST_LINE)] += self._drift**2 * dt_s
        self._p = predicted(self._p, jacobian, noise_q)
        self._fade(dt_s)

    def update(self, sights: list[LineSight], rates: Rates, stamp_ns: int, *, assumed: bool = False) -> None:
        """Take the lines of one frame; those that belong to none held start new ones.  Of an attitude that is
        only `assumed` nothing is learnt for good."""
        before = self._x[:FIRST_LINE].copy()
        offsets_m = [self.offset(line) for line in range(len(self.held))]
        known, fresh = associate(sights, self.held, offsets_m, self._gate_m)
        rows: list[Matrix] = []
        errors: list[float] = []
        variances: list[float] = []
        by_tilt: list[tuple[float, float]] = []
        offsets: list[tuple[int, int]] = []
        for sight, line in known:
            offsets.append((len(rows), sight.axis))
            rows.append(self._offset_row(sight, rates, FIRST_LINE + line))
            errors.append(sight.offset_m - self.mean(FIRST_LINE + line))
            variances.append(sight.sigma_m**2)
            by_tilt.append(sight.offset_per_tilt)
        for sight in sights:
            if not math.isnan(sight.turn_rad):
                rows.append(self._turn_row(sight, rates))
                errors.append(sight.turn_rad)
                variances.append(sight.sigma_theta_rad**2)
                by_tilt.append(sight.turn_per_tilt)
        if rows:
            measured = np.array(rows), np.array(errors), np.array(variances), np.array(by_tilt)
            self._mind(self._correct(*measured, _LASTING if assumed else None), offsets)
        for sight, line in known:
            held = self.held[line]
            held.seen_ns, held.hits = stamp_ns, held.hits + 1
            held.width_m += 0.2 * (sight.width_m - held.width_m)
            held.from_m, held.to_m = sight.from_m, sight.to_m
        for sight in fresh:
            self._add(sight, rates, stamp_ns, before)
        self._forget_old(stamp_ns)

    # How

    def _begin_anew(self, states: list[int]) -> None:
        """These are as unknown as at first, and nothing that is known says anything of them."""
        self._x[states] = 0.0
        self._p[states, :] = 0.0
        self._p[:, states] = 0.0
        self._p[states, states] = self._first_sigmas[states] ** 2

    def _lean(
        self, roll_rad: float, pitch_rad: float, yaw_rad: float
    ) -> tuple[tuple[float, float], tuple[float, float], tuple[float, float]]:
        """Acceleration along x and y that the attitude makes, and what a radian more of roll and of pitch
        would make."""
        roll, pitch = roll_rad + self.mean(ROLL), pitch_rad + self.mean(PITCH)
        yaw = yaw_rad + self.mean(PSI)
        cos, sin = math.cos(yaw), math.sin(yaw)
        forward, right = -GRAVITY_MPS2 * math.tan(pitch), GRAVITY_MPS2 * math.tan(roll)
        per_roll, per_pitch = GRAVITY_MPS2 / math.cos(roll) ** 2, -GRAVITY_MPS2 / math.cos(pitch) ** 2
        accel = cos * forward - sin * right, sin * forward + cos * right
        return accel, (-sin * per_roll, cos * per_roll), (cos * per_pitch, sin * per_pitch)

    def accel(self, roll_rad: float, pitch_rad: float, yaw_rad: float) -> tuple[float, float]:
        """Acceleration along the grid axes that the told attitude makes at constant height."""
        return self._lean(roll_rad, pitch_rad, yaw_rad)[0]

    def _fade(self, dt_s: float) -> None:
        for axis, (_, push) in enumerate(AXES):
            if self._unseen_s[axis] > _UNSEEN_S:
                self._x[push] = self.push_after(axis, dt_s)
            else:
                share = min(dt_s / self._noise.steady_s, 1.0)
                self._steady[axis] += share * (self.mean(push) - self._steady[axis])
            self._unseen_s[axis] += dt_s

    def _offset_row(self, sight: LineSight, rates: Rates, column: int) -> Matrix:
        """d(seen offset - held offset) / d state."""
        row = np.zeros(len(self._x))
        self._fill_sight(row, sight, rates)
        row[column] = -1.0
        # as held, not as seen: what is seen has the noise in it that is weighed here, and scale would shrink
        row[SCALE] = self.mean(column)
        return row

    def _fill_sight(self, row: Matrix, sight: LineSight, rates: Rates) -> None:
        (by_roll, by_pitch), by_yaw = sight.offset_per_tilt, sight.offset_per_yaw
        row[[ROLL, PITCH]] = by_roll, by_pitch
        row[[MOUNT_ROLL, MOUNT_PITCH]] = sight.offset_per_mount
        row[PSI] = by_yaw
        velocity = self.mean(AXES[sight.axis].velocity)
        row[DELAY] = (
            by_roll * rates.roll_radps + by_pitch * rates.pitch_radps + by_yaw * rates.yaw_radps + velocity
        )
        row[SCALE] = sight.offset_m

    def _turn_row(self, sight: LineSight, rates: Rates) -> Matrix:
        """d(heading held - heading told) / d state."""
        row = np.zeros(len(self._x))
        by_roll, by_pitch = sight.turn_per_tilt
        row[PSI] = 1.0
        row[[ROLL, PITCH]] = by_roll, by_pitch
        row[[MOUNT_ROLL, MOUNT_PITCH]] = sight.turn_per_mount
        row[DELAY] = by_roll * rates.roll_radps + by_pitch * rates.pitch_radps + rates.yaw_radps
        return row

    def _correct(
        self, rows: Matrix, errors: Matrix, variances: Matrix, by_tilt: Matrix, unmoved: slice | None
    ) -> Matrix:
        """Bring g to 0; returns the errors in units of their sigmas.  What shakes moves all lines alike."""
        noise = np.diag(variances) + by_tilt @ by_tilt.T * self._innovations.shake_rad**2
        self._x, self._p, spread = corrected(self._x, self._p, rows, errors, noise, unmoved)
        push, delay_s = self._noise.max_disturbance_mps2, _MOST_SIGMAS * self._priors.delay_s
        self._bound(PUSH_X, -push, push)
        self._bound(PUSH_Y, -push, push)
        self._bound(DELAY, -delay_s, min(delay_s, self._latency_s))  # no frame arrives before it is exposed
        told: Matrix = errors / np.sqrt(np.diag(spread))
        return told

    def _bound(self, index: int, least: float, most: float) -> None:
        self._x[index] = min(max(self._x[index], least), most)

    def _mind(self, told: Matrix, offsets: list[tuple[int, int]]) -> None:
        for axis in range(2):
            mine = [-float(told[row]) for row, of in offsets if of == axis]
            if mine:
                self._unseen_s[axis] = 0.0
                self._innovations.take(axis, sum(mine) / len(mine))
        self._innovations.shaken(float(np.mean(told**2)))

    def _add(self, sight: LineSight, rates: Rates, stamp_ns: int, before: Matrix) -> None:
        """A line where it was seen, as wrong as everything by which it was placed; moved by what the frame
        has corrected of that, for it was placed with the state `before`."""
        n = len(self._x)
        row = np.zeros(n)
        self._fill_sight(row, sight, rates)
        grown = np.zeros((n + 1, n + 1))
        grown[:n, :n] = self._p
        grown[n, :n] = grown[:n, n] = self._p @ row
        by_roll, by_pitch = sight.offset_per_tilt
        shaken = (by_roll**2 + by_pitch**2) * self._innovations.shake_rad**2
        grown[n, n] = row @ self._p @ row + sight.sigma_m**2 + shaken
        offset_m = sight.offset_m + float(row[:FIRST_LINE] @ (self._x[:FIRST_LINE] - before))
        self._x, self._p = np.append(self._x, offset_m), grown
        self.held.append(
            HeldLine(self._next_id, sight.axis, sight.width_m, stamp_ns, sight.from_m, sight.to_m)
        )
        self._next_id += 1

    def _forget_old(self, stamp_ns: int) -> None:
        order = sorted(range(len(self.held)), key=lambda line: -self.held[line].seen_ns)
        old = {line for line in order if stamp_ns - self.held[line].seen_ns > self._forget_ns}
        self._drop(old | set(order[self._max_lines :]))

    def _drop(self, lines: set[int] | range) -> None:
        if not lines:
            return
        kept = [line for line in range(len(self.held)) if line not in lines]
        rows = [*range(FIRST_LINE), *(FIRST_LINE + line for line in kept)]
        self._x, self._p = self._x[rows], self._p[np.ix_(rows, rows)]
        self.held = [self.held[line] for line in kept]
