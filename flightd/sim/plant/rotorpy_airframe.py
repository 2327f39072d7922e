"""RotorPy's quadcopter as airframe: rigid body, four motors with a lag, rotor and parasitic drag.

The vehicle is the AscTec Hummingbird as RotorPy ships it (S. Folk, J. Paulos, V. Kumar, RotorPy, 2023; MIT
licence), which nobody of this project has fitted.  What an autopilot does is as for our own airframe: its
attitude loop has the bandwidth and damping of `AirframeParams`, its collective hovers at the same share, and
its drag is off by as much.
Air, battery and floor are ours, so that the same seed blows the same wind.

RotorPy's axes are forward, left, up; ours are forward, right, with pitch and yaw of the other sign.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from flightd.core.errors import UnavailableError
from flightd.core.extras import missing_extra
from flightd.core.geometry import GRAVITY_MPS2, heading_rotation, level_from_body, wrap_pi
from flightd.sim.plant.airframe import Airframe, AirframeCommand, AirframeParams
from flightd.sim.plant.wash import Wash
from flightd.sim.plant.wind import WindParams

_YAW_AHEAD_RAD = 0.3
"""The wanted heading is asked for in steps: a quadcopter's yaw is weak, and its motors saturate."""
_OWN_DRAG_PER_S = AirframeParams().drag_per_s
_DRAGS = "c_Dx", "c_Dy", "c_Dz", "k_d", "k_z"
"""Of body and rotors: by so much more or less than the Hummingbird's as `drag_per_s` is than our own."""
_FLIP = np.diag([1.0, -1.0, -1.0])
"""Forward, right, down to forward, left, up; and back."""


class RotorpyAirframe(Airframe):
    """As `Airframe`, moved by RotorPy.  UnavailableError where that is not installed."""

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
        configured = params or AirframeParams()
        multirotor, quad = _rotorpy()
        drag_share = configured.drag_per_s / _OWN_DRAG_PER_S
        quad |= {name: drag_share * quad[name] for name in _DRAGS}
        loop = {
            "kp_att": configured.attitude_bandwidth_radps**2,
            "kd_att": 2.0 * configured.attitude_damping * configured.attitude_bandwidth_radps,
        }
        self._mass_kg = float(quad["mass"])
        self._idle_radps = math.sqrt(self._mass_kg * GRAVITY_MPS2 / (4.0 * quad["k_eta"]))
        drag = 4.0 * quad["k_d"] * self._idle_radps / self._mass_kg  # what is felt in a steady flight
        super().__init__(
            replace(configured, drag_per_s=drag),
            wind,
            seed,
            x_m=x_m,
            y_m=y_m,
            yaw_rad=yaw_rad,
            battery_frac=battery_frac,
            wash=wash,
        )
        self._rotors_radps = np.zeros(4)
        self._body_radps = np.zeros(3)
        # one step of second order each time: a step is half of the motors' lag, and errors do not grow
        self._vehicle: Any = multirotor(
            {**quad, **loop, "motor_noise_std": 0.0},
            control_abstraction="cmd_ctatt",
            integrator_kwargs={"method": "RK23", "rtol": 1e-3, "atol": 1e-5},
        )

    def step(self, dt_s: float, command: AirframeCommand) -> None:
        """Advance by `dt_s` (a few milliseconds) under `command`."""
        self._blow(dt_s)
        on = command.motors and self.battery_frac > 0
        wanted = min(max(command.collective, 0.0), 1.0) if on else 0.0
        weight_n = self._mass_kg * GRAVITY_MPS2
        thrust_n = weight_n * self.lift(wanted)
        if self.on_floor and thrust_n <= weight_n:
            self._stand(dt_s, thrust_n)
        else:
            self._fly(dt_s, command, thrust_n)
        lift_n = float((self._rotors_radps**2).sum()) * weight_n / (4.0 * self._idle_radps**2)
        self.collective = self.params.hover_collective * lift_n / weight_n
        self._drain(dt_s, lift_n / weight_n, motors=command.motors)

    def _stand(self, dt_s: float, thrust_n: float) -> None:
        """On its skids, the motors at what is asked of them."""
        self.roll_rad, self.pitch_rad = self.params.rest_tilt_rad
        self.roll_speed_radps = self.pitch_speed_radps = self.yaw_speed_radps = 0.0
        self._body_radps = np.zeros(3)
        weight_n = self._mass_kg * GRAVITY_MPS2
        self._rotors_radps = np.full(4, self._idle_radps * math.sqrt(thrust_n / weight_n))
        self._rub(dt_s, (weight_n - thrust_n) / self._mass_kg)

    def _fly(self, dt_s: float, command: AirframeCommand, thrust_n: float) -> None:
        turn = min(max(wrap_pi(command.yaw_rad - self.yaw_rad), -_YAW_AHEAD_RAD), _YAW_AHEAD_RAD)
        air_x, air_y, air_up = self.air_mps
        state = {
            "x": np.array([self.x_m, -self.y_m, self.height_m]),
            "v": np.array([self.vx_mps, -self.vy_mps, self.climb_mps]),
            "q": _quaternion(_attitude(self.roll_rad, self.pitch_rad, self.yaw_rad)),
            "w": self._body_radps,
            "wind": np.array([air_x, -air_y, air_up]),
            "rotor_speeds": self._rotors_radps,
        }
        wanted = _attitude(command.roll_rad, command.pitch_rad, self.yaw_rad + turn)
        told = {"cmd_thrust": thrust_n, "cmd_q": _quaternion(wanted)}
        self._take(self._vehicle.step(state, told, dt_s), dt_s)

    def _take(self, after: dict[str, Any], dt_s: float) -> None:
        x_m, left_m, height_m = (float(one) for one in after["x"])
        self.x_m, self.y_m, self.height_m = x_m, -left_m, height_m
        self.vx_mps, self.vy_mps = float(after["v"][0]), -float(after["v"][1])
        self.climb_mps = float(after["v"][2])
        self._body_radps, self._rotors_radps = after["w"], after["rotor_speeds"]
        before = self.roll_rad, self.pitch_rad, self.yaw_rad
        turned = _FLIP @ _matrix(after["q"]) @ _FLIP
        self.roll_rad = math.atan2(turned[2, 1], turned[2, 2])
        self.pitch_rad = -math.asin(min(max(float(turned[2, 0]), -1.0), 1.0))
        self.yaw_rad = math.atan2(turned[1, 0], turned[0, 0])
        self.roll_speed_radps = wrap_pi(self.roll_rad - before[0]) / dt_s
        self.pitch_speed_radps = wrap_pi(self.pitch_rad - before[1]) / dt_s
        self.yaw_speed_radps = wrap_pi(self.yaw_rad - before[2]) / dt_s
        if self.height_m <= self.params.rest_height_m:
            if not self.on_floor:
                self.touchdown_mps = -self.climb_mps
            self.height_m, self.on_floor = self.params.rest_height_m, True
            self.climb_mps = max(self.climb_mps, 0.0)
        else:
            self.on_floor = False


def _rotorpy() -> tuple[Any, dict[str, Any]]:
    try:
        from rotorpy.vehicles.hummingbird_params import quad_params  # noqa: PLC0415 - of an extra
        from rotorpy.vehicles.multirotor import Multirotor  # noqa: PLC0415
    except ModuleNotFoundError as err:
        raise missing_extra("rotorpy", "--plant rotorpy") from err
    except ImportError as err:
        raise UnavailableError(f"RotorPy cannot be loaded: {err}") from err
    return Multirotor, dict(quad_params)


def _attitude(roll_rad: float, pitch_rad: float, yaw_rad: float) -> Any:
    """(3, 3) body to world, in RotorPy's axes."""
    return _FLIP @ heading_rotation(yaw_rad) @ level_from_body(roll_rad, pitch_rad) @ _FLIP


def _quaternion(rotation: Any) -> Any:
    """(x, y, z, w)."""
    from scipy.spatial.transform import Rotation  # noqa: PLC0415 - comes with RotorPy

    return Rotation.from_matrix(rotation).as_quat()


def _matrix(quaternion: Any) -> Any:
    from scipy.spatial.transform import Rotation  # noqa: PLC0415 - comes with RotorPy

    return Rotation.from_quat(quaternion).as_matrix()
