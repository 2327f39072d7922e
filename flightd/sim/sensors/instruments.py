"""What the autopilot believes: the truth seen through its gyro, compass, barometer and range finder."""

from __future__ import annotations

import math
import random
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from flightd.core.geometry import GRAVITY_MPS2, wrap_pi
from flightd.sim.plant.airframe import Airframe
from flightd.sim.plant.kinematics import Kinematics
from flightd.sim.sensors.battery_monitor import BatteryMonitor, MonitorParams
from flightd.sim.sensors.steel_field import SteelField
from flightd.sim.sensors.vibration import STILL, Vibration


class Goods(NamedTuple):
    """What stands on the floor below the drone's way: a box in the map frame, and its height."""

    x0_m: float
    y0_m: float
    x1_m: float
    y1_m: float
    height_m: float


@dataclass(frozen=True, slots=True)
class SensorParams:
    """Errors of a cheap autopilot indoors.

    `heading_offset_rad` is what the compass reads along the map's x axis; no one can know it beforehand.
    """

    heading_offset_rad: float = 0.7
    yaw_drift_radps: float = math.radians(0.03)
    yaw_noise_rad: float = math.radians(0.1)
    gyro_noise_radps: float = math.radians(0.3)
    gyro_share: float = 0.0
    """The most by which a gyro tells a rate too large or too small, as a share of it."""
    tilt_rate_bias_radps: tuple[float, float] = (0.0, 0.0)
    """By so much the rates about the body's axes of roll and pitch are told too large."""
    compass_rad: float = 0.0
    """The most by which steel turns the compass at any place."""
    compass_s: float = 5.0
    """Within this time the estimator believes its compass rather than its gyro."""
    tilt_bias_rad: float = math.radians(0.3)
    tilt_bias: tuple[float, float] | None = None
    """Roll and pitch told too large (rad); None: drawn within `tilt_bias_rad`."""
    tilt_wander_rad: float = math.radians(0.1)
    leak_s: float | None = None
    """An estimator without a position takes what its accelerometers feel for the vertical: within this time
    its tilt leaks to the one that they feel, nearly level in any steady flight.  None: it does not."""
    baro_wander_m: float = 0.01
    climb_noise_mps: float = 0.02
    wander_s: float = 20.0
    range_min_m: float = 0.05
    range_max_m: float = 8.0
    range_noise_m: float = 0.005
    range_step_m: float = 0.01
    range_dropout: float = 0.005
    range_lag_s: float = 0.0
    """Time constant with which it follows the distance."""
    range_echo: float = 0.0
    """Share of readings that came back by a longer way."""
    goods: Sequence[Goods] = ()
    battery: MonitorParams = field(default_factory=MonitorParams)
    vibration: Vibration = STILL
    """That of the camera on its mount, of which the airframe has a part."""


_AIRFRAME_SHARE = 0.1
"""The airframe turns by so much of what it shakes the camera: half a degree of it would be 300 deg/s on its
gyros at 100 Hz, ten times what flight logs show of a drone that still flies."""
_GYRO_FILTER_HZ = 40.0
"""What autopilots leave of it: PX4's IMU_GYRO_CUTOFF as it is shipped; ArduCopter's INS_GYRO_FILTER is 20."""
_LEAST_COS = 0.3
"""Leaned over further, nothing comes back."""
_LONGER_WAY = 1.15, 1.8
"""An echo by racks or goods comes back by so much of the way."""


@dataclass(slots=True)
class SensorFault:
    """What is wrong with the sensors just now, beyond their usual errors."""

    roll_rad: float = 0.0
    pitch_rad: float = 0.0
    yaw_rad: float = 0.0
    range_m: float = 0.0
    range_lost: bool = False
    range_stuck_m: float | None = None
    """What the range finder reads whatever is below it; None: it measures."""
    range_swing_m: float = 0.0
    """How much more than that it reads at times."""
    range_share: float = 1.0
    """What it reads for a metre."""
    climb_stuck_mps: float | None = None
    """What is told of the climb rate whatever it is; None: as it is estimated."""
    climb_drift_mps: float = 0.0
    """How much too fast it believes to climb, by its height too, as a barometer whose air is moved has it."""
    charge_pc: int | None = None
    """What is told of the charge whatever the battery holds; None: it is measured."""
    range_quality_pc: int = 0
    """What it tells of its signal: 0 is nothing, 1 that there is none."""


class Sensors:
    """Estimates of one airframe; `update` after each of its steps."""

    def __init__(self, params: SensorParams | None = None, seed: int = 0) -> None:
        self.params = p = params or SensorParams()
        self.fault = SensorFault()
        self._rng = rng = random.Random(seed)
        self._roll_bias = rng.uniform(-p.tilt_bias_rad, p.tilt_bias_rad)
        self._pitch_bias = rng.uniform(-p.tilt_bias_rad, p.tilt_bias_rad)
        if p.tilt_bias is not None:
            self._roll_bias, self._pitch_bias = p.tilt_bias
        self._roll_leak = self._pitch_leak = self._drifted_m = 0.0
        self.aided = False
        """The estimator is told of its motion: it does not take what its accelerometers feel for the
        vertical."""
        self._steel = SteelField(p.compass_rad, seed) if p.compass_rad else None
        self._bent_rad: float | None = None
        self._yaw_drift = rng.uniform(-p.yaw_drift_radps, p.yaw_drift_radps)
        self._yaw_error = p.heading_offset_rad
        self._gyro_rng = gyros = random.Random(f"gyros {seed}")
        self._gyro_scale = 1.0 + gyros.uniform(-p.gyro_share, p.gyro_share)
        self._roll_wander = self._pitch_wander = self._baro_wander = self._climb_error = 0.0
        self.roll_rad = self.pitch_rad = self.yaw_rad = 0.0
        self.height_m = self.climb_mps = self.accel_mps2 = 0.0
        self._climb_mps: float | None = None
        self.battery = BatteryMonitor(p.battery)
        self._below_m: float | None = None
        self._elapsed_s = 0.0

    @property
    def tilt_cos(self) -> float:
        """How much of the thrust lifts, by the attitude as it is estimated."""
        return math.cos(self.roll_rad) * math.cos(self.pitch_rad)

    @property
    def told_climb_mps(self) -> float:
        """The estimate of the climb rate as it is told."""
        stuck_mps = self.fault.climb_stuck_mps
        return self.climb_mps if stuck_mps is None else stuck_mps

    @property
    def roll_error_rad(self) -> float:
        """Estimate minus truth."""
        return self._roll_bias + self._roll_wander + self._roll_leak + self.fault.roll_rad

    @property
    def pitch_error_rad(self) -> float:
        return self._pitch_bias + self._pitch_wander + self._pitch_leak + self.fault.pitch_rad

    @property
    def drift_rad(self) -> tuple[float, float]:
        """What of the errors of roll and pitch an estimator that is told of its motion can see: all but what
        its accelerometers are wrong by for good."""
        return self._roll_wander + self._roll_leak, self._pitch_wander + self._pitch_leak

    def correct_tilt(self, roll_rad: float, pitch_rad: float) -> None:
        """The estimator has found itself wrong: so much more roll and pitch."""
        self._roll_leak += roll_rad
        self._pitch_leak += pitch_rad

    @property
    def yaw_error_rad(self) -> float:
        """Estimate minus truth, the compass's heading of the map's x axis included."""
        return self._yaw_error + (self._bent_rad or 0.0) + self.fault.yaw_rad

    def update(self, dt_s: float, airframe: Airframe) -> None:
        """Follow the airframe's present truth after `dt_s`."""
        p, gauss = self.params, self._rng.gauss
        self._elapsed_s += dt_s
        fade = dt_s / p.wander_s
        kick = math.sqrt(2.0 * fade)
        self._roll_wander += -self._roll_wander * fade + gauss(0.0, p.tilt_wander_rad * kick)
        self._pitch_wander += -self._pitch_wander * fade + gauss(0.0, p.tilt_wander_rad * kick)
        self._baro_wander += -self._baro_wander * fade + gauss(0.0, p.baro_wander_m * kick)
        fast = dt_s / 0.2
        self._climb_error += -self._climb_error * fast + gauss(0.0, p.climb_noise_mps * math.sqrt(2.0 * fast))
        self._yaw_error += self._yaw_drift * dt_s
        if self._steel is not None:
            read_rad = self._steel.error_rad(airframe.x_m, airframe.y_m)
            if self._bent_rad is None:  # it was switched on here
                self._bent_rad = read_rad
            self._bent_rad += (read_rad - self._bent_rad) * dt_s / p.compass_s
        self._leak(dt_s, airframe)
        self.roll_rad = airframe.roll_rad + self.roll_error_rad
        self.pitch_rad = airframe.pitch_rad + self.pitch_error_rad
        self.yaw_rad = wrap_pi(airframe.yaw_rad + self.yaw_error_rad)
        self._drifted_m += self.fault.climb_drift_mps * dt_s
        above_m = airframe.height_m - airframe.params.rest_height_m
        self.height_m = above_m + self._baro_wander + self._drifted_m
        self.climb_mps = airframe.climb_mps + self._climb_error + self.fault.climb_drift_mps
        last_mps = airframe.climb_mps if self._climb_mps is None else self._climb_mps
        self.accel_mps2, self._climb_mps = (airframe.climb_mps - last_mps) / dt_s, airframe.climb_mps
        self.battery.update(dt_s, airframe)
        if p.range_lag_s:
            below_m = self._to_below_m(airframe)
            last_m = below_m if self._below_m is None else self._below_m
            self._below_m = last_m + (below_m - last_m) * min(dt_s / p.range_lag_s, 1.0)

    def _leak(self, dt_s: float, airframe: Airframe) -> None:
        """Rotors push along the body's axis, so the accelerometers feel level, but for the drag."""
        leak_s = self.params.leak_s
        if airframe.on_floor:
            self._roll_leak = self._pitch_leak = 0.0
        if leak_s is None or airframe.on_floor or self.aided:
            return
        cos, sin = math.cos(airframe.yaw_rad), math.sin(airframe.yaw_rad)
        (air_x, air_y, _), share = airframe.air_mps, airframe.params.drag_per_s / GRAVITY_MPS2
        east, south = airframe.vx_mps - air_x, airframe.vy_mps - air_y
        felt_pitch, felt_roll = -share * (cos * east + sin * south), share * (-sin * east + cos * south)
        part = dt_s / leak_s
        self._roll_leak -= part * (airframe.roll_rad + self._roll_leak - felt_roll)
        self._pitch_leak -= part * (airframe.pitch_rad + self._pitch_leak - felt_pitch)

    def body_rates_radps(self, truth: Kinematics) -> tuple[float, float, float]:
        """What the gyros tell about the body's axes, less what the estimator knows of their biases; that of
        the yaw has the bias by which the heading drifts."""
        shakes = self.params.vibration.filtered_rates_radps(self._elapsed_s, _GYRO_FILTER_HZ)
        gauss, scale, noise = self._gyro_rng.gauss, self._gyro_scale, self.params.gyro_noise_radps
        roll, pitch, yaw = (
            scale * rate + gauss(0.0, noise)
            for rate in (truth.roll_rate_radps, truth.pitch_rate_radps, truth.yaw_rate_radps)
        )
        bias_roll, bias_pitch = self.params.tilt_rate_bias_radps
        by_roll, by_pitch = (_AIRFRAME_SHARE * rate for rate in shakes)
        return roll + bias_roll + by_roll, pitch + bias_pitch + by_pitch, yaw + self._yaw_drift

    def noisy_yaw_rad(self) -> float:
        """The yaw estimate as a telemetry sample: with its noise."""
        return wrap_pi(self.yaw_rad + self._rng.gauss(0.0, self.params.yaw_noise_rad))

    def range_m(self, airframe: Airframe) -> float:
        """One range finder sample along the body's z axis, quantised; 0 when nothing came back."""
        p = self.params
        if self.fault.range_stuck_m is not None:
            return self.fault.range_stuck_m + self._rng.uniform(0.0, self.fault.range_swing_m)
        tilt_cos = airframe.tilt_cos
        if tilt_cos < _LEAST_COS or self._rng.random() < p.range_dropout or self.fault.range_lost:
            return 0.0
        below_m = self._to_below_m(airframe) if self._below_m is None else self._below_m
        true_m = below_m + self._rng.gauss(0.0, p.range_noise_m)
        if p.range_echo and self._rng.random() < p.range_echo:
            true_m *= self._rng.uniform(*_LONGER_WAY)
        distance = true_m * self.fault.range_share + self.fault.range_m
        if not p.range_min_m <= distance <= p.range_max_m:
            return 0.0
        return round(distance / p.range_step_m) * p.range_step_m

    def _to_below_m(self, airframe: Airframe) -> float:
        """Along the body's z axis to what is below: the floor, or the highest goods."""
        x_m, y_m = airframe.x_m, airframe.y_m
        stands_m = max((g.height_m for g in self.params.goods if _holds(g, x_m, y_m)), default=0.0)
        return (airframe.height_m - stands_m) / max(airframe.tilt_cos, _LEAST_COS)


def _holds(goods: Goods, x_m: float, y_m: float) -> bool:
    return goods.x0_m <= x_m <= goods.x1_m and goods.y0_m <= y_m <= goods.y1_m
