"""How the drone moves from one frame to the next, by the attitude that it was told to have.

The state of a frame is

    x, y | velocity | heading less the told yaw | true less told roll, pitch | push of the air | height beside
    the told one

The told attitude leaks towards the one that the accelerometers feel, as in `tracking.motion_model`; here the
errors leak to a steady bias of the flight, and the push of the air to a steady draught.
"""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass

import numpy as np

from flightd.config.tracking import MotionNoise
from flightd.core.geometry import GRAVITY_MPS2, Matrix
from flightd.studies.flight_fit.record import Series

X, Y, VX, VY, PSI, ROLL, PITCH, PUSH_X, PUSH_Y, HEIGHT = range(10)
STATES = 10


class Sensor(enum.IntEnum):
    """What is unknown of one flight's drone; all true less told or configured.

    DELAY: frames are exposed so much later than their stamps say, s; MOUNT_*: rad; FOCAL: logarithm of the
    focal length's ratio; BEND: lens residual, share by which a point one focal length from the middle really
    lies farther out; HEIGHT: share by which the drone is higher than told; BIAS_*: of the attitude, rad;
    LEAK: rate, 1/s; DRAUGHT_*: steady acceleration in the map frame, m/s2."""

    DELAY = 0
    MOUNT_ROLL = 1
    MOUNT_PITCH = 2
    MOUNT_YAW = 3
    FOCAL = 4
    BEND = 5
    HEIGHT = 6
    BIAS_ROLL = 7
    BIAS_PITCH = 8
    LEAK = 9
    DRAUGHT_X = 10
    DRAUGHT_Y = 11


SENSORS = len(Sensor)
BELIEVED = np.array(
    [0.06, *np.radians([4.0, 4.0, 6.0]), 0.03, 0.03, 0.01, *np.radians([1.5, 1.5]), 0.1, 0.03, 0.03]
)
"""Sigmas of all sensors before anything was seen; around 0, of the leak around LEAK_PER_S."""
LEAK_PER_S = 0.1
_DRAUGHT = [Sensor.DRAUGHT_X, Sensor.DRAUGHT_Y]
_BIAS = [Sensor.BIAS_ROLL, Sensor.BIAS_PITCH]

_PLACE_M = 0.001
_HEADING_RADPRTS = math.radians(0.1)
_WANDER_RADPRTS = math.radians(0.1)
_HEIGHT_S, _HEIGHT_M = 1.5, 0.008
_DELAY_STEP_S = 0.005
FIRST = np.array([2.0, 2.0, 1.0, 1.0, 1.0, *np.radians([0.7, 0.7]), 0.2, 0.2, _HEIGHT_M])
"""Sigmas of a first state; errors of the attitude are around the bias."""


@dataclass(frozen=True, slots=True)
class Motion:
    """The steps of one flight: (S,) places of the states from which they go on, times (s) and lengths."""

    attitudes: Series
    at_s: Matrix
    dt_s: Matrix
    noise: MotionNoise

    def after(self, states: Matrix, sensors: Matrix, late_s: float = 0.0) -> Matrix:
        """(S, n) where (S, n) states lead within their step; `sensors` (SENSORS,)."""
        dt, noise = self.dt_s, self.noise
        told = self.attitudes.at(self.at_s + dt / 2 + sensors[Sensor.DELAY] + late_s)
        roll, pitch = told[:, 0] + states[:, ROLL], told[:, 1] + states[:, PITCH]
        yaw = told[:, 2] + states[:, PSI]
        cos, sin = np.cos(yaw), np.sin(yaw)
        forward, right = -GRAVITY_MPS2 * np.tan(pitch), GRAVITY_MPS2 * np.tan(roll)
        lean = np.stack([cos * forward - sin * right, sin * forward + cos * right], axis=-1)
        velocity, push = states[:, [VX, VY]], states[:, [PUSH_X, PUSH_Y]]
        accel = lean + push - noise.drag_per_s * velocity
        end = states.copy()
        end[:, [X, Y]] += velocity * dt[:, None] + 0.5 * accel * dt[:, None] ** 2
        end[:, [VX, VY]] += accel * dt[:, None]
        keep = np.exp(-dt / noise.gust_s)[:, None]
        end[:, [PUSH_X, PUSH_Y]] = push * keep + sensors[_DRAUGHT] * (1.0 - keep)
        ahead = (cos * accel[:, 0] + sin * accel[:, 1]) / GRAVITY_MPS2
        aside = (-sin * accel[:, 0] + cos * accel[:, 1]) / GRAVITY_MPS2
        level = np.stack([aside, -ahead], axis=-1) + sensors[_BIAS]
        leak = (sensors[Sensor.LEAK] * dt)[:, None]
        end[:, [ROLL, PITCH]] += leak * (level - states[:, [ROLL, PITCH]])
        end[:, HEIGHT] *= np.exp(-dt / _HEIGHT_S)
        return end

    def by_states(self, states: Matrix, sensors: Matrix) -> Matrix:
        """(S, n, n) derivative of `after` by the states."""
        return _derivative(lambda moved: self.after(moved, sensors), states)

    def by_sensors(self, states: Matrix, sensors: Matrix) -> Matrix:
        """(S, n, SENSORS) derivative of `after` by the sensors."""
        result = np.zeros((len(states), STATES, SENSORS))
        late, early = (self.after(states, sensors, step) for step in (_DELAY_STEP_S, -_DELAY_STEP_S))
        result[:, :, Sensor.DELAY] = (late - early) / (2 * _DELAY_STEP_S)
        for one in (*_BIAS, Sensor.LEAK, *_DRAUGHT):
            step = np.zeros(SENSORS)
            step[one] = 1e-5
            up, down = self.after(states, sensors + step), self.after(states, sensors - step)
            result[:, :, one] = (up - down) / 2e-5
        return result

    def variances(self) -> Matrix:
        """(S, n) of what each step adds to what one knows not."""
        dt, noise = self.dt_s[:, None], self.noise
        fade = 1.0 - np.exp(-2.0 * dt / _HEIGHT_S)
        per_s = np.zeros(STATES)
        per_s[[X, Y]] = _PLACE_M**2 * 30.0
        per_s[[VX, VY]] = noise.accel_mps2**2
        per_s[PSI] = _HEADING_RADPRTS**2
        per_s[[ROLL, PITCH]] = _WANDER_RADPRTS**2
        per_s[[PUSH_X, PUSH_Y]] = noise.disturbance_mps2**2
        result: Matrix = per_s * dt
        result[:, HEIGHT] = _HEIGHT_M**2 * fade[:, 0]
        return result


def _derivative(after, states: Matrix) -> Matrix:  # type: ignore[no-untyped-def]
    result = np.zeros((len(states), STATES, STATES))
    for one in range(STATES):
        step = np.zeros(STATES)
        step[one] = 1e-5
        result[:, :, one] = (after(states + step) - after(states - step)) / 2e-5
    return result
