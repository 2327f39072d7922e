"""ArduCopter's guided angle control: what it makes of SET_ATTITUDE_TARGET."""

from __future__ import annotations

import math
from dataclasses import dataclass

from flightd.core.geometry import wrap_pi
from flightd.sim.autopilot.link import Message

_IGNORE_RATES = 7
_IGNORE_THRUST = 64
_IGNORE_ATTITUDE = 128
_NORM_TOLERANCE = 5e-4


@dataclass(slots=True)
class AngleTarget:
    """The attitude asked for, in the autopilot's own heading, and how fast it turns by itself.

    `holding`: no setpoint is in force."""

    roll_rad: float = 0.0
    pitch_rad: float = 0.0
    yaw_rad: float = 0.0
    roll_rate_radps: float = 0.0
    pitch_rate_radps: float = 0.0
    yaw_rate_radps: float = 0.0
    thrust: float = 0.5
    age_s: float = 0.0
    holding: bool = True

    def stop(self) -> None:
        """Level, no rates, hold height, keep the heading."""
        self.roll_rad = self.pitch_rad = 0.0
        self.roll_rate_radps = self.pitch_rate_radps = self.yaw_rate_radps = 0.0
        self.thrust = 0.5
        self.holding = True

    def take(self, message: Message) -> bool:
        """Accept a setpoint, or leave everything as it is: ArduCopter answers neither way.

        Dropped are a missing thrust and a quaternion whose norm is off by more than 5e-4; with only
        some of the rates ignored (mask 3) the message does not refresh the target either, which so
        runs into its time-out.
        """
        mask = message.type_mask
        rates_ignored = mask & _IGNORE_RATES
        values = (*message.q, message.body_roll_rate, message.body_pitch_rate, message.body_yaw_rate)
        if (
            mask & _IGNORE_THRUST
            or rates_ignored not in {0, _IGNORE_RATES}
            or not math.isfinite(message.thrust)
        ):
            return False
        if not all(map(math.isfinite, values)):
            return False
        if not mask & _IGNORE_ATTITUDE:
            if abs(math.hypot(*message.q) - 1.0) > _NORM_TOLERANCE:
                return False
            self.roll_rad, self.pitch_rad, self.yaw_rad = euler(*message.q)
        elif rates_ignored:
            return False
        rates = (0.0, 0.0, 0.0) if rates_ignored else values[4:]
        self.roll_rate_radps, self.pitch_rate_radps, self.yaw_rate_radps = rates
        self.thrust = min(max(message.thrust, -1.0), 1.0)
        self.age_s = 0.0
        self.holding = False
        return True

    def step(self, dt_s: float, timeout_s: float) -> None:
        """Turn the target by its rates; after `timeout_s` without a setpoint stop."""
        self.age_s += dt_s
        if self.age_s > timeout_s:
            self.stop()
        if self.holding:
            return
        self.roll_rad += self.roll_rate_radps * dt_s
        self.pitch_rad += self.pitch_rate_radps * dt_s
        self.yaw_rad = wrap_pi(self.yaw_rad + self.yaw_rate_radps * dt_s)

    def climb_mps(self, up_mps: float, down_mps: float) -> float:
        """Thrust read as climb rate: 0.5 holds, 1 is full `up_mps`, 0 full `down_mps`."""
        part = (min(max(self.thrust, 0.0), 1.0) - 0.5) * 2.0
        return part * (up_mps if part > 0 else down_mps)


def euler(w: float, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Roll, pitch and yaw of a unit quaternion."""
    roll = math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    pitch = math.asin(min(max(2.0 * (w * y - z * x), -1.0), 1.0))
    yaw = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return roll, pitch, yaw
