"""What was wrong with a drone's sensors, by the whole of one flight and the map it was flown over.

Focal length and height stretch the floor alike, and a fit that may stretch it makes it too small (see
`map_fit`): so the stretch is told first, by the lines' width and the map, and what is left is fitted with it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flightd.config.control import TiltCompensation
from flightd.config.schema import Config
from flightd.core.errors import RunError
from flightd.core.geometry import Matrix
from flightd.core.types import Attitude, Line
from flightd.site.painted_lines import PaintMap
from flightd.site.site import Site
from flightd.studies.flight_fit.fit import Fit, LineBelief, fit_flights
from flightd.studies.flight_fit.linearised import FlightState
from flightd.studies.flight_fit.motion import BELIEVED, Sensor
from flightd.studies.flight_fit.record import FlightRecord
from flightd.studies.map_fit import fit_map
from flightd.studies.map_scale import MapScale, mean_scale
from flightd.tracking.tilt_compensation import FloorView, heights_by_width

_MAP_SIGMA_M, _ANGLE_SIGMA_RAD = 0.02, math.radians(0.1)
_STAMP_SIGMA_S = 0.004
"""Of the times by which frames and attitudes are compared, beyond what the clocks tell of themselves: what
goes to the autopilot and what comes from it are not equally long on their way."""
_BEND_SIGMA = 0.008
"""What looks like a lens residual in the widths of lines seen at the picture's edge."""
_LEAST_WIDTHS, _LEAST_SPAN_PX, _BELIEVABLE = 300, 120.0, 0.25
_TOLD_SHARE = 0.5
"""What is known no better than by so much of what was believed before was not told."""
_TURNED_RAD = math.radians(60.0)


@dataclass(frozen=True, slots=True)
class FittedSensors:
    """All of `Sensor` (SENSORS,), true less configured or told, with sigmas; those not among `told` are as
    believed before.  `turned_rad` is how far the drone turned, `misfit` about 1 where all fits."""

    values: Matrix
    sigmas: Matrix
    told: frozenset[Sensor]
    turned_rad: float
    misfit: float
    frames: int

    @property
    def turned(self) -> bool:
        """Far enough that what turns with the drone differs from what does not."""
        return self.turned_rad >= _TURNED_RAD


def fit_sensors(record: FlightRecord, config: Config, site: Site) -> FittedSensors:
    """Fit the sensors of one flight.  RunError where its lines do not tell where it was."""
    stretch = _stretch(record, config, site)
    camera = config.camera
    focal = 1.0 if stretch is None else 1.0 / stretch.factor
    really = camera.model_copy(update={"fx_px": camera.fx_px * focal, "fy_px": camera.fy_px * focal})
    fit = _fitted(record, config.model_copy(update={"camera": really}), site)
    values, sigmas = fit.flights[0].sensors.copy(), fit.sensor_sigmas(0)
    sigmas[Sensor.DELAY] = math.hypot(sigmas[Sensor.DELAY], record.clock_error_s, _STAMP_SIGMA_S)
    values[Sensor.FOCAL] = math.log(focal)
    sigmas[Sensor.FOCAL] = BELIEVED[Sensor.FOCAL] if stretch is None else stretch.sigma
    sigmas[Sensor.HEIGHT] = BELIEVED[Sensor.HEIGHT]
    values[Sensor.BEND], sigmas[Sensor.BEND] = _bend(fit.flights[0], site.line_width_m)
    told = frozenset(one for one in Sensor if sigmas[one] < _TOLD_SHARE * BELIEVED[one])
    yaw = record.attitudes.at(record.frame_s)[:, 2]
    turned_rad = float(yaw.max() - yaw.min())
    return FittedSensors(values, sigmas, told, turned_rad, fit.misfit, len(record.frames))


def _fitted(record: FlightRecord, config: Config, site: Site) -> Fit:
    count = sum(len(axis.at_m) for axis in PaintMap.of(site).axes)
    belief = LineBelief(np.full(count, _MAP_SIGMA_M), np.full(count, _ANGLE_SIGMA_RAD))
    sensors = BELIEVED.copy()
    sensors[[Sensor.FOCAL, Sensor.HEIGHT, Sensor.BEND]] = 0.0
    return fit_flights([record], [config], site, belief, sensors)


def _stretch(record: FlightRecord, config: Config, site: Site) -> MapScale | None:
    """By what factor lengths are longer than told, by the lines' width and the map alone; None where neither
    tells it."""
    try:
        found = fit_map([record], [config], site)
    except RunError:
        return None
    by_floor = found.scale.witnesses[1:]  # without what is asked for here
    return mean_scale(by_floor) if by_floor else None


def _bend(flight: FlightState, line_width_m: float) -> tuple[float, float]:
    """The lens residual and its sigma: how much wider lines are seen towards the picture's edge.

    A point one focal length from the middle that is really farther out by the share k makes a line through p
    with the normal n look narrower by k (p² + 2 (n·p)²)."""
    rows = np.array(list(_widths(flight, line_width_m))).reshape(-1, 2)
    rows = rows[np.abs(rows[:, 1]) < _BELIEVABLE]
    if len(rows) < _LEAST_WIDTHS:
        return 0.0, float(BELIEVED[Sensor.BEND])
    design = np.stack([np.ones(len(rows)), rows[:, 0]], axis=1)
    weight = np.ones(len(rows))
    solved = np.zeros(2)
    for _ in range(5):  # Huber's weights: a stain beside a line is no lens
        weighed = design * weight[:, None]
        solved = np.linalg.solve(weighed.T @ design, weighed.T @ rows[:, 1])
        rest = np.abs(rows[:, 1] - design @ solved)
        scale = max(1.4826 * float(np.median(rest)), 1e-6)
        weight = np.minimum(1.0, 1.5 * scale / np.maximum(rest, 1e-9))
    spread = float(np.average((rows[:, 0] - np.average(rows[:, 0], weights=weight)) ** 2, weights=weight))
    by_noise = scale / math.sqrt(max(spread, 1e-9) * len(rows) / 10.0)
    return float(solved[1]), math.hypot(_BEND_SIGMA, by_noise)


def _widths(flight: FlightState, line_width_m: float) -> list[tuple[float, float]]:
    """(p² + 2 (n·p)², logarithm of the height by the width over the height) of each long line seen."""
    poses, mount, lens = flight.poses(), flight.believed_mount(), flight.lens
    found = []
    for k, seen in enumerate(flight.frames):
        height_m = float(poses.height_m[k])
        attitude = Attitude(0, float(poses.roll_rad[k]), float(poses.pitch_rad[k]), 0.0)
        view = FloorView(lens, mount, attitude, height_m, TiltCompensation.EXACT, 0.0)
        for line in _long(seen.lines):
            for by_width_m in heights_by_width([line], view, line_width_m):
                x, y = line.point_at((line.start_px + line.end_px) / 2)
                far2 = (x * x + y * y + 2.0 * line.rho_px**2) / lens.fx_px**2
                found.append((far2, math.log(max(by_width_m, 1e-3) / height_m)))
    return found


def _long(lines: Sequence[Line]) -> list[Line]:
    return [line for line in lines if line.span_px >= _LEAST_SPAN_PX]
