"""How likely an observation is at each place where the drone may be: the sensor model.

Every function returns factors, to be multiplied into the weights of N places, (N, C) where the C floors that
it may be explain what is seen differently well, (N, 1) elsewhere.  All are bounded away from 0: paint is
worn, tape is stuck to floors, labels hang wrong, and no single observation may decide alone.

How worn a floor is nobody says beforehand, and the traces of one worn part (a line missed, lines that end
where none should, crossings without an arm) come together.  By shares of a kept floor alone a few such parts
outweigh every line that is where the map has it; by shares of a worn one a miscount on a kept floor would
pass.  So it is weighed with the places which `FloorState` it is.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
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
class FloorState:
    """Shares and densities per metre on a floor in this state; `prior` is how often one is, in parts of all
    the states that are thought of."""

    prior: float
    line_seen: float
    """A painted line that passes below is seen."""
    false_line_per_m: float
    arm_seen: float
    """An arm of a crossing is told rightly (after a vote of frames)."""
    end_found: float
    """An end of a line that was in view was told."""
    end_false: float
    """A line that the map has ends where it should not."""


KEPT = FloorState(0.9, 0.95, 0.02, 0.96, 0.8, 0.02)
"""What the line detector reaches on rendered and real floors (about 5 % of cross lines missed, 2 % false),
rounded up."""
WORN = FloorState(0.09, 0.88, 0.06, 0.9, 0.7, 0.1)
"""A tenth of the paint gone, tape here and there."""
RUINED = FloorState(0.01, 0.75, 0.15, 0.8, 0.6, 0.25)
"""A quarter of the paint gone, and more lines that belong to nothing than anyone should leave there."""


class SensorModel:
    """Shares, densities per metre and spreads in metres; what depends on the floor's state is an array (C),
    one for each of `floors`."""

    elsewhere_line_per_m = 0.5
    """Lines per metre on a floor of which nothing is known."""
    strange_run_m = 3.0
    """Lines that the map does not have, there or elsewhere, go on so far (mean)."""
    survey_m = 0.02
    rough_share = 0.1
    rough_m = 0.08
    """This share of lines is seen with this error: skew paint, a kink, a bad fit."""
    crossing_strange = (0.0, 0.0, 0.02, 0.1, 0.5)
    """Lines cross where the map has no crossing, by how many arms are told, these ones."""
    end_strange = 0.3
    """A line that is none of the map ends just there: it may end anywhere."""
    mat_found = 0.95
    mat_strange = 0.05
    """A mat lies where the map has none: it was pushed away, or is none."""
    mat_gate_m = 0.5
    feature_gate_m = 0.25
    fix_tail = 1e-4
    """A marker or label hangs somewhere else."""

    def __init__(self, floors: Sequence[FloorState] = (KEPT, WORN, RUINED)) -> None:
        priors = np.array([floor.prior for floor in floors])
        self.floor_prior: Matrix = priors / priors.sum()
        self.line_seen: Matrix = np.array([floor.line_seen for floor in floors])
        self.false_line_per_m: Matrix = np.array([floor.false_line_per_m for floor in floors])
        self.arm_seen: Matrix = np.array([floor.arm_seen for floor in floors])
        self.end_found: Matrix = np.array([floor.end_found for floor in floors])
        self.end_false: Matrix = np.array([floor.end_false for floor in floors])


def line_density(model: SensorModel, residual_m: Matrix, sigma_m: Matrix, covered: Flags) -> Matrix:
    """p(a line that is seen is seen there) for (N, L) residuals to each map line, (N) sigmas: a mixture of
    the exact and the rough observation, 0 where the line is not `covered` with paint in that part."""
    spread = np.hypot(sigma_m, model.survey_m)[:, None]
    exact = np.exp(-0.5 * (residual_m / spread) ** 2) / (spread * math.sqrt(math.tau))
    wide = np.hypot(spread, model.rough_m)
    rough = np.exp(-0.5 * (residual_m / wide) ** 2) / (wide * math.sqrt(math.tau))
    density = (1.0 - model.rough_share) * exact + model.rough_share * rough
    result: Matrix = np.where(covered, density, 0.0)
    return result


def crossing_likelihood(model: SensorModel, crossings: Features, at_m: Matrix, arms: int) -> Matrix:
    """p(these arms, two or more) at (N, 2) points.  That the map has no crossing there the lines themselves
    have told."""
    nearest, distance = _nearest(crossings, at_m)
    if nearest is None:
        return np.ones((len(at_m), 1))
    wrong = _BITS[crossings.arms[nearest] ^ arms][:, None]
    told = model.arm_seen ** (4 - wrong) * (1.0 - model.arm_seen) ** wrong
    strange = model.crossing_strange[arms.bit_count()]
    result: Matrix = np.where(distance[:, None] < model.feature_gate_m, told, strange)
    return result


def end_likelihood(model: SensorModel, ends: Features, at_m: Matrix, arms: int, strange: Flags) -> Matrix:
    """p(a line ends so) at (N, 2) points; (N) `strange` where the line is none of the map."""
    same = np.flatnonzero(ends.arms == arms)
    nearest, distance = _nearest(_pick(ends, same), at_m)
    if nearest is None:
        distance = np.full(len(at_m), math.inf)
    unexpected = np.where(strange[:, None], model.end_strange, model.end_false)
    expected = ~strange & (distance < model.feature_gate_m)
    result: Matrix = np.where(expected[:, None], model.end_found, unexpected)
    return result


def mat_likelihood(model: SensorModel, mats_m: Matrix, at_m: Matrix) -> Matrix:
    """p(a pad's mat lies there) at (N, 2) points, for (M, 2) mats of the map."""
    apart = np.hypot(mats_m[None, :, 0] - at_m[:, None, 0], mats_m[None, :, 1] - at_m[:, None, 1])
    near = (apart < model.mat_gate_m).any(axis=1, keepdims=True)
    result: Matrix = np.where(near, model.mat_found, model.mat_strange)
    return result


def fix_likelihood(model: SensorModel, error_m: Matrix, sigma_m: float) -> Matrix:
    """p(a thing of known place is seen `error_m` (N) from there)."""
    result: Matrix = (np.exp(-0.5 * (error_m / sigma_m) ** 2) + model.fix_tail)[:, None]
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
