"""A small quadcopter with its attitude loop: how it moves under attitude and thrust commands.

The attitude loop belongs to the airframe because every autopilot closes it in the same way; its response
is that measured on ArduCopter 4.5 (of an 8 degree roll step 5.9 degrees after 0.25 s, 7.8 after 0.5 s,
2.5 m/s sideways after 3 s).  Height is the autopilot's: see `climb_loop`.  Plain floats, no clock: time is
an argument, and the same seed and commands give the same flight.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from dataclasses import dataclass

from flightd.core.geometry import GRAVITY_MPS2, wrap_pi
from flightd.sim.plant.kinematics import Kinematics
from flightd.sim.plant.wash import Wash
from flightd.sim.plant.wind import Wind, WindParams

_CHARGE = (0.0, 0.05, 0.1, 0.2, 0.5, 0.8, 1.0)
_CELL_V = (3.3, 3.5, 3.65, 3.73, 3.84, 4.02, 4.2)
"""A lithium polymer cell's voltage at rest by its charge."""
_FREE_LIFT, _LEAST_AUTHORITY = 0.3, 0.15
"""With this share of the greatest lift to spare all torque is there; with none the mixer keeps some of it."""


@dataclass(frozen=True, slots=True)
class AirframeParams:
    """A 450 mm quadcopter on 3S; the defaults reproduce the measured responses named above."""

    attitude_bandwidth_radps: float = 10.0
    attitude_damping: float = 0.94
    attitude_accel_max_radps2: float = math.radians(1100.0)
    yaw_gain_per_s: float = 4.5
    yaw_rate_max_radps: float = math.radians(90.0)
    yaw_rate_lag_s: float = 0.12
    drag_per_s: float = 0.335
    hover_collective: float = 0.34
    motor_lag_s: float = 0.05
    rest_height_m: float = 0.10
    rest_tilt_rad: tuple[float, float] = (0.0, 0.0)
    """Roll and pitch in which it stands: legs and floor are not quite level."""
    floor_friction: float = 0.6
    battery_capacity_ah: float = 5.0
    battery_cells: int = 3
    battery_resistance_ohm: float = 0.02
    hover_current_a: float = 14.0
    idle_current_a: float = 0.6
    sags: bool = False
    """Thrust goes with the square of the battery's voltage, hovering on a full one being as configured."""
    thrust_to_weight: float | None = None
    """The most that a full battery lifts; near it no motor has much left to turn the airframe by."""

    def __post_init__(self) -> None:
        if not 0.0 < self.hover_collective < 1.0:
            raise ValueError(f"hover collective {self.hover_collective} outside 0..1")


@dataclass(frozen=True, slots=True)
class AirframeCommand:
    """What the autopilot's outer loops ask for: attitude in the map frame (signs of `core.types.Attitude`),
    a yaw rate fed forward, and the collective, 0..1.  Motors off ignores the rest."""

    motors: bool = False
    roll_rad: float = 0.0
    pitch_rad: float = 0.0
    yaw_rad: float = 0.0
    yaw_rate_radps: float = 0.0
    collective: float = 0.0


class Airframe:
    """The moving body.  `step` advances it; the attributes are the truth at the end of the last step,
    in the map frame of `Kinematics`."""

    def __init__(
        self,
        params: AirframeParams | None = None,
        wind: WindParams | None = None,
        seed: int = 0,
        *,
        x_m: float = 0.0,
        y_m: float = 0.0,
        yaw_rad: float = 0.0,
        battery_frac: float = 1.0,
        wash: Wash | None = None,
    ) -> None:
        self.params = params or AirframeParams()
        self.wind, self.wash = Wind(wind or WindParams(), seed), wash
        self.x_m, self.y_m, self.height_m = x_m, y_m, self.params.rest_height_m
        self.vx_mps = self.vy_mps = self.climb_mps = 0.0
        self.roll_rad, self.pitch_rad = self.params.rest_tilt_rad
        self.yaw_rad = wrap_pi(yaw_rad)
        self.roll_speed_radps = self.pitch_speed_radps = self.yaw_speed_radps = 0.0
        self.collective = 0.0
        self.battery_frac = battery_frac
        self.current_a = 0.0
        self._full_v = self._open_v(1.0) - self.params.battery_resistance_ohm * self.params.hover_current_a
        self.on_floor = True
        self.touchdown_mps = 0.0
        """Sink rate at the last contact with the floor."""

    @property
    def battery_v(self) -> float:
        """Terminal voltage under the present load."""
        p = self.params
        return self._open_v(self.battery_frac) - p.battery_resistance_ohm * self.current_a

    def _open_v(self, charge: float) -> float:
        return self.params.battery_cells * _cell_v(charge)

    @property
    def air_mps(self) -> tuple[float, float, float]:
        """Velocity of the air round it, map frame and upwards."""
        wind, wash = self.wind, self.wash
        if wash is None:
            return wind.x_mps, wind.y_mps, wind.up_mps
        return wind.x_mps + wash.x_mps, wind.y_mps + wash.y_mps, wind.up_mps + wash.up_mps

    def lift(self, collective: float) -> float:
        """What a collective lifts on this battery, in weights."""
        p = self.params
        share = self._battery_share()
        lift = share * collective / p.hover_collective
        return lift if p.thrust_to_weight is None else min(lift, share * p.thrust_to_weight)

    def _battery_share(self) -> float:
        """Of a collective's thrust on a full battery."""
        return (self.battery_v / self._full_v) ** 2 if self.params.sags else 1.0

    @property
    def tilt_cos(self) -> float:
        return math.cos(self.roll_rad) * math.cos(self.pitch_rad)

    def step(self, dt_s: float, command: AirframeCommand) -> None:
        """Advance by `dt_s` (a few milliseconds) under `command`."""
        self._blow(dt_s)
        self._spin(dt_s, command)
        self._turn(dt_s, command)
        lift = self.lift(self.collective)
        self._move(dt_s, lift)
        self._drain(dt_s, lift, motors=command.motors)

    def _blow(self, dt_s: float) -> None:
        self.wind.step(dt_s)
        if self.wash is not None:
            self.wash.step(dt_s, self.x_m, self.y_m, self.height_m)

    def kinematics(self, stamp_ns: int) -> Kinematics:
        """The present truth, stamped; rates are those of the body axes."""
        sin_roll, cos_roll = math.sin(self.roll_rad), math.cos(self.roll_rad)
        sin_pitch, cos_pitch = math.sin(self.pitch_rad), math.cos(self.pitch_rad)
        turn = self.yaw_speed_radps
        return Kinematics(
            stamp_ns,
            self.x_m,
            self.y_m,
            self.height_m,
            self.vx_mps,
            self.vy_mps,
            self.climb_mps,
            self.roll_rad,
            self.pitch_rad,
            self.yaw_rad,
            self.roll_speed_radps - turn * sin_pitch,
            self.pitch_speed_radps * cos_roll + turn * sin_roll * cos_pitch,
            -self.pitch_speed_radps * sin_roll + turn * cos_roll * cos_pitch,
        )

    def _spin(self, dt_s: float, command: AirframeCommand) -> None:
        """Motors follow the collective with a lag; an empty battery stops them."""
        wanted = min(max(command.collective, 0.0), 1.0) if command.motors and self.battery_frac > 0 else 0.0
        self.collective += (wanted - self.collective) * min(1.0, dt_s / self.params.motor_lag_s)

    def _turn(self, dt_s: float, command: AirframeCommand) -> None:
        p = self.params
        standing = self.on_floor and self.collective < 0.8 * p.hover_collective
        roll_target, pitch_target = p.rest_tilt_rad if standing else (command.roll_rad, command.pitch_rad)
        omega, limit = p.attitude_bandwidth_radps, p.attitude_accel_max_radps2 * self._authority()
        stiffness, damping = omega * omega, 2.0 * p.attitude_damping * omega

        push = stiffness * (roll_target - self.roll_rad) - damping * self.roll_speed_radps
        self.roll_speed_radps += min(max(push, -limit), limit) * dt_s
        self.roll_rad += self.roll_speed_radps * dt_s
        push = stiffness * (pitch_target - self.pitch_rad) - damping * self.pitch_speed_radps
        self.pitch_speed_radps += min(max(push, -limit), limit) * dt_s
        self.pitch_rad += self.pitch_speed_radps * dt_s

        turn = 0.0
        if not standing:
            error = wrap_pi(command.yaw_rad - self.yaw_rad)
            turn = command.yaw_rate_radps + p.yaw_gain_per_s * error
            turn = min(max(turn, -p.yaw_rate_max_radps), p.yaw_rate_max_radps)
        self.yaw_speed_radps += (turn - self.yaw_speed_radps) * min(1.0, dt_s / p.yaw_rate_lag_s)
        self.yaw_rad = wrap_pi(self.yaw_rad + self.yaw_speed_radps * dt_s)

    def _authority(self) -> float:
        """The share of the usual torque that is left beside the lift: a motor that saturates has no more."""
        most = self.params.thrust_to_weight
        if most is None:
            return 1.0
        left = 1.0 - self.collective / (self.params.hover_collective * most)
        return min(max(_LEAST_AUTHORITY, left / _FREE_LIFT), 1.0)

    def _move(self, dt_s: float, load: float) -> None:
        """Under motors that lift a `load` in weights."""
        p, lift = self.params, GRAVITY_MPS2 * load
        sin_roll, cos_roll = math.sin(self.roll_rad), math.cos(self.roll_rad)
        sin_pitch, cos_pitch = math.sin(self.pitch_rad), math.cos(self.pitch_rad)
        sin_yaw, cos_yaw = math.sin(self.yaw_rad), math.cos(self.yaw_rad)
        forward, right = -lift * cos_roll * sin_pitch, lift * sin_roll
        up = lift * cos_roll * cos_pitch - GRAVITY_MPS2

        if self.on_floor and up <= 0.0:
            self._rub(dt_s, -up)
            return
        (air_x, air_y, air_up), drag = self.air_mps, p.drag_per_s
        self.vx_mps += (forward * cos_yaw - right * sin_yaw - drag * (self.vx_mps - air_x)) * dt_s
        self.vy_mps += (forward * sin_yaw + right * cos_yaw - drag * (self.vy_mps - air_y)) * dt_s
        self.climb_mps += (up - drag * (self.climb_mps - air_up)) * dt_s
        self.x_m += self.vx_mps * dt_s
        self.y_m += self.vy_mps * dt_s
        self.height_m += self.climb_mps * dt_s
        if self.height_m <= p.rest_height_m:
            if not self.on_floor:
                self.touchdown_mps = -self.climb_mps
            self.height_m, self.on_floor = p.rest_height_m, True
            self.climb_mps = max(self.climb_mps, 0.0)
        else:
            self.on_floor = False

    def _rub(self, dt_s: float, load_mps2: float) -> None:
        """Skids stand on the floor under `load_mps2` of weight not carried by the rotors."""
        self.climb_mps = 0.0
        speed = math.hypot(self.vx_mps, self.vy_mps)
        if speed == 0.0:
            return
        keep = max(0.0, 1.0 - self.params.floor_friction * load_mps2 * dt_s / speed)
        self.vx_mps *= keep
        self.vy_mps *= keep
        self.x_m += self.vx_mps * dt_s
        self.y_m += self.vy_mps * dt_s

    def _drain(self, dt_s: float, load: float, *, motors: bool) -> None:
        """Take the current of motors that lift a `load` in weights."""
        p = self.params
        self.current_a = p.idle_current_a + (p.hover_current_a * load**1.5 if motors and load > 0 else 0.0)
        used_frac = self.current_a * dt_s / (p.battery_capacity_ah * 3600.0)
        self.battery_frac = max(0.0, self.battery_frac - used_frac)


def _cell_v(charge: float) -> float:
    """A cell's voltage at rest; read several times in each step, for which numpy's own way is too long."""
    after = bisect_right(_CHARGE, charge)
    if after in {0, len(_CHARGE)}:
        return _CELL_V[max(after - 1, 0)]
    (charge_0, charge_1), (v_0, v_1) = _CHARGE[after - 1 : after + 1], _CELL_V[after - 1 : after + 1]
    return (v_1 - v_0) / (charge_1 - charge_0) * (charge - charge_0) + v_0
