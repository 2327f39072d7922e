"""Where the drone was, judged afterwards: the recorded poses smoothed over the whole flight.

In the air a pose knows only what came before it.  A line that is found again after a blank stretch tells
where the drone was on the way there, too: the backward pass of Rauch, Tung and Striebel (AIAA Journal 3,
1965) hands that back.  The recorded pose is the forward pass, its covariance included, so nothing is
filtered twice.

Pure but for the library, filterpy, which is of the extra `smooth`: it brings 150 MB and takes a second to
import, too much for the drone.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from flightd.core.extras import missing_extra
from flightd.core.types import GridPose

Array: TypeAlias = NDArray[np.float64]

_STEPS = 20_000
"""Longer flights are thinned to so many poses: 50 Hz for seven minutes, 5 Hz for an hour."""

_DRIFT_MPRTS = 0.03
"""What the position gains in doubt between two sightings, metres per square root of a second: the value at
which eight simulated flights came nearest to their truth, 2 to 24 % nearer than live."""
_VELOCITY_SIGMA_MPS = 0.015
"""The recorded velocity has no covariance; measured against the simulator's truth."""
_ACCEL_MPS2 = 0.3
"""Density of what accelerates the drone, per square root of a second."""

_GAP_S = 1.0
"""Poses farther apart belong to two flights: what is known after it says nothing of before."""
_LEAP_M, _LEAP_SIGMAS = 0.3, 4.0
"""A step beyond both is a change of mind (another place is believed in), not a motion to be smoothed."""


@dataclass(frozen=True, slots=True)
class SmoothedFlight:
    """Arrays of one length, NaN nowhere; map frame as in `GridPose`.  The sigmas are of one axis each."""

    stamp_ns: NDArray[np.int64]
    x_m: Array
    y_m: Array
    vx_mps: Array
    vy_mps: Array
    sigma_x_m: Array
    sigma_y_m: Array


def smooth(poses: Sequence[GridPose]) -> SmoothedFlight:
    """Smooth a flight's poses, which are in the order of their stamps.

    Poses that are not numbers, or come no later than the one before, are left out.  UnavailableError where
    the library is missing.
    """
    try:
        from filterpy.kalman import rts_smoother  # noqa: PLC0415 - of an extra, and slow to import
    except ImportError:
        raise missing_extra("smooth", "the smoothed track") from None
    chosen = _usable(poses)
    states = np.array([(p.x_m, p.vx_mps, p.y_m, p.vy_mps) for p in chosen], np.float64).reshape(-1, 4, 1)
    spreads = np.array([_spread(p) for p in chosen], np.float64).reshape(-1, 4, 4)
    stamps_ns = np.array([p.stamp_ns for p in chosen], np.int64)
    live = np.diagonal(spreads, axis1=1, axis2=2).copy()
    for part in _unbroken(stamps_ns, states, spreads):
        steps_s = np.append(np.diff(stamps_ns[part]) * 1e-9, 0.0)
        motions, noises = [_motion(dt_s) for dt_s in steps_s], [_noise(dt_s) for dt_s in steps_s]
        states[part], spreads[part], *_ = rts_smoother(states[part], spreads[part], motions, noises)
    # the live doubt may grow faster than this model's; what is known afterwards is never less than live
    sigmas = np.sqrt(np.clip(np.diagonal(spreads, axis1=1, axis2=2), 0.0, live))
    x, vx, y, vy = states[:, :, 0].T
    return SmoothedFlight(stamps_ns, x, y, vx, vy, sigmas[:, 0], sigmas[:, 2])


def _usable(poses: Sequence[GridPose]) -> list[GridPose]:
    chosen: list[GridPose] = []
    for pose in poses[:: max(1, math.ceil(len(poses) / _STEPS))]:
        numbers = (pose.x_m, pose.y_m, pose.vx_mps, pose.vy_mps, pose.covariance[0], pose.covariance[4])
        if all(map(math.isfinite, numbers)) and (not chosen or pose.stamp_ns > chosen[-1].stamp_ns):
            chosen.append(pose)
    return chosen


def _spread(pose: GridPose) -> Array:
    """Covariance of (x, vx, y, vy)."""
    speed = _VELOCITY_SIGMA_MPS**2
    return np.diag([pose.covariance[0], speed, pose.covariance[4], speed])


def _motion(dt_s: float) -> Array:
    axis = np.array([[1.0, dt_s], [0.0, 1.0]])
    return np.kron(np.eye(2), axis)


def _noise(dt_s: float) -> Array:
    return np.diag([_DRIFT_MPRTS**2 * dt_s, _ACCEL_MPS2**2 * dt_s] * 2)


def _unbroken(stamps_ns: NDArray[np.int64], states: Array, spreads: Array) -> Iterator[slice]:
    """The stretches in which each pose follows from the one before, of two poses at least."""
    steps_s = np.diff(stamps_ns) * 1e-9
    place, speed = states[:, ::2, 0], states[:, 1::2, 0]
    leap_m = np.abs(place[1:] - place[:-1] - speed[:-1] * steps_s[:, None])
    sigma_m = np.sqrt(np.diagonal(spreads, axis1=1, axis2=2)[:-1, ::2] + _DRIFT_MPRTS**2 * steps_s[:, None])
    leaps = (leap_m > np.maximum(_LEAP_M, _LEAP_SIGMAS * sigma_m)).any(axis=1)
    ends = np.flatnonzero(leaps | (steps_s > _GAP_S)) + 1
    bounds = [0, *ends.tolist(), len(stamps_ns)]
    for start, end in itertools.pairwise(bounds):
        if end - start > 1:
            yield slice(start, end)
