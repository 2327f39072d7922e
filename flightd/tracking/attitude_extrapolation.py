"""The attitude of a vehicle that has fallen silent: it flies on what is asked of it.

Pictures still come then.  Taken with this attitude they are good enough to brake by, so that the drone
stops where it is instead of gliding on, level, for metres.
"""

from __future__ import annotations

import math

from flightd.core.geometry import wrap_pi
from flightd.core.types import Attitude, AttitudeSetpoint

SILENT_NS = 150_000_000
"""Telemetry comes at 10 Hz or more: without any for so long, something is assumed until it goes on."""
_LAG_S = 0.15
"""An attitude loop's time constant, roughly."""


class AttitudeExtrapolation:
    """Call `step` at each tick."""

    def __init__(self) -> None:
        self._attitude: Attitude | None = None
        self._heard_ns = 0

    def step(self, now_ns: int, heard: Attitude | None, asked: AttitudeSetpoint | None) -> Attitude | None:
        """What is to be assumed at `now_ns`, given the newest attitude `heard` and the setpoint last sent;
        None while telemetry comes, and when nothing was asked."""
        last = self._attitude
        if heard is None or asked is None or now_ns - heard.stamp_ns <= SILENT_NS:
            self._attitude = None
            return None
        if last is None or self._heard_ns != heard.stamp_ns:  # late as it is, it is what was measured
            last, self._heard_ns = heard, heard.stamp_ns
        dt_s = (now_ns - last.stamp_ns) * 1e-9
        part = 1.0 - math.exp(-dt_s / _LAG_S)
        self._attitude = Attitude(
            now_ns,
            last.roll_rad + part * (asked.roll_rad - last.roll_rad),
            last.pitch_rad + part * (asked.pitch_rad - last.pitch_rad),
            wrap_pi(last.yaw_rad + asked.yaw_rate_radps * dt_s),
        )
        return self._attitude
