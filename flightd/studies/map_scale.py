"""How long a metre of a fitted map is.

Pictures tell shapes; lengths come from the height told, divided by the focal length configured, and from what
is known besides: how wide the lines are painted, where the map has them, and what somebody measured.  Each
says by what factor the fitted lengths are too short, and how surely; the weighted mean is taken.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flightd.config.control import TiltCompensation
from flightd.core.geometry import Matrix
from flightd.core.types import Attitude
from flightd.studies.flight_fit.linearised import FlightState
from flightd.tracking.tilt_compensation import FloorView, heights_by_width

_CAMERA_SIGMA = 0.008
"""Of a range finder and a focal length."""
_PAINT_SIGMA, _PAINT_SPREAD, _LEAST_WIDTHS = 0.0025, 0.03, 200
"""Of the lines' width as painted and as seen in all, of one sight, and the least sights that count."""
_LEAST_SPAN_PX = 120.0
_LEAST_MAP_SIGMA_M = 0.02
"""Of each line's place on a map, about where it should be; more where they differ by more."""
_TAPE_SIGMA_M = 0.005
_BELIEVABLE = 0.25


@dataclass(frozen=True, slots=True)
class Distance:
    """A distance of two nodes that somebody measured."""

    a: str
    b: str
    metres: float


@dataclass(frozen=True, slots=True)
class ScaleWitness:
    """One source: fitted lengths times `factor` are the true ones, by what it says."""

    source: str
    factor: float
    sigma: float


@dataclass(frozen=True, slots=True)
class MapScale:
    """What all sources together say."""

    factor: float
    sigma: float
    witnesses: tuple[ScaleWitness, ...]


def map_scale(
    flights: Sequence[FlightState],
    line_width_m: float,
    from_home_m: tuple[Matrix, Matrix],
    measured: Sequence[tuple[Distance, float]],
) -> MapScale:
    """The scale by all that is known.  `from_home_m` are the lines' (L,) distances from home on the map
    and as fitted, `measured` each distance with the fitted one."""
    witnesses = [ScaleWitness("height and focal length as configured", 1.0, _CAMERA_SIGMA)]
    witnesses += _by_widths(flights, line_width_m) + _by_map(*from_home_m)
    witnesses += [
        ScaleWitness(f"{one.a}-{one.b} as measured", one.metres / fitted_m, _TAPE_SIGMA_M / one.metres)
        for one, fitted_m in measured
    ]
    return mean_scale(witnesses)


def mean_scale(witnesses: Sequence[ScaleWitness]) -> MapScale:
    """Their mean, weighed by how sure each is."""
    weights = [one.sigma**-2 for one in witnesses]
    total = math.fsum(weights)
    factor = math.fsum(one.factor * weight for one, weight in zip(witnesses, weights, strict=True)) / total
    return MapScale(factor, total**-0.5, tuple(witnesses))


def _by_widths(flights: Sequence[FlightState], line_width_m: float) -> list[ScaleWitness]:
    """The height by which the lines would be seen as wide as they are painted, against the one told."""
    shares = np.array([share for flight in flights for share in _width_shares(flight, line_width_m)])
    believable = shares[np.abs(shares - 1.0) < _BELIEVABLE]
    if len(believable) < _LEAST_WIDTHS:
        return []
    sigma = math.hypot(_PAINT_SIGMA, _PAINT_SPREAD / math.sqrt(len(believable) / 10.0))
    return [ScaleWitness("width of the lines", float(np.median(believable)), sigma)]


def _width_shares(flight: FlightState, line_width_m: float) -> list[float]:
    poses, mount = flight.poses(), flight.believed_mount()
    shares = []
    for k, seen in enumerate(flight.frames):
        told_m = float(poses.height_m[k])
        attitude = Attitude(0, float(poses.roll_rad[k]), float(poses.pitch_rad[k]), 0.0)
        view = FloorView(flight.lens, mount, attitude, told_m, TiltCompensation.EXACT, 0.0)
        long = [line for line in seen.lines if line.span_px >= _LEAST_SPAN_PX]
        shares += [height_m / told_m for height_m in heights_by_width(long, view, line_width_m)]
    return shares


def _by_map(map_m: Matrix, fitted_m: Matrix) -> list[ScaleWitness]:
    """The factor that brings the fitted lines nearest to where the map has them."""
    spread = float(fitted_m @ fitted_m)
    if not spread > 1.0:
        return []
    factor = float(map_m @ fitted_m) / spread
    rest_m = float(np.sqrt(np.mean((map_m - factor * fitted_m) ** 2)))
    return [ScaleWitness("map", factor, max(rest_m, _LEAST_MAP_SIGMA_M) / math.sqrt(spread))]
