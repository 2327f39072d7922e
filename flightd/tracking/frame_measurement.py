"""What the sights of one frame measure of the filter's state, as rows of the measurement."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from flightd.core.geometry import Matrix
from flightd.tracking.innovations import Innovations
from flightd.tracking.line_sight import LineSight, Rates
from flightd.tracking.motion_model import (
    DELAY,
    FIRST_LINE,
    HEIGHT,
    HEIGHT_SCALE,
    MOUNT_PITCH,
    MOUNT_ROLL,
    MOUNT_YAW,
    PITCH,
    PSI,
    ROLL,
    SCALE,
    VELOCITY,
)

_ASKEW_RAD, _ASKEW_SIGMAS = math.radians(1.5), 4.0
"""Paint that runs along the grid does so within a degree."""
_TILTS = [ROLL, PITCH, MOUNT_ROLL, MOUNT_PITCH]


class FrameMeasurement:
    """Errors that the state should bring to 0, with their derivative by the state (n,) and variances."""

    def __init__(self) -> None:
        self.rows: list[Matrix] = []
        self.errors: list[float] = []
        self.variances: list[float] = []
        self.by_tilt: list[tuple[float, float]] = []
        self.axes: list[int | None] = []
        """Across which axis an offset was seen; None for a direction."""

    def add_offset(
        self,
        sight: LineSight,
        line: int,
        lever_m: float,
        x: Matrix,
        rates: Rates,
        before: Matrix | None = None,
    ) -> None:
        """The offset seen less that of the line held; `before` are the first states by which the sight was
        placed where they are others now."""
        row, error_m = offset_error(sight, line, lever_m, x, rates)
        if before is not None:
            error_m += float(row[:FIRST_LINE] @ (x[:FIRST_LINE] - before))
        self._add(row, error_m, sight.sigma_m, sight.offset_per_tilt, sight.axis)

    def add_turns(
        self, sights: Sequence[LineSight], x: Matrix, p: Matrix, rates: Rates, innovations: Innovations
    ) -> None:
        """The heading held less the one that each line's direction tells.

        A line that contradicts heading and tilt further than they are doubted, by the covariance `p` (n, n)
        of the state and the camera's shaking, is askew, or the heading is wrong.  It tells no tilt: it would
        tell one of as many degrees, all the time; and nothing where more lines agree with the heading."""
        turns = [(sight, _turn_row(sight, x, rates)) for sight in sights if not math.isnan(sight.turn_rad)]
        agree = []
        for sight, row in turns:
            shaken = innovations.shake_variance(sight.turn_per_tilt)
            doubt_rad = math.sqrt(float(row @ p @ row) + sight.sigma_theta_rad**2 + shaken)
            agree.append(abs(sight.turn_rad) < max(_ASKEW_RAD, _ASKEW_SIGMAS * doubt_rad))
        outvoted = agree.count(True) > agree.count(False)
        for (sight, row), agrees in zip(turns, agree, strict=True):
            if not agrees:
                row[_TILTS] = 0.0
            if agrees or not outvoted:
                self._add(row, sight.turn_rad, sight.sigma_theta_rad, sight.turn_per_tilt, None)

    def _add(
        self, row: Matrix, error: float, sigma: float, by_tilt: tuple[float, float], axis: int | None
    ) -> None:
        self.rows.append(row)
        self.errors.append(error)
        self.variances.append(sigma**2)
        self.by_tilt.append(by_tilt)
        self.axes.append(axis)


def offset_error(
    sight: LineSight, line: int, lever_m: float, x: Matrix, rates: Rates
) -> tuple[Matrix, float]:
    """d(seen offset - held offset) / d state, and that error; the line is the one held at place `line`, with
    that lever."""
    column = FIRST_LINE + line
    row = placed(sight, x, rates)
    row[column] = -1.0
    row[SCALE], row[HEIGHT], row[HEIGHT_SCALE] = lever_m - sight.axis_m, lever_m, lever_m
    return row, sight.offset_m - float(x[column])


def placed(sight: LineSight, x: Matrix, rates: Rates) -> Matrix:
    """d(seen offset) / d state: (n,)."""
    row = np.zeros(len(x))
    (by_roll, by_pitch), by_yaw = sight.offset_per_tilt, sight.offset_per_yaw
    row[ROLL], row[PITCH] = by_roll, by_pitch
    row[MOUNT_ROLL], row[MOUNT_PITCH] = sight.offset_per_mount
    row[MOUNT_YAW] = sight.offset_per_mount_yaw
    row[PSI] = by_yaw
    turning = by_roll * rates.roll_radps + by_pitch * rates.pitch_radps + by_yaw * rates.yaw_radps
    row[DELAY] = turning + x[VELOCITY[sight.axis]]
    row[SCALE], row[HEIGHT], row[HEIGHT_SCALE] = sight.offset_m - sight.axis_m, sight.offset_m, sight.offset_m
    return row


def _turn_row(sight: LineSight, x: Matrix, rates: Rates) -> Matrix:
    """d(heading held less the one told) / d state: (n,)."""
    row = np.zeros(len(x))
    by_roll, by_pitch = sight.turn_per_tilt
    row[PSI] = 1.0
    row[ROLL], row[PITCH] = by_roll, by_pitch
    row[MOUNT_ROLL], row[MOUNT_PITCH] = sight.turn_per_mount
    row[MOUNT_YAW] = 1.0
    row[DELAY] = by_roll * rates.roll_radps + by_pitch * rates.pitch_radps + rates.yaw_radps
    return row
