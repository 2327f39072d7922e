"""MAVSDK's telemetry to `VehicleState`: units, signs and times put right in one place."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from mavsdk.plugins.telemetry import FlightMode
from mavsdk.plugins.telemetry import LandedState as SdkLanded

from flightd.adapters.vehicle.mavlink.services.clock_offset import ClockSync
from flightd.adapters.vehicle.mavlink.telemetry import cells_of
from flightd.adapters.vehicle.newest_readings import NewestReadings
from flightd.adapters.vehicle.range_finders import RangeSample
from flightd.core.refusal import Refusal
from flightd.core.types import Attitude, LandedState, VehicleState

_CLIMB_STALE_NS = 500_000_000
_REBOOT_US = 1_000_000
_DOWN_DEG = 270.0

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
        self._boot_us = 0
        self._cells = 0
        self.mode: FlightMode | None = None

    @property
    def custom_mode(self) -> int | None:
        """The flight mode as a number; the library does not pass PX4's own on."""
        return None if self.mode is None else int(self.mode)

    def take_mode(self, mode: int, now_ns: int) -> None:
        """The library passes the flight mode on with every HEARTBEAT; one it has no name for is unknown."""
        self.mode, self.heartbeat_ns = _MODES.get(mode, FlightMode.UNKNOWN), now_ns

    def take_attitude(self, angles: Any, now_ns: int) -> None:
        """An EulerAngle, degrees."""
        degrees = (angles.roll_deg, angles.pitch_deg, angles.yaw_deg)
        if not all(abs(angle) <= 360.0 for angle in degrees):  # NaN fails too
            return
        boot_us = int(angles.timestamp_us)
        rebooted = boot_us + _REBOOT_US < self._boot_us
        if rebooted:
            self._sync.reset()
        stamp_ns = self._stamp(boot_us * 1000, now_ns)
        in_order = rebooted or boot_us > self._boot_us
        self._boot_us = boot_us
        if self._attitude is not None and not rebooted:
            in_order = in_order and stamp_ns > self._attitude.stamp_ns
        if in_order:
            self._attitude = Attitude(stamp_ns, *map(math.radians, degrees))
            self._attitudes.append(self._attitude)

    def take_range(self, sensor: Any, now_ns: int) -> None:
        """A DistanceSensor, metres along the body's axis.  It has no number: two are told apart by their
        limits."""
        distance_m = sensor.current_distance_m
        looks_down = abs(sensor.orientation.pitch_deg % 360.0 - _DOWN_DEG) < 1.0
        if not looks_down or not math.isfinite(distance_m):
            return
        least_m, most_m = max(sensor.minimum_distance_m, 0.01), sensor.maximum_distance_m
        self._take_sample(RangeSample((least_m, most_m), distance_m, least_m, most_m), now_ns, now_ns)

    def take_velocity(self, motion: Any, now_ns: int) -> None:
        """A PositionVelocityNed, of which only the vertical speed is known without GPS."""
        down_mps = motion.velocity.down_m_s
        if math.isfinite(down_mps):
            self._climb_mps, self._climb_ns = -down_mps, now_ns

    def take_battery(self, battery: Any, now_ns: int) -> None:
        """A Battery: volts and per cent, NaN or negative where they are not known."""
        if battery.id == 0:
            frac, volts = battery.remaining_percent / 100.0, float(battery.voltage_v)
            self._set_battery(now_ns, frac=frac, volts=volts, cells=self._cells)

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
