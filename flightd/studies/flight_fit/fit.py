"""Whole flights fitted by Gauss and Newton, the lines of the map among the unknowns."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flightd.config.schema import Config
from flightd.core.errors import RunError
from flightd.core.geometry import Matrix
from flightd.site.site import Site
from flightd.studies.flight_fit.linearised import FlightState, Linearised, linearised
from flightd.studies.flight_fit.motion import BELIEVED, LEAK_PER_S, PSI, SENSORS, STATES, Motion, Sensor, X, Y
from flightd.studies.flight_fit.record import FlightRecord
from flightd.studies.flight_fit.shutter import frames_of_one_moment
from flightd.studies.flight_fit.sights import PaintedLines, Sights, associate

_GATES_M = (0.45, 0.25, 0.12, 0.12)
"""So far from where it should be a line is taken, round by round."""
_STEPS = 3
"""Of Gauss and Newton in each round."""
_BREAK_S = 0.2
"""Frames farther apart are not linked."""
_LEAST_FRAMES = 50
"""In each flight, with a line of the map in them: by fewer no sensor is told better than it was believed."""
_SHAKE_RAD = np.radians([0.15, 0.15, 0.1])
_LEAST_SHAKE_RAD = math.radians(0.02)


@dataclass(frozen=True, slots=True)
class LineBelief:
    """What was believed of the (L,) lines before: sigmas of their places beside the map, metres, and of their
    angles, radians; 0 for what is given."""

    offset_m: Matrix
    angle_rad: Matrix


@dataclass(frozen=True, slots=True)
class Fit:
    """What came out: the flights, the lines' (L,) places beside the map along x or y (metres) and angles
    (radians, clockwise), the covariance of (all flights' sensors, places, angles), in how many frames each
    was seen (L,), and the size of the sights' residuals in their own sigmas."""

    flights: tuple[FlightState, ...]
    offset_m: Matrix
    angle_rad: Matrix
    covariance: Matrix
    sightings: NDArray[np.int64]
    misfit: float

    def sensor_sigmas(self, flight: int) -> Matrix:
        return self._sigmas(flight * SENSORS, SENSORS)

    @property
    def offset_sigma_m(self) -> Matrix:
        return self._sigmas(len(self.flights) * SENSORS, len(self.offset_m))

    @property
    def angle_sigma_rad(self) -> Matrix:
        return self._sigmas(len(self.flights) * SENSORS + len(self.offset_m), len(self.offset_m))

    def _sigmas(self, start: int, count: int) -> Matrix:
        variances = np.diagonal(self.covariance)[start : start + count]
        result: Matrix = np.sqrt(np.clip(variances, 0.0, None))
        return result


def fit_flights(
    records: Sequence[FlightRecord],
    configs: Sequence[Config],
    site: Site,
    belief: LineBelief,
    sensor_sigmas: Matrix = BELIEVED,
) -> Fit:
    """Fit flights over one map, each with sensors of its own.  RunError where they do not determine it."""
    lines = PaintedLines.of(site)
    flights = [_begun(record, config) for record, config in zip(records, configs, strict=True)]
    offset_m, angle_rad = np.zeros(len(lines.at_m)), np.zeros(len(lines.at_m))
    covariance, squares = np.zeros((0, 0)), np.zeros(0)
    for gate_m in _GATES_M:
        for one, config in zip(flights, configs, strict=True):
            one.frames = frames_of_one_moment(one, config.camera.readout_s)
            one.sights = associate(
                one.frames, site, one.believed_lens(), one.believed_mount(), one.poses(), offset_m, gate_m
            )
            _demand_lines(one)
        for _ in range(_STEPS):
            try:
                step, covariance, squares = _step(flights, lines, offset_m, angle_rad, belief, sensor_sigmas)
            except np.linalg.LinAlgError:
                raise RunError("what was seen does not determine where the drone was") from None
            offset_m, angle_rad = offset_m + step[0], angle_rad + step[1]
    sightings = np.sum([one.sights.counted(len(offset_m)) for one in flights], axis=0)
    misfit = math.sqrt(float(np.median(squares)) / _MEDIAN_SQUARE) if len(squares) else math.nan
    return Fit(tuple(flights), offset_m, angle_rad, covariance, sightings, misfit)


def _demand_lines(flight: FlightState) -> None:
    """RunError where hardly a line of the map was found in a flight."""
    known, frames = len(np.unique(flight.sights.frame)), len(flight.frames)
    if known < _LEAST_FRAMES:
        raise RunError(
            f"lines of the map are where they should be in {known} of {frames} frames, "
            f"{_LEAST_FRAMES} are needed",
            file=flight.record.path,
            remedy="check line_width_m of the site and where the drone thought it was (flightd report)",
        )


_MEDIAN_SQUARE = 2.0 * math.log(2.0)
"""Of a squared residual with two degrees of freedom."""


def _begun(record: FlightRecord, config: Config) -> FlightState:
    """A flight as it was flown: the recorded poses, sensors as configured."""
    told, flown = record.attitudes.at(record.frame_s), record.poses.at(record.frame_s)
    states = np.zeros((len(record.frame_s), STATES))
    states[:, [X, Y]] = flown[:, :2]
    turned = flown[:, 2] - told[:, 2]
    states[:, PSI] = turned - math.tau * np.round((turned - math.remainder(turned[0], math.tau)) / math.tau)
    sensors = np.zeros(SENSORS)
    sensors[Sensor.LEAK] = LEAK_PER_S
    steps_s = np.diff(record.frame_s)
    linked = steps_s <= _BREAK_S
    start = np.flatnonzero(linked)
    motion = Motion(record.attitudes, record.frame_s[start], steps_s[start], config.tracking.expert.noise)
    nothing = Sights(np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros((0, 2, 2)), np.zeros((0, 2, 2)))
    camera = config.camera
    return FlightState(
        record,
        camera.lens(),
        camera.mount(),
        motion,
        linked,
        states,
        np.zeros((len(states), 3)),
        _SHAKE_RAD.copy(),
        sensors,
        nothing,
        record.frames,
    )


def _step(
    flights: Sequence[FlightState],
    lines: PaintedLines,
    offset_m: Matrix,
    angle_rad: Matrix,
    belief: LineBelief,
    sensor_sigmas: Matrix,
) -> tuple[tuple[Matrix, Matrix], Matrix, Matrix]:
    """Move the flights; the step of the lines' places and angles, the covariance, the squared residuals."""
    lines = lines.moved(offset_m, angle_rad)
    parts = [linearised(one, lines) for one in flights]
    solved = [part.chain.eliminate() for part in parts]
    count, sensors = len(offset_m), len(flights) * SENSORS
    total, rhs = np.zeros((sensors + 2 * count,) * 2), np.zeros(sensors + 2 * count)
    places = [_places(flight, sensors, count) for flight in range(len(flights))]
    for left, place in zip(solved, places, strict=True):
        total[np.ix_(place, place)] += left.shared
        rhs[place] += left.rhs
    value = np.concatenate([*(one.sensors for one in flights), offset_m, angle_rad])
    sigma = np.concatenate([*(sensor_sigmas for _ in flights), belief.offset_m, belief.angle_rad])
    expected = np.zeros_like(value)
    expected[np.arange(len(flights)) * SENSORS + Sensor.LEAK] = LEAK_PER_S
    free = sigma > 0.0
    total[free, free] += sigma[free] ** -2.0
    rhs[free] -= (value - expected)[free] * sigma[free] ** -2.0
    covariance = np.zeros_like(total)
    covariance[np.ix_(free, free)] = np.linalg.inv(total[np.ix_(free, free)])
    step = covariance @ rhs
    for one, part, left, place in zip(flights, parts, solved, places, strict=True):
        _move(one, part, left.substitute(step[place]), step[place])
    squares = np.concatenate([part.squares for part in parts])
    return (step[sensors : sensors + count], step[sensors + count :]), covariance, squares


def _places(flight: int, sensors: int, count: int) -> NDArray[np.int64]:
    own = np.arange(SENSORS) + flight * SENSORS
    return np.concatenate([own, np.arange(2 * count) + sensors])


def _move(flight: FlightState, part: Linearised, states: Matrix, shared: Matrix) -> None:
    size = states.shape[1]
    by = part.shakes_by
    shakes = by[:, :, -1] - by[:, :, size:-1] @ shared - np.einsum("kia,ka->ki", by[:, :, :size], states)
    flight.states = flight.states + states
    flight.shakes = flight.shakes + shakes
    flight.sensors = flight.sensors + shared[:SENSORS]
    flight.sensors[Sensor.LEAK] = min(max(flight.sensors[Sensor.LEAK], 0.0), 1.0)
    seen = np.unique(flight.sights.frame)
    told = (flight.shakes[seen] ** 2 + part.shake_variance[seen]).mean(axis=0)
    flight.shake_rad = np.maximum(np.sqrt(told), _LEAST_SHAKE_RAD)
