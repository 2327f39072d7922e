"""The newest readings of one autopilot, whoever carries its telemetry."""

from __future__ import annotations

import math
from collections import deque
from typing import Protocol

from flightd.adapters.vehicle.height_leap_gate import HeightLeapGate
from flightd.adapters.vehicle.range_finders import RangeFinders, RangeSample
from flightd.core.geometry import angle_rates
from flightd.core.refusal import Refusal
from flightd.core.types import Attitude, LandedState, VehicleState

REBOOT_MS = 1_000
"""Boot times that go back by less were overtaken on their way."""
_NS_PER_MS = 1_000_000
_WRAP_MS, _WRAP_NEAR_MS = 2**32, 60_000
"""Boot times count so far and begin anew; one that does so later or earlier than this was a reboot."""
_ATTITUDES_MAX = 512
_STAMP_AGE_MAX_NS = 500_000_000
_AHEAD_NS = 50_000_000
_RANGE_STALE_NS = 500_000_000
_CLIMB_FRESH_NS = 250_000_000
_LANDED_STALE_NS = 1_000_000_000
_NEAR_LEAST_M = 0.15
"""Seen so little above its range finder's minimum, a vehicle may be below it at the next sample."""
_CLIMBS_MPS = 0.2
"""But not one that climbs so fast: what it reads then is no measurement."""


class VehicleClock(Protocol):
    """The vehicle's clock beside ours."""

    def to_ours(self, theirs_ns: int) -> int | None: ...

    def to_theirs(self, ours_ns: int) -> int | None: ...

    def error_s(self, now_ns: int) -> float: ...

    def heard(self, theirs_ns: int, now_ns: int) -> None: ...

    def reset(self) -> None: ...


def has_rebooted(boot_ms: int, before_ms: int) -> bool:
    """Whether a boot time is that of an autopilot that began anew after the other."""
    wrapped = before_ms > _WRAP_MS - _WRAP_NEAR_MS and boot_ms < _WRAP_NEAR_MS
    return boot_ms + REBOOT_MS < before_ms and not wrapped


class NewestReadings:
    """What was told last, with its time, and when it is too old to be used.  What is not finite or makes no
    sense is not taken; a subclass takes what its own carrier tells.  `range_finder` is the one to fly by,
    None: the best."""

    climb_stale_ns: int

    def __init__(self, sync: VehicleClock, range_finder: int | None = None) -> None:
        self._sync = sync
        self._attitude: Attitude | None = None
        self._attitudes: deque[Attitude] = deque(maxlen=_ATTITUDES_MAX)
        self._range_m, self._range_ns = math.nan, 0
        self._finders = RangeFinders(range_finder)
        self._leap_gate = HeightLeapGate()
        self._climb_mps, self._climb_ns = math.nan, 0
        self._landed, self._landed_ns = LandedState.UNKNOWN, 0
        self._battery_frac = math.nan
        self._battery_v = math.nan
        self._battery_a = math.nan
        self._battery_cells = 0
        self._battery_ns = 0
        self._stamps_refused = 0
        self._time_broke = False
        """The time between the newest attitude and the one to come is not known."""
        self.heartbeat_ns = 0
        self.armed = False
        self.in_failsafe = False

    @property
    def attitude(self) -> Attitude | None:
        """The newest attitude."""
        return self._attitude

    @property
    def yaw_rad(self) -> float | None:
        """The newest measured heading."""
        return None if self._attitude is None else self._attitude.yaw_rad

    def _sample(
        self, stamp_ns: int, angles: tuple[float, float, float], body_radps: tuple[float, float, float]
    ) -> Attitude:
        """One attitude; by its rates nobody is to reckon over a time that is not known."""
        yaw_rate, *leaning = angle_rates(angles[0], angles[1], body_radps)
        roll_rate, pitch_rate = (math.nan, math.nan) if self._time_broke else leaning
        return Attitude(stamp_ns, *angles, yaw_rate, roll_rate, pitch_rate)

    def attitudes(self) -> list[Attitude]:
        """The attitude samples since the last call, oldest first."""
        samples = list(self._attitudes)
        self._attitudes.clear()
        return samples

    def height_m(self, now_ns: int) -> float:
        """Height above the floor below, NaN when the range finder has fallen silent."""
        return self._range_m if now_ns - self._range_ns <= _RANGE_STALE_NS else math.nan

    @property
    def height_stamp_ns(self) -> int:
        """The time of the newest height."""
        return self._range_ns

    def climb_mps(self, now_ns: int) -> float:
        """Climb rate, NaN when it is not told."""
        return self._climb_mps if now_ns - self._climb_ns <= self.climb_stale_ns else math.nan

    def fresh_climb_mps(self, now_ns: int) -> float:
        """Climb rate to close a loop by, NaN when it was not told just now."""
        return self._climb_mps if now_ns - self._climb_ns <= _CLIMB_FRESH_NS else math.nan

    def landed(self, now_ns: int) -> LandedState:
        """Whether it stands or flies; unknown when the autopilot has not said so for a second."""
        return self._landed if now_ns - self._landed_ns <= _LANDED_STALE_NS else LandedState.UNKNOWN

    def _state(
        self, now_ns: int, mode: str, *, in_control: bool, refusal: Refusal | None
    ) -> VehicleState | None:
        """Everything at one glance; None until heartbeat and attitude were heard."""
        if self._attitude is None or not self.heartbeat_ns:
            return None
        return VehicleState(
            attitude=self._attitude,
            height_m=self.height_m(now_ns),
            height_stamp_ns=self._range_ns,
            climb_mps=self.climb_mps(now_ns),
            mode=mode,
            in_control=in_control,
            armed=self.armed,
            landed=self.landed(now_ns),
            battery_frac=self._battery_frac,
            battery_v=self._battery_v,
            heartbeat_ns=self.heartbeat_ns,
            refusal=refusal,
            stamps_refused=self._stamps_refused,
            battery_stamp_ns=self._battery_ns,
            battery_a=self._battery_a,
            battery_cells=self._battery_cells,
            clock_error_s=self._sync.error_s(now_ns),
            in_failsafe=self.in_failsafe,
        )

    def _set_battery(
        self, now_ns: int, *, frac: float, volts: float, amperes: float = math.nan, cells: int = 0
    ) -> None:
        """All that one message tells: what it does not know is not known any more."""
        self._battery_frac = frac if 0.0 <= frac <= 1.0 else math.nan
        self._battery_v = volts if volts > 0.0 else math.nan
        self._battery_a, self._battery_cells, self._battery_ns = amperes, cells, now_ns

    def _take_sample(self, sample: RangeSample, stamp_ns: int, now_ns: int) -> None:
        """Take a distance along the body's z axis: the height is what the tilt leaves of it.

        Below the sensor's minimum it is taken for that minimum where the vehicle is near the floor anyway."""
        if not self._finders.take(sample, now_ns, armed=self.armed):
            return
        if sample.measures:
            tilt_cos = 1.0
            if self._attitude is not None:
                tilt_cos = math.cos(self._attitude.roll_rad) * math.cos(self._attitude.pitch_rad)
            height_m = sample.distance_m * max(tilt_cos, 0.0)
            climb_mps = self.fresh_climb_mps(now_ns)
            if self._leap_gate.accepts(height_m, sample.distance_m, stamp_ns, climb_mps) or not self.armed:
                self._range_m, self._range_ns = height_m, stamp_ns
        elif sample.is_below and self._is_low(sample.least_m, now_ns):
            self._range_m, self._range_ns = sample.least_m, stamp_ns

    def _is_low(self, least_m: float, now_ns: int) -> bool:
        """Whether the vehicle stands, or was last seen hardly higher than the sensor's minimum, and did not
        climb away from there."""
        climbs = self._range_m > least_m and self.fresh_climb_mps(now_ns) > _CLIMBS_MPS
        if not self.armed or (self._range_m <= least_m + _NEAR_LEAST_M and not climbs):
            return True
        return math.isnan(self._range_m) and self.landed(now_ns) is LandedState.ON_GROUND

    def _boot_ns(self, boot_ms: int, now_ns: int) -> int:
        """The autopilot's time of a stamp, whose 32 bits begin anew every 49.7 days: TIMESYNC's do not."""
        theirs_ns = self._sync.to_theirs(now_ns)
        wraps = 0 if theirs_ns is None else max(round((theirs_ns / _NS_PER_MS - boot_ms) / _WRAP_MS), 0)
        return (boot_ms + wraps * _WRAP_MS) * _NS_PER_MS

    def _is_senseless(self, boot_ns: int, now_ns: int) -> bool:
        """By the clocks as they were compared, a stamp long past or yet to come."""
        ours_ns = self._sync.to_ours(boot_ns)
        return ours_ns is not None and not -_STAMP_AGE_MAX_NS <= ours_ns - now_ns <= _AHEAD_NS

    def _stamp(self, boot_ns: int, now_ns: int) -> int:
        """Our time of an autopilot's stamp; the arrival while the clocks are not yet compared or when the
        stamp makes no sense (some messages carry 0)."""
        ours_ns = self._sync.to_ours(boot_ns)
        if ours_ns is None or not now_ns - _STAMP_AGE_MAX_NS <= ours_ns <= now_ns:
            return now_ns
        return ours_ns
