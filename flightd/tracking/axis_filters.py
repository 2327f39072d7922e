"""Kalman filters of one axis of the floor grid and of the grid's direction.

`AxisTracker` holds, in one filter, the drone's velocity along one grid axis, the disturbance of its
acceleration (wind, trim), and the offsets of all lines seen across that axis.  A line stands still, so
all offsets move with the one velocity; the control input is the acceleration that the measured attitude
makes, g tan(tilt).  Offsets are in metres on the floor: a change of height moves none of them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from flightd.config.tracking import MotionNoise
from flightd.core.geometry import Matrix
from flightd.core.tracks import TrackedLine
from flightd.tracking.kalman import KalmanFilter

_GATE_SIGMAS = 4.0
_UNSEEN_S = 0.1
"""An axis without a line for so long is dead-reckoned: the gust that was last felt on it fades."""
_BIAS_GAIN, _BIASED = 0.25, 0.6
"""Innovations whose running mean is beyond this, in sigmas, all err to one side: the wind has changed."""


class LineMeasurement(NamedTuple):
    """A line across an axis in one frame, from the drone; `from_m` to `to_m` is its visible part."""

    offset_m: float
    sigma_m: float
    width_m: float
    from_m: float = 0.0
    to_m: float = 0.0


@dataclass(slots=True)
class _Track:
    id: int
    width_m: float
    seen_ns: int
    from_m: float
    to_m: float
    hits: int = 1


class AxisTracker:
    """State [velocity, disturbance, offset_1 .. offset_n]; offsets are line minus drone."""

    def __init__(self, noise: MotionNoise, gate_m: float, forget_ns: int, max_lines: int = 8) -> None:
        self._noise = noise
        self._gate_m = gate_m
        self._forget_ns = forget_ns
        self._max_lines = max_lines
        self._next_id = 0
        self._tracks: list[_Track] = []
        self._x = np.zeros(2)
        self._p = np.diag([noise.start_velocity_mps**2, noise.start_disturbance_mps2**2])
        self._steady_mps2 = 0.0
        self._unseen_s = 0.0
        self._bias = 0.0

    @property
    def velocity_mps(self) -> float:
        return float(self._x[0])

    @property
    def disturbance_mps2(self) -> float:
        return float(self._x[1])

    def disturbance_after(self, ahead_s: float) -> float:
        """What is expected of the disturbance so much later: the gust in it fades."""
        steady = self._steady_mps2
        return steady + (self.disturbance_mps2 - steady) * math.exp(-ahead_s / self._noise.gust_s)

    @property
    def drag_per_s(self) -> float:
        return self._noise.drag_per_s

    def lines(self) -> list[TrackedLine]:
        """All lines held, nearest to the drone first."""
        held = [
            TrackedLine(
                t.id,
                float(self._x[2 + i]),
                float(np.sqrt(self._p[2 + i, 2 + i])),
                t.width_m,
                t.seen_ns,
                t.hits,
                t.from_m,
                t.to_m,
            )
            for i, t in enumerate(self._tracks)
        ]
        return sorted(held, key=lambda line: abs(line.offset_m))

    def predict(self, dt_s: float, accel_mps2: float) -> None:
        """Advance by `dt_s` under the mean commanded acceleration along the axis."""
        n = len(self._x)
        noise = self._noise
        transition = np.eye(n)
        transition[0, 0] = 1.0 - noise.drag_per_s * dt_s
        transition[0, 1] = dt_s
        transition[2:, 0] = -dt_s
        transition[2:, 1] = -0.5 * dt_s * dt_s
        control = np.zeros((n, 1))
        control[0, 0] = dt_s
        control[2:, 0] = -0.5 * dt_s * dt_s
        kf = self._filter()
        kf.F, kf.B = transition, control
        # white acceleration noise reaches velocity and offsets through the same column as the control
        kf.Q = control @ control.T * (noise.accel_mps2**2 / dt_s)
        changed = abs(self._bias) > _BIASED
        kf.Q[1, 1] += (noise.changed_mps2 if changed else noise.disturbance_mps2) ** 2 * dt_s
        kf.predict(u=np.array([[accel_mps2]]))
        self._keep(kf)
        if self._unseen_s > _UNSEEN_S:
            self._x[1] = self.disturbance_after(dt_s)
        else:
            share = min(dt_s / noise.steady_s, 1.0)
            self._steady_mps2 += share * (self.disturbance_mps2 - self._steady_mps2)
        self._unseen_s += dt_s

    def update(self, measured: list[LineMeasurement], stamp_ns: int) -> list[float]:
        """Take the lines seen at `stamp_ns`; return the normalised innovations of those that belonged to
        a known line.  The others start new lines."""
        innovations: list[float] = []
        taken: set[int] = set()
        fresh: list[LineMeasurement] = []
        for line in sorted(measured, key=lambda m: m.sigma_m):
            offset, sigma = line.offset_m, line.sigma_m
            index = self._nearest(offset, sigma, taken)
            if index is None:
                fresh.append(line)
                continue
            taken.add(index)
            self._unseen_s = 0.0
            kf = self._filter()
            kf.H = np.zeros((1, len(self._x)))
            kf.H[0, 2 + index] = 1.0
            variance = float(self._p[2 + index, 2 + index]) + sigma**2
            innovations.append((offset - float(self._x[2 + index])) / variance**0.5)
            kf.update(np.array([[offset]]), R=np.array([[sigma**2]]))
            self._keep(kf)
            track = self._tracks[index]
            track.seen_ns, track.hits = stamp_ns, track.hits + 1
            track.width_m += 0.2 * (line.width_m - track.width_m)
            track.from_m, track.to_m = line.from_m, line.to_m
        if innovations:
            self._bias += _BIAS_GAIN * (sum(innovations) / len(innovations) - self._bias)
        for line in fresh:
            self._add(line, stamp_ns)
        self._forget(stamp_ns)
        return innovations

    def forget(self) -> None:
        """Know nothing any more: no lines, and a velocity as uncertain as at the start."""
        noise = self._noise
        self._tracks = []
        self._bias = 0.0
        self._x = np.zeros(2)
        self._p = np.diag([noise.start_velocity_mps**2, noise.start_disturbance_mps2**2])

    def _filter(self) -> KalmanFilter:
        return KalmanFilter(self._x.reshape(-1, 1), self._p)

    def _keep(self, kf: KalmanFilter) -> None:
        self._x = np.asarray(kf.x, dtype=float).reshape(-1)
        limit = self._noise.max_disturbance_mps2
        self._x[1] = min(max(self._x[1], -limit), limit)
        covariance: Matrix = np.asarray(kf.P, dtype=float)
        self._p = (covariance + covariance.T) / 2

    def _nearest(self, offset: float, sigma: float, taken: set[int]) -> int | None:
        best, best_distance = None, self._gate_m
        for i in range(len(self._tracks)):
            if i in taken:
                continue
            distance = abs(offset - float(self._x[2 + i]))
            spread = float(np.sqrt(self._p[2 + i, 2 + i] + sigma**2))
            if distance < best_distance and distance < max(_GATE_SIGMAS * spread, 0.3 * self._gate_m):
                best, best_distance = i, distance
        return best

    def _add(self, line: LineMeasurement, stamp_ns: int) -> None:
        n = len(self._x)
        self._x = np.append(self._x, line.offset_m)
        grown = np.zeros((n + 1, n + 1))
        grown[:n, :n] = self._p
        grown[n, n] = line.sigma_m**2
        self._p = grown
        self._tracks.append(_Track(self._next_id, line.width_m, stamp_ns, line.from_m, line.to_m))
        self._next_id += 1

    def _forget(self, stamp_ns: int) -> None:
        order = sorted(range(len(self._tracks)), key=lambda i: -self._tracks[i].seen_ns)[: self._max_lines]
        keep = sorted(i for i in order if stamp_ns - self._tracks[i].seen_ns <= self._forget_ns)
        if len(keep) == len(self._tracks):
            return
        rows = [0, 1, *(2 + i for i in keep)]
        self._x = self._x[rows]
        self._p = self._p[np.ix_(rows, rows)]
        self._tracks = [self._tracks[i] for i in keep]


class HeadingTracker:
    """Offset between the vehicle's own yaw and the grid's (yaw on the grid = vehicle yaw + offset),
    and its drift; lines tell it modulo 90 degrees."""

    def __init__(self, offset_rad: float, sigma_rad: float, drift_radps: float = 0.002) -> None:
        self._kf = KalmanFilter(np.array([[offset_rad], [0.0]]), np.diag([sigma_rad**2, 0.005**2]))
        self._kf.H = np.array([[1.0, 0.0]])
        self._drift = drift_radps

    @property
    def offset_rad(self) -> float:
        return float(self._kf.x[0, 0])

    @property
    def sigma_rad(self) -> float:
        return float(np.sqrt(self._kf.P[0, 0]))

    def restart(self, innovation_rad: float, sigma_rad: float) -> None:
        """The vehicle's yaw has jumped: the offset is another one, as uncertain as at the start."""
        self._kf.x = np.array([[self.offset_rad + innovation_rad], [0.0]])
        self._kf.P = np.diag([sigma_rad**2, 0.005**2])

    def predict(self, dt_s: float) -> None:
        self._kf.F = np.array([[1.0, dt_s], [0.0, 1.0]])
        self._kf.Q = np.diag([self._drift**2 * dt_s, (self._drift * 0.1) ** 2 * dt_s])
        self._kf.predict()

    def update(self, innovation_rad: float, sigma_rad: float) -> None:
        """Take a measured offset as its difference from the held one."""
        self._kf.update(np.array([[self.offset_rad + innovation_rad]]), R=np.array([[sigma_rad**2]]))
