"""How likely an observation is at each place where the drone may be: the sensor model.

Every function returns factors of the same shape, one for each of N places, to be multiplied into their
weights.  All are bounded away from 0: paint is worn, tape is stuck to floors, labels hang wrong, and no
single observation may decide alone.  The shares come from what the line detector reaches on rendered and
real floors (about 5 % of cross lines missed, 2 % false), rounded up.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from flightd.core.geometry import Matrix
from flightd.site.painted_lines import Features

Indices: TypeAlias = NDArray[np.int64]
Flags: TypeAlias = NDArray[np.bool_]

_BITS = np.array([arms.bit_count() for arms in range(16)])


@dataclass(frozen=True, slots=True)
class SensorModel:
    """Shares, densities per metre and spreads in metres."""

    line_seen: float = 0.95
    """A painted line that passes below is seen."""
    false_line_per_m: float = 0.02
    elsewhere_line_per_m: float = 0.5
    """Lines per metre on a floor of which nothing is known."""
    survey_m: float = 0.02
    rough_share: float = 0.1
    rough_m: float = 0.08
    """This share of lines is seen with this error: skew paint, a kink, a bad fit."""
    arm_seen: float = 0.96
    """An arm of a crossing is told rightly (after a vote of frames)."""
    end_found: float = 0.8
    """An end of a line that was in view was told."""
    end_false: float = 0.02
    end_strange: float = 0.3
    """A line that is none of the map ends just there: it may end anywhere."""
    mat_found: float = 0.95
    mat_strange: float = 0.05
    """A mat lies where the map has none: it was pushed away, or is none."""
    mat_gate_m: float = 0.5
    feature_gate_m: float = 0.25
    fix_tail: float = 1e-4
    """A marker or label hangs somewhere else."""


def line_density(model: SensorModel, residual_m: Matrix, sigma_m: Matrix, covered: Flags) -> Matrix:
    """p(a painted line is seen there) for (N, L) residuals to each map line, (N) sigmas: a mixture of the
    exact and the rough observation, 0 where the line is not `covered` with paint in that part."""
    spread = np.hypot(sigma_m, model.survey_m)[:, None]
    exact = np.exp(-0.5 * (residual_m / spread) ** 2) / (spread * math.sqrt(math.tau))
    wide = np.hypot(spread, model.rough_m)
    rough = np.exp(-0.5 * (residual_m / wide) ** 2) / (wide * math.sqrt(math.tau))
    density = model.line_seen * ((1.0 - model.rough_share) * exact + model.rough_share * rough)
    result: Matrix = np.where(covered, density, 0.0)
    return result


def crossing_likelihood(model: SensorModel, crossings: Features, at_m: Matrix, arms: int) -> Matrix:
    """p(these arms) at (N, 2) points.  Where the map has no crossing the lines themselves have told so."""
    nearest, distance = _nearest(crossings, at_m)
    if nearest is None:
        return np.ones(len(at_m))
    wrong = _BITS[crossings.arms[nearest] ^ arms]
    told = model.arm_seen ** (4 - wrong) * (1.0 - model.arm_seen) ** wrong
    usual = model.arm_seen**4
    result: Matrix = np.where(distance < model.feature_gate_m, told, usual)
    return result


def end_likelihood(model: SensorModel, ends: Features, at_m: Matrix, arms: int, strange: Flags) -> Matrix:
    """p(a line ends so) at (N, 2) points; (N) `strange` where the line is none of the map."""
    same = np.flatnonzero(ends.arms == arms)
    nearest, distance = _nearest(_pick(ends, same), at_m)
    if nearest is None:
        distance = np.full(len(at_m), math.inf)
    unexpected = np.where(strange, model.end_strange, model.end_false)
    result: Matrix = np.where(~strange & (distance < model.feature_gate_m), model.end_found, unexpected)
    return result


def mat_likelihood(model: SensorModel, mats_m: Matrix, at_m: Matrix) -> Matrix:
    """p(a pad's mat lies there) at (N, 2) points, for (M, 2) mats of the map."""
    apart = np.hypot(mats_m[None, :, 0] - at_m[:, None, 0], mats_m[None, :, 1] - at_m[:, None, 1])
    near = (apart < model.mat_gate_m).any(axis=1)
    result: Matrix = np.where(near, model.mat_found, model.mat_strange)
    return result


def fix_likelihood(model: SensorModel, error_m: Matrix, sigma_m: float) -> Matrix:
    """p(a thing of known place is seen `error_m` (N) from there)."""
    result: Matrix = np.exp(-0.5 * (error_m / sigma_m) ** 2) + model.fix_tail
    return result


def _pick(features: Features, which: Indices) -> Features:
    return Features(features.at_m[which], features.arms[which], features.axis[which], features.line[which])


def _nearest(features: Features, at_m: Matrix) -> tuple[Indices | None, Matrix]:
    """Index of the nearest feature to each point and its distance; None when there is none at all."""
    if not len(features.at_m):
        return None, np.full(len(at_m), math.inf)
    apart = np.hypot(
        features.at_m[None, :, 0] - at_m[:, None, 0], features.at_m[None, :, 1] - at_m[:, None, 1]
    )
    nearest: Indices = apart.argmin(axis=1)
    return nearest, apart[np.arange(len(at_m)), nearest]
