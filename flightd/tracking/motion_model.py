"""How the drone's motion over the lines, and what it does not know of its sensors, go on from one moment to
the next: the state of the filter of both, and its transition.  Pure.

The state is

    heading offset and its drift | velocity, disturbance of both grid axes | error of the told height
    | error of the told attitude | rate of its leak | mount of the camera | delay of its frames
    | share by which its focal length is shorter | share by which the height is told too small for good
    | offsets of all lines and features of the floor held

Lines and features stand still, so all of them move with the one velocity; the control input is the
acceleration that the attitude makes, g tan(tilt).  An autopilot without a position takes what its
accelerometers feel for the vertical, so that while it accelerates its attitude leaks towards the one at which
it would not.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from flightd.core.geometry import GRAVITY_MPS2, Matrix
from flightd.core.types import Attitude

PSI, PSI_RATE, VX, VY, PUSH_X, PUSH_Y, HEIGHT = range(7)
ROLL, PITCH, LEAK, MOUNT_ROLL, MOUNT_PITCH, MOUNT_YAW, DELAY, SCALE, HEIGHT_SCALE = range(7, 16)
FIRST_LINE = 16
HEIGHT_S = 0.5
"""Time within which an error of the told height, that of one averaged over a few samples, fades."""
VELOCITY, PUSH = (VX, VY), (PUSH_X, PUSH_Y)
"""By grid axis, x and y."""
_VELOCITIES, _PUSHES = slice(VX, VY + 1), slice(PUSH_X, PUSH_Y + 1)


class Told(NamedTuple):
    """The attitude that the vehicle tells, its own yaw included."""

    roll_rad: float
    pitch_rad: float
    yaw_rad: float


class Step(NamedTuple):
    """A step of the state: (n,) where it ends, its (n, n) derivative by where it began, and (n, 2) what an
    acceleration along each grid axis would add to it."""

    state: Matrix
    jacobian: Matrix
    by_accel: Matrix


class Carrier(NamedTuple):
    """What accelerates the drone by what is known at one moment: errors of the told attitude, the angle to
    the grid, and for each grid axis the steady push of the air and what a gust adds, fading in `gust_s`."""

    roll_rad: float
    pitch_rad: float
    psi_rad: float
    steady_mps2: tuple[float, float]
    gust_mps2: tuple[float, float]
    gust_s: float

    def accel(self, told: Attitude, ahead_s: float) -> tuple[float, float]:
        """Acceleration along the grid axes (m/s2) so much later, in that attitude: as `lean` and the push
        make it, for a hundred steps in each control tick while nothing is seen."""
        roll, pitch = told.roll_rad + self.roll_rad, told.pitch_rad + self.pitch_rad
        yaw = told.yaw_rad + self.psi_rad
        ax, ay = _leant(roll, pitch, math.cos(yaw), math.sin(yaw))
        left = math.exp(-ahead_s / self.gust_s)
        (steady_x, steady_y), (gust_x, gust_y) = self.steady_mps2, self.gust_mps2
        return ax + (steady_x + gust_x * left), ay + (steady_y + gust_y * left)


def _leant(roll_rad: float, pitch_rad: float, cos: float, sin: float) -> tuple[float, float]:
    """Acceleration along the grid axes (m/s2) at constant height; `cos` and `sin` are of the yaw to them."""
    forward, right = -GRAVITY_MPS2 * math.tan(pitch_rad), GRAVITY_MPS2 * math.tan(roll_rad)
    return cos * forward - sin * right, sin * forward + cos * right


def lean(x: Matrix, told: Told) -> tuple[tuple[float, float], tuple[float, float], tuple[float, float]]:
    """Acceleration along the grid axes (m/s2) that the attitude makes at constant height, and what a radian
    more of roll and of pitch would make."""
    roll, pitch = told.roll_rad + float(x[ROLL]), told.pitch_rad + float(x[PITCH])
    yaw = told.yaw_rad + float(x[PSI])
    cos, sin = math.cos(yaw), math.sin(yaw)
    per_roll, per_pitch = GRAVITY_MPS2 / math.cos(roll) ** 2, -GRAVITY_MPS2 / math.cos(pitch) ** 2
    return (
        _leant(roll, pitch, cos, sin),
        (-sin * per_roll, cos * per_roll),
        (cos * per_pitch, sin * per_pitch),
    )


def moved(
    x: Matrix, axes: Sequence[int], told: Told, dt_s: float, drag_per_s: float, attitude_s: float
) -> Step:
    """The state (n,) after `dt_s` in the told attitude; `axes` are those across which each line held lies,
    `attitude_s` is the time within which errors of the attitude fade."""
    n, end = len(x), x.copy()
    (ax, ay), by_roll, by_pitch = lean(x, told)
    (vx, vy), (push_x, push_y) = x[_VELOCITIES].tolist(), x[_PUSHES].tolist()
    accel = np.array([ax + push_x - drag_per_s * vx, ay + push_y - drag_per_s * vy])
    jacobian = np.eye(n)
    jacobian[PSI, PSI_RATE] = dt_s
    for axis, (velocity, push) in enumerate(zip(VELOCITY, PUSH, strict=True)):
        jacobian[velocity, velocity] = 1.0 - drag_per_s * dt_s
        jacobian[velocity, push] = dt_s
        jacobian[velocity, ROLL] = by_roll[axis] * dt_s
        jacobian[velocity, PITCH] = by_pitch[axis] * dt_s
    jacobian[VX, PSI], jacobian[VY, PSI] = -ay * dt_s, ax * dt_s
    by_accel = np.zeros((n, 2))
    by_accel[VX, 0] = by_accel[VY, 1] = dt_s
    way_m = (x[_VELOCITIES] * dt_s + 0.5 * accel * dt_s * dt_s).tolist()
    for row, axis in enumerate(axes, FIRST_LINE):
        velocity = VELOCITY[axis]
        jacobian[row] -= 0.5 * dt_s * jacobian[velocity]
        jacobian[row, velocity] -= 0.5 * dt_s
        by_accel[row, axis] = -0.5 * dt_s * dt_s
        end[row] -= way_m[axis]
    jacobian[HEIGHT, HEIGHT] = math.exp(-dt_s / HEIGHT_S)
    end[HEIGHT] *= jacobian[HEIGHT, HEIGHT]
    end[PSI] += x[PSI_RATE] * dt_s
    end[_VELOCITIES] += accel * dt_s
    _leak(x, end, jacobian, accel, (ax, ay), told, dt_s, drag_per_s, attitude_s)
    return Step(end, jacobian, by_accel)


def _leak(
    x: Matrix,
    end: Matrix,
    jacobian: Matrix,
    accel: Matrix,
    leant: tuple[float, float],
    told: Told,
    dt_s: float,
    drag_per_s: float,
    attitude_s: float,
) -> None:
    """Let the errors of the told roll and pitch leak to those at which the drone would not accelerate, and
    fade; `leant` is the part of the acceleration `accel` that the lean makes."""
    yaw_rad = told.yaw_rad + float(x[PSI])
    ahead = np.array([math.cos(yaw_rad), math.sin(yaw_rad)]) / GRAVITY_MPS2
    aside = np.array([-math.sin(yaw_rad), math.cos(yaw_rad)]) / GRAVITY_MPS2
    felt = accel - leant
    keep, part = math.exp(-dt_s / attitude_s), float(x[LEAK]) * dt_s
    cosines = math.cos(told.roll_rad + float(x[ROLL])), math.cos(told.pitch_rad + float(x[PITCH]))
    for row, by_felt, by_turn, cos in zip(
        (ROLL, PITCH), (aside, -ahead), (-ahead, -aside), cosines, strict=True
    ):
        way = float(by_felt @ accel) - float(x[row])
        end[row] = x[row] * keep + part * way
        jacobian[row, row] = keep + part * (1.0 / cos**2 - 1.0)  # who leans more accelerates more
        jacobian[row, LEAK] = way * dt_s
        jacobian[row, PSI] = part * float(by_turn @ felt)
        jacobian[row, _PUSHES] = part * by_felt
        jacobian[row, _VELOCITIES] = -drag_per_s * part * by_felt
