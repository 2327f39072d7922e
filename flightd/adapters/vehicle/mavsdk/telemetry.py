"""MAVSDK's telemetry to `VehicleState`: units, signs and times put right in one place."""

from __future__ import annotations

import math
from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

from mavsdk.plugins.telemetry import FlightMode
from mavsdk.plugins.telemetry import LandedState as SdkLanded

from flightd.adapters.vehicle.mavlink.services.clock_offset import ClockSync
from flightd.adapters.vehicle.mavlink.telemetry import cells_of, range_sample
from flightd.adapters.vehicle.mavsdk.library import real_fields, whole_fields
from flightd.adapters.vehicle.newest_readings import REBOOT_MS, NewestReadings, has_rebooted
from flightd.core.refusal import Refusal
from flightd.core.types import LandedState, VehicleState

_CLIMB_STALE_NS = 500_000_000
_ATTITUDE_FIELDS = ("time_boot_ms", "roll", "pitch", "yaw", "rollspeed", "pitchspeed", "yawspeed")
_RANGE_FIELDS = ("id", "orientation", "current_distance", "min_distance", "max_distance")

_MODES = {int(mode): mode for mode in FlightMode}
_LANDED = {
    int(SdkLanded.ON_GROUND): LandedState.ON_GROUND,
    int(SdkLanded.IN_AIR): LandedState.IN_AIR,
    int(SdkLanded.TAKING_OFF): LandedState.IN_AIR,
    int(SdkLanded.LANDING): LandedState.IN_AIR,
}


class MavsdkTelemetry(NewestReadings):
    """The newest that the library told of one autopilot.  What is not finite is not taken.

    The library stamps attitudes alone, in the autopilot's boot time; everything else is as old as its
    arrival.
    """

    climb_stale_ns = _CLIMB_STALE_NS

    def __init__(self, sync: ClockSync) -> None:
        super().__init__(sync)
        self._boot_ms = 0
        self._cells = 0
        self.mode: FlightMode | None = None

    @property
    def custom_mode(self) -> int | None:
        """The flight mode as a number; the library does not pass PX4's own on."""
        return None if self.mode is None else int(self.mode)

    def take_mode(self, mode: int, now_ns: int) -> None:
        """The library passes the flight mode on with every HEARTBEAT; one it has no name for is unknown."""
        self.mode, self.heartbeat_ns = _MODES.get(mode, FlightMode.UNKNOWN), now_ns

    def take_attitude(self, document: str, now_ns: int) -> None:
        """The fields of an ATTITUDE as they came: the library parts the rates from the angles."""
        told = real_fields(document, *_ATTITUDE_FIELDS)
        if (
            told is None
            or not math.isfinite(told[0])
            or not all(abs(angle) <= math.tau for angle in told[1:4])
        ):
            return  # NaN too
        boot_ms, (roll, pitch, yaw, *body_radps) = int(told[0]), told[1:]
        rebooted = has_rebooted(boot_ms, self._boot_ms)
        if rebooted:
            self._sync.reset()
        boot_ns = self._boot_ns(boot_ms, now_ns)
        senseless = self._is_senseless(boot_ns, now_ns)
        self._stamps_refused += rebooted or senseless
        stamp_ns = self._stamp(boot_ns, now_ns)
        wrapped = boot_ms + REBOOT_MS < self._boot_ms
        in_order = rebooted or wrapped or boot_ms > self._boot_ms
        if not senseless:  # one that strayed ahead would make the next good one look like a reboot
            self._boot_ms = boot_ms
        advances = self._attitude is None or rebooted or stamp_ns > self._attitude.stamp_ns
        if rebooted or senseless or (in_order and not advances):
            self._time_broke = True
        in_order = in_order and advances
        if in_order:
            about_x, about_y, about_z = body_radps
            self._attitude = self._sample(stamp_ns, (roll, pitch, yaw), (about_x, about_y, about_z))
            self._attitudes.append(self._attitude)
            self._time_broke = False

    def take_range(self, document: str, now_ns: int) -> None:
        """The fields of a DISTANCE_SENSOR, cm, as they came: in the library's own form of it neither the
        sensor's number nor the quality of its signal is left."""
        fields = whole_fields(document, *_RANGE_FIELDS)
        if fields is None:
            return
        (quality_pc,) = whole_fields(document, "signal_quality") or (0,)
        told = dict(zip(_RANGE_FIELDS, fields, strict=True), signal_quality=quality_pc)
        sample = range_sample(SimpleNamespace(**told))
        if sample is not None:
            self._take_sample(sample, now_ns, now_ns)

    def take_velocity(self, motion: Any, now_ns: int) -> None:
        """A PositionVelocityNed, of which only the vertical speed is known without GPS."""
        down_mps = motion.velocity.down_m_s
        if math.isfinite(down_mps):
            self._climb_mps, self._climb_ns = -down_mps, now_ns

    def take_battery(self, battery: Any, now_ns: int) -> None:
        """A Battery: volts, amperes and per cent, NaN or negative where they are not known."""
        if battery.id == 0:
            frac, volts = battery.remaining_percent / 100.0, float(battery.voltage_v)
            told_a = float(battery.current_battery_a)
            amperes = told_a if 0.0 <= told_a < math.inf else math.nan
            self._set_battery(now_ns, frac=frac, volts=volts, amperes=amperes, cells=self._cells)

    def take_cells(self, volts_mv: Sequence[int]) -> None:
        """The voltages of a BATTERY_STATUS, mV, which the library adds up."""
        self._cells = cells_of(volts_mv)

    def take_armed(self, armed: bool, _now_ns: int) -> None:
        self.armed = bool(armed)

    def take_landed(self, state: int, now_ns: int) -> None:
        self._landed, self._landed_ns = _LANDED.get(state, LandedState.UNKNOWN), now_ns

    def state(self, now_ns: int, *, in_control: bool, refusal: Refusal | None) -> VehicleState | None:
        """Everything at one glance; None until heartbeat and attitude were heard."""
        mode = "" if self.mode is None else self.mode.name
        return self._state(now_ns, mode, in_control=in_control, refusal=refusal)
