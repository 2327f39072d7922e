"""From navdata to what the daemon knows of the vehicle."""

from __future__ import annotations

import math
from collections import deque

from flightd.adapters.vehicle.ardrone.clock_counters import WrappingCounter
from flightd.adapters.vehicle.ardrone.navdata import Demo, DroneState, Major, Navdata
from flightd.adapters.vehicle.ardrone.refusal import Emergency
from flightd.core.types import Attitude
from flightd.tracking.device_clock import DeviceClock

CLOCK_WRAP_US = 2048 * 1_000_000
AIRBORNE = frozenset(
    {Major.FLYING, Major.HOVERING, Major.TAKE_OFF, Major.GO_TO_FIX, Major.LANDING, Major.LOOPING}
)

_MAX_ATTITUDES = 1000
_CLIMB_LAG_S = 0.2
_JUMP_M = 0.5
_CLIMB_STALE_NS = _VOLTS_STALE_NS = 1_000_000_000
_JUMP_PATIENCE_NS = 300_000_000


class NavdataTelemetry:
    """The newest of each quantity with its own time, and the attitude samples not yet drained.

    Heights that leap farther than a drone can climb are sonar echoes of something else: they are passed
    over until they have persisted for 0.3 s.  `state` is that of the newest packet, which came at
    `arrival_ns`; what the flight is doing (`major`) comes with the demo option alone, last at `flight_ns`.
    """

    def __init__(self, latency_ns: int) -> None:
        self._latency_ns = latency_ns
        self._counter = WrappingCounter(CLOCK_WRAP_US)
        self._clock = DeviceClock(latency_ns)
        self._attitudes: deque[Attitude] = deque(maxlen=_MAX_ATTITUDES)
        self.state = DroneState(0)
        self.demo: Demo | None = None
        self.attitude: Attitude | None = None
        self.arrival_ns = 0
        self.flight_ns = 0
        self.height_m = math.nan
        self.height_ns = 0
        self._climb_mps = 0.0
        self._battery_v, self._battery_ns = math.nan, 0

    @property
    def major(self) -> int:
        return self.demo.major if self.demo is not None else Major.DEFAULT

    @property
    def airborne(self) -> bool:
        return self.major in AIRBORNE

    @property
    def battery_percent(self) -> int:
        return self.demo.battery_percent if self.demo is not None else 0

    @property
    def emergency(self) -> Emergency | None:
        """The motors are cut: why; None where they are not."""
        return Emergency(self.state) if self.state & DroneState.EMERGENCY else None

    def observe(self, packet: Navdata, now_ns: int) -> None:
        """Take one packet that arrived now."""
        self.state = packet.state
        self.arrival_ns = now_ns
        if packet.battery_v is not None:
            self._battery_v, self._battery_ns = packet.battery_v, now_ns
        if packet.demo is None:
            return
        self.demo, self.flight_ns = packet.demo, now_ns
        demo = packet.demo
        stamp_ns = now_ns - self._latency_ns
        if packet.clock_us is not None:
            told_ns = self._clock.to_ours(self._counter.unwrap(packet.clock_us) * 1000, now_ns)
            stamp_ns = stamp_ns if told_ns is None else told_ns  # a clock that has just started anew
        if self.attitude is not None:
            stamp_ns = max(stamp_ns, self.attitude.stamp_ns + 1)
        self.attitude = Attitude(stamp_ns, demo.roll_rad, demo.pitch_rad, demo.yaw_rad)
        self._attitudes.append(self.attitude)
        self._observe_height(demo.height_m, packet.climb_mps, stamp_ns)

    def climb_mps(self, now_ns: int) -> float:
        """Climb rate, NaN once no height has told it for a second; 0 on the floor."""
        if not self.airborne:
            return 0.0
        return self._climb_mps if now_ns - self.height_ns <= _CLIMB_STALE_NS else math.nan

    def battery_v(self, now_ns: int) -> float:
        """Volts of the battery, NaN once no packet has told them for a second."""
        return self._battery_v if now_ns - self._battery_ns <= _VOLTS_STALE_NS else math.nan

    def drain(self) -> list[Attitude]:
        """The attitude samples since the last call, oldest first."""
        drained = list(self._attitudes)
        self._attitudes.clear()
        return drained

    def _observe_height(self, height_m: float, climb_mps: float | None, stamp_ns: int) -> None:
        if self.state & DroneState.ULTRASOUND:
            self.height_m = math.nan
            return
        past_s = (stamp_ns - self.height_ns) / 1e9
        known = not math.isnan(self.height_m)
        leap = known and abs(height_m - self.height_m) > _JUMP_M
        if leap and self.airborne and stamp_ns - self.height_ns < _JUMP_PATIENCE_NS:
            return
        if climb_mps is not None:
            self._climb_mps = climb_mps
        elif known and not leap and past_s > 0.0:
            measured = (height_m - self.height_m) / past_s
            self._climb_mps += (measured - self._climb_mps) * min(1.0, past_s / _CLIMB_LAG_S)
        self.height_m, self.height_ns = height_m, stamp_ns
