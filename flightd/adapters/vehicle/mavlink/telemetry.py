"""MAVLink telemetry to `VehicleState`: units, signs and times put right in one place."""

from __future__ import annotations

import enum
import math
from collections import deque
from collections.abc import Sequence

from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.adapters.vehicle.mavlink.link.codec import Message
from flightd.adapters.vehicle.mavlink.services.clock_offset import ClockSync
from flightd.adapters.vehicle.newest_readings import REBOOT_MS, NewestReadings, has_rebooted
from flightd.adapters.vehicle.range_finders import RangeSample
from flightd.core.refusal import Refusal
from flightd.core.types import LandedState, VehicleState

_HEIGHTS_MAX = 64
_NS_PER_MS = 1_000_000
_CLIMB_STALE_NS = 1_000_000_000
_SLOPE_MS, _SLOPE_GAP_MS = 250, 500
_SLOPE_LEAST_MS = 100
"""A slope over less than this, or of fewer than `_SLOPE_SAMPLES`, tells nothing."""
_SLOPE_SAMPLES = 4
_LEAP_MPS = 6.0
"""No vehicle of ours climbs or sinks so fast: the height's origin was moved (at arming, say)."""
_NO_CELL_MV = 65535
_STATUS_STALE_NS = 5_000_000_000
_FAILSAFE = frozenset({dialect.MAV_STATE_CRITICAL, dialect.MAV_STATE_EMERGENCY})
"""HEARTBEAT.system_status of a vehicle that a failsafe of its own flies: ArduPilot and PX4 say CRITICAL."""
_UNKNOWN_U16 = 65535
_UNKNOWN_QUALITY, _NO_SIGNAL = 0, 1

_LANDED = {
    dialect.MAV_LANDED_STATE_ON_GROUND: LandedState.ON_GROUND,
    dialect.MAV_LANDED_STATE_IN_AIR: LandedState.IN_AIR,
    dialect.MAV_LANDED_STATE_TAKEOFF: LandedState.IN_AIR,
    dialect.MAV_LANDED_STATE_LANDING: LandedState.IN_AIR,
}


def range_sample(message: Message) -> RangeSample | None:
    """A DISTANCE_SENSOR, distances in cm, of a sensor that looks down; None of another, and where its quality
    (0: unknown) is 1: no signal."""
    quality_pc = message.signal_quality
    if message.orientation != dialect.MAV_SENSOR_ROTATION_PITCH_270 or quality_pc == _NO_SIGNAL:
        return None
    return RangeSample(
        message.id,
        message.current_distance / 100.0,
        max(message.min_distance, 1) / 100.0,
        message.max_distance / 100.0,
        None if quality_pc == _UNKNOWN_QUALITY else quality_pc,
    )


def cells_told(message: Message) -> int:
    """The cells of a BATTERY_STATUS, which has their voltages; 0 where it has only that of them all."""
    return cells_of(message.voltages)


def cells_of(volts_mv: Sequence[int]) -> int:
    """The cells whose voltages these are, mV; 0 where one of them is that of the whole battery."""
    cells = sum(mv != _NO_CELL_MV for mv in volts_mv)
    return cells if cells > 1 else 0


class ClimbSource(enum.Enum):
    """The one message by which an autopilot's climb rate is known."""

    GLOBAL_POSITION = "GLOBAL_POSITION_INT"
    """ArduPilot sends LOCAL_POSITION_NED only with a position."""
    LOCAL_POSITION = "LOCAL_POSITION_NED"
    """PX4 moves the origin of GLOBAL_POSITION_INT's height when it is armed."""


class MavlinkTelemetry(NewestReadings):
    """The newest readings of one autopilot.  Values that are not finite or make no sense are not taken."""

    climb_stale_ns = _CLIMB_STALE_NS

    def __init__(
        self,
        sync: ClockSync,
        climb_from: ClimbSource = ClimbSource.GLOBAL_POSITION,
        range_finder: int | None = None,
    ) -> None:
        super().__init__(sync, range_finder)
        self._climb_from = climb_from.value
        self._boot_ms = 0
        self._heights: deque[tuple[int, int]] = deque(maxlen=_HEIGHTS_MAX)
        self._status_ns = -2 * _STATUS_STALE_NS
        self.custom_mode: int | None = None

    def take(self, message: Message, now_ns: int) -> bool:
        """Fold one message in; True when it shows that the autopilot has rebooted."""
        match message.get_type():
            case "HEARTBEAT":
                self.heartbeat_ns = now_ns
                self.custom_mode = int(message.custom_mode)
                self.armed = bool(message.base_mode & dialect.MAV_MODE_FLAG_SAFETY_ARMED)
                self.in_failsafe = message.system_status in _FAILSAFE
            case "ATTITUDE":
                return self._take_attitude(message, now_ns)
            case "DISTANCE_SENSOR":
                sample = range_sample(message)
                if sample is not None:
                    stamp_ns = self._stamp(self._boot_ns(message.time_boot_ms, now_ns), now_ns)
                    self._take_sample(sample, stamp_ns, now_ns)
            case "GLOBAL_POSITION_INT" as name if name == self._climb_from:
                self._take_global_position(message, now_ns)
            case "LOCAL_POSITION_NED" as name if name == self._climb_from and math.isfinite(message.vz):
                self._climb_mps = -message.vz
                self._climb_ns = now_ns
            case "EXTENDED_SYS_STATE":
                self._landed = _LANDED.get(message.landed_state, LandedState.UNKNOWN)
                self._landed_ns = now_ns
            case "BATTERY_STATUS" if message.id == 0:
                self._take_battery(message, now_ns)
            case "SYS_STATUS" if now_ns - self._status_ns > _STATUS_STALE_NS:
                self._take_system_status(message, now_ns)
            case _:
                pass
        return False

    def state(
        self, now_ns: int, mode: str, *, in_control: bool, refusal: Refusal | None
    ) -> VehicleState | None:
        """Everything at one glance; None until heartbeat and attitude were heard."""
        return self._state(now_ns, mode, in_control=in_control, refusal=refusal)

    def _take_attitude(self, message: Message, now_ns: int) -> bool:
        angles = (message.roll, message.pitch, message.yaw)
        if not all(abs(angle) <= math.tau for angle in angles):  # NaN fails too
            return False
        boot_ms = int(message.time_boot_ms)
        rebooted = has_rebooted(boot_ms, self._boot_ms)
        if rebooted:
            self._sync.reset()
        boot_ns = self._boot_ns(boot_ms, now_ns)
        senseless, in_order = self._is_senseless(boot_ns, now_ns), boot_ms > self._boot_ms
        if not senseless:  # one that strayed ahead would make the next good one look like a reboot
            self._boot_ms = boot_ms
            if boot_ms:
                self._sync.heard(boot_ns, now_ns)
        stamp_ns = self._stamp(boot_ns, now_ns)
        self._stamps_refused += rebooted or senseless
        last_ns = stamp_ns - 1 if self._attitude is None or rebooted else self._attitude.stamp_ns
        if rebooted or senseless or (in_order and stamp_ns <= last_ns):
            self._time_broke = True
        if stamp_ns >= last_ns:
            body_radps = message.rollspeed, message.pitchspeed, message.yawspeed
            self._attitude = sample = self._sample(stamp_ns, angles, body_radps)
            if stamp_ns > last_ns:
                self._attitudes.append(sample)
                self._time_broke = False
        return rebooted

    def _take_global_position(self, message: Message, now_ns: int) -> None:
        """Climb from the velocity; ArduPilot sends all zeros when it estimates none, and then the
        height's own slope tells, over several samples without a gap or leap between them."""
        boot_ms, height_mm = message.time_boot_ms, message.relative_alt
        if self._heights and 0 < self._heights[-1][0] - boot_ms < REBOOT_MS:
            return  # it was overtaken on its way
        if self._heights and not self._follows(boot_ms, height_mm):
            self._heights.clear()
        self._heights.append((boot_ms, height_mm))
        while boot_ms - self._heights[0][0] > _SLOPE_MS:
            self._heights.popleft()
        if message.vx or message.vy or message.vz:
            self._climb_mps = -message.vz / 100.0
        else:
            first_ms, first_mm = self._heights[0]
            span_ms = boot_ms - first_ms
            enough = span_ms >= _SLOPE_LEAST_MS and len(self._heights) >= _SLOPE_SAMPLES
            self._climb_mps = (height_mm - first_mm) / span_ms if enough else math.nan
        self._climb_ns = now_ns

    def _follows(self, boot_ms: int, height_mm: int) -> bool:
        """Whether a height can be the next after the newest one."""
        since_ms = boot_ms - self._heights[-1][0]
        moved_mm = abs(height_mm - self._heights[-1][1])
        return 0 <= since_ms <= _SLOPE_GAP_MS and moved_mm <= _LEAP_MPS * max(since_ms, 20)

    def _take_battery(self, message: Message, now_ns: int) -> None:
        """BATTERY_STATUS: one voltage for each cell, or that of them all in the first place."""
        self._status_ns = now_ns
        self._set_battery(
            now_ns,
            frac=message.battery_remaining / 100.0,
            volts=sum(mv for mv in message.voltages if mv != _NO_CELL_MV) / 1000.0,
            amperes=math.nan if message.current_battery < 0 else message.current_battery / 100.0,
            cells=cells_told(message),
        )

    def _take_system_status(self, message: Message, now_ns: int) -> None:
        """SYS_STATUS, from an autopilot that sends no BATTERY_STATUS."""
        millivolt = message.voltage_battery
        self._set_battery(
            now_ns,
            frac=message.battery_remaining / 100.0,
            volts=0.0 if millivolt == _UNKNOWN_U16 else millivolt / 1000.0,
            amperes=math.nan if message.current_battery < 0 else message.current_battery / 100.0,
        )


def version_words(number: int) -> str:
    """A firmware's version, as AUTOPILOT_VERSION packs it."""
    return f"{number >> 24 & 0xFF}.{number >> 16 & 0xFF}.{number >> 8 & 0xFF}"
