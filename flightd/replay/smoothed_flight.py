"""Where the drone was, judged afterwards: the recorded poses smoothed over the whole flight.

In the air a pose knows only what came before it.  A line that is found again after a blank stretch tells
where the drone was on the way there, too: the backward pass of Rauch, Tung and Striebel (AIAA Journal 3,
1965) hands that back.  The recorded pose is the forward pass, its covariance included, so nothing is
filtered twice.

Pure.  The two axes of the map say nothing of each other: each is smoothed by itself, in closed form.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from flightd.core.types import GridPose

Array: TypeAlias = NDArray[np.float64]

_STEPS = 20_000
"""Longer flights are thinned to so many poses: 50 Hz for seven minutes, 5 Hz for an hour."""

_MOST = 1e6
"""m, m/s, m²: a log may hold any number, no hall does."""

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

    Poses that no hall has, that have no variance, or that come no later than the one before, are left out.
    """
    chosen = _usable(poses)
    stamps_ns = np.array([p.stamp_ns for p in chosen], np.int64)
    places = np.array([((p.x_m, p.vx_mps), (p.y_m, p.vy_mps)) for p in chosen], np.float64).reshape(-1, 2, 2)
    live = np.array([(p.covariance[0], p.covariance[4]) for p in chosen], np.float64).reshape(-1, 2)
    smoothed, variances = places.copy(), live.copy()
    for part in _unbroken(stamps_ns, places, live):
        steps_s = (np.diff(stamps_ns[part]) * 1e-9).tolist()
        for axis in range(2):
            smoothed[part, axis], variances[part, axis] = backward(
                steps_s, places[part, axis].tolist(), live[part, axis].tolist()
            )
    # the live doubt may grow faster than this model's; what is known afterwards is never less than live
    sigmas = np.sqrt(np.clip(variances, 0.0, live))
    (x, vx), (y, vy) = smoothed.transpose(1, 2, 0)
    return SmoothedFlight(stamps_ns, x, y, vx, vy, sigmas[:, 0], sigmas[:, 1])


def backward(
    steps_s: Sequence[float], places: Sequence[tuple[float, float]], variances_m2: Sequence[float]
) -> tuple[list[tuple[float, float]], list[float]]:
    """Place and speed of one axis, and the place's variance, given what came after; each of `places` (m, m/s)
    was known live with its variance and was `steps_s` before the next."""
    x, v = places[-1]
    p, c, s = variances_m2[-1], 0.0, _VELOCITY_SIGMA_MPS**2  # covariance of place and speed: p c, c s
    found, left = [(x, v)], [p]
    for dt_s, (x0, v0), p0 in zip(steps_s[::-1], places[-2::-1], variances_m2[-2::-1], strict=True):
        s0 = _VELOCITY_SIGMA_MPS**2
        foreseen_p, foreseen_c = p0 + s0 * dt_s**2 + _DRIFT_MPRTS**2 * dt_s, s0 * dt_s
        foreseen_s = s0 + _ACCEL_MPS2**2 * dt_s
        whole = foreseen_p * foreseen_s - foreseen_c**2
        gain_xx = (p0 * foreseen_s) / whole
        gain_xv = (-p0 * foreseen_c) / whole
        gain_vx = (s0 * dt_s * foreseen_s - s0 * foreseen_c) / whole
        gain_vv = (s0 * foreseen_p - s0 * dt_s * foreseen_c) / whole
        off_m, off_mps = x - x0 - dt_s * v0, v - v0
        dp, dc, ds = p - foreseen_p, c - foreseen_c, s - foreseen_s
        x, v = x0 + gain_xx * off_m + gain_xv * off_mps, v0 + gain_vx * off_m + gain_vv * off_mps
        p = p0 + gain_xx**2 * dp + 2.0 * gain_xx * gain_xv * dc + gain_xv**2 * ds
        c = gain_vx * (gain_xx * dp + gain_xv * dc) + gain_vv * (gain_xx * dc + gain_xv * ds)
        s = s0 + gain_vx**2 * dp + 2.0 * gain_vx * gain_vv * dc + gain_vv**2 * ds
        found.append((x, v))
        left.append(p)
    return found[::-1], left[::-1]


def _usable(poses: Sequence[GridPose]) -> list[GridPose]:
    chosen: list[GridPose] = []
    for pose in poses[:: max(1, math.ceil(len(poses) / _STEPS))]:
        numbers = (pose.x_m, pose.y_m, pose.vx_mps, pose.vy_mps, pose.covariance[0], pose.covariance[4])
        sensible = all(abs(number) < _MOST for number in numbers) and min(numbers[-2:]) >= 0.0
        if sensible and (not chosen or pose.stamp_ns > chosen[-1].stamp_ns):
            chosen.append(pose)
    return chosen


def _unbroken(stamps_ns: NDArray[np.int64], places: Array, variances_m2: Array) -> Iterator[slice]:
    """The stretches in which each pose follows from the one before, of two poses at least."""
    steps_s = np.diff(stamps_ns) * 1e-9
    place, speed = places[:, :, 0], places[:, :, 1]
    leap_m = np.abs(place[1:] - place[:-1] - speed[:-1] * steps_s[:, None])
    sigma_m = np.sqrt(variances_m2[:-1] + _DRIFT_MPRTS**2 * steps_s[:, None])
    leaps = (leap_m > np.maximum(_LEAP_M, _LEAP_SIGMAS * sigma_m)).any(axis=1)
    ends = np.flatnonzero(leaps | (steps_s > _GAP_S)) + 1
    bounds = [0, *ends.tolist(), len(stamps_ns)]
    for start, end in itertools.pairwise(bounds):
        if end - start > 1:
            yield slice(start, end)
