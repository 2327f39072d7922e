"""The messages an autopilot streams, made from its instruments."""

from __future__ import annotations

import math
from collections.abc import Callable

from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.sim.autopilot.link import Message
from flightd.sim.plant.airframe import Airframe
from flightd.sim.sensors.instruments import Sensors

LANDED_GROUND = dialect.MAV_LANDED_STATE_ON_GROUND
LANDED_AIR = dialect.MAV_LANDED_STATE_IN_AIR
LANDED_LANDING = dialect.MAV_LANDED_STATE_LANDING

_RANGE_PERIOD_MS = 40
_OWN_RANGE_ID, _OTHER_RANGE_ID = 0, 1
_CELLS = 3
_NO_CELL = 65535
_BUILD = (4 << 24) | (5 << 16) | (6 << 8) | 255

DATA_STREAMS: dict[int, tuple[int, ...]] = {
    dialect.MAV_DATA_STREAM_EXTENDED_STATUS: (dialect.MAVLINK_MSG_ID_SYS_STATUS,),
    dialect.MAV_DATA_STREAM_POSITION: (dialect.MAVLINK_MSG_ID_GLOBAL_POSITION_INT,),
    dialect.MAV_DATA_STREAM_EXTRA1: (dialect.MAVLINK_MSG_ID_ATTITUDE,),
    dialect.MAV_DATA_STREAM_EXTRA2: (dialect.MAVLINK_MSG_ID_VFR_HUD,),
    dialect.MAV_DATA_STREAM_EXTRA3: (
        dialect.MAVLINK_MSG_ID_DISTANCE_SENSOR,
        dialect.MAVLINK_MSG_ID_BATTERY_STATUS,
    ),
}
"""What a ground station's REQUEST_DATA_STREAM overwrites, by stream."""


class Instruments:
    """Telemetry of one vehicle.  The peer keeps `boot_ms`, `healthy` and `landed_state` up to date."""

    def __init__(self, airframe: Airframe, sensors: Sensors, second_range_m: float | None = None) -> None:
        self._airframe = airframe
        self._sensors = sensors
        self._second_range_m = second_range_m
        self.boot_ms = 0
        self.healthy = False
        self.landed_state = LANDED_GROUND
        self.home_m = 0.0
        """Where home has been set, above the first origin of the heights."""
        self._range_m = 0.0
        self._ranged_ms = -math.inf
        self._builders: dict[int, Callable[[], Message]] = {
            dialect.MAVLINK_MSG_ID_SYS_STATUS: self._sys_status,
            dialect.MAVLINK_MSG_ID_ATTITUDE: self._attitude,
            dialect.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: self._global_position,
            dialect.MAVLINK_MSG_ID_VFR_HUD: self._vfr_hud,
            dialect.MAVLINK_MSG_ID_DISTANCE_SENSOR: self._distance,
            dialect.MAVLINK_MSG_ID_BATTERY_STATUS: self._battery,
            dialect.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: self._extended_state,
            dialect.MAVLINK_MSG_ID_AUTOPILOT_VERSION: self._version,
        }

    def tell_local_position(self) -> None:
        """Have LOCAL_POSITION_NED besides GLOBAL_POSITION_INT, as PX4."""
        self._builders[dialect.MAVLINK_MSG_ID_LOCAL_POSITION_NED] = self._local_position

    def knows(self, message_id: int) -> bool:
        return message_id in self._builders

    def messages(self, message_id: int) -> tuple[Message, ...]:
        """The messages with the present readings, one for each sensor; KeyError for what it does not know."""
        message = self._builders[message_id]()
        if message_id != dialect.MAVLINK_MSG_ID_DISTANCE_SENSOR or self._second_range_m is None:
            return (message,)
        return self._range_message(_OWN_RANGE_ID, self._second_m(self._second_range_m)), message

    def clock_changed(self) -> None:
        """The boot clock goes on from elsewhere: the range finder measures anew whatever it says."""
        self._ranged_ms = -math.inf

    def _attitude(self) -> Message:
        sensors, airframe = self._sensors, self._airframe
        return dialect.MAVLink_attitude_message(
            self.boot_ms,
            sensors.roll_rad,
            sensors.pitch_rad,
            sensors.noisy_yaw_rad(),
            *sensors.body_rates_radps(airframe.kinematics(0)),
        )

    def _distance(self) -> Message:
        if not 0 <= self.boot_ms - self._ranged_ms < _RANGE_PERIOD_MS:
            self._ranged_ms = self.boot_ms
            self._range_m = self._sensors.range_m(self._airframe)
        return self._range_message(0 if self._second_range_m is None else _OTHER_RANGE_ID, self._range_m)

    def _second_m(self, more_m: float) -> float:
        """What the second one reads: 0 on the floor, as where it is built into the body."""
        return 0.0 if self.landed_state == LANDED_GROUND or not self._range_m else self._range_m + more_m

    def _range_message(self, number: int, distance_m: float) -> Message:
        params = self._sensors.params
        return dialect.MAVLink_distance_sensor_message(
            self.boot_ms,
            round(params.range_min_m * 100),
            round(params.range_max_m * 100),
            round(distance_m * 100),
            dialect.MAV_DISTANCE_SENSOR_LASER,
            number,
            dialect.MAV_SENSOR_ROTATION_PITCH_270,
            0,
            signal_quality=self._sensors.fault.range_quality_pc,
        )

    def _global_position(self) -> Message:
        """Without a position latitude and longitude stay 0; height and climb are the barometer's.  On the
        floor no speed is estimated."""
        sensors = self._sensors
        height_mm = round(sensors.height_m * 1000)
        sinks_cmps = 0 if self.landed_state == LANDED_GROUND else -round(sensors.told_climb_mps * 100)
        heading_cdeg = round(math.degrees(sensors.yaw_rad % math.tau) * 100) % 36000
        return dialect.MAVLink_global_position_int_message(
            self.boot_ms,
            0,
            0,
            height_mm,
            height_mm - round(self.home_m * 1000),
            0,
            0,
            sinks_cmps,
            heading_cdeg,
        )

    def _local_position(self) -> Message:
        """Down and its speed are the barometer's; the horizontal part is not estimated."""
        height_m, climb_mps = self._sensors.height_m, self._sensors.told_climb_mps
        return dialect.MAVLink_local_position_ned_message(
            self.boot_ms, 0.0, 0.0, -height_m, 0.0, 0.0, -climb_mps
        )

    def _vfr_hud(self) -> Message:
        """Its altitude freezes without a position, as measured on ArduCopter in GUIDED_NOGPS."""
        heading_deg = round(math.degrees(self._sensors.yaw_rad)) % 360
        throttle_pc = round(self._airframe.collective * 100)
        climb_mps = self._sensors.climb_mps
        return dialect.MAVLink_vfr_hud_message(0.0, 0.0, heading_deg, throttle_pc, 0.0, climb_mps)

    def _battery(self) -> Message:
        battery = self._sensors.battery
        cell_mv = round(battery.volts * 1000 / _CELLS)
        cells = [cell_mv] * _CELLS + [_NO_CELL] * (10 - _CELLS)
        used_mah, current_ca = round(battery.used_ah * 1000), round(battery.amperes * 100)
        remaining_pc = self._remaining_pc()
        return dialect.MAVLink_battery_status_message(
            0, 0, dialect.MAV_BATTERY_TYPE_LIPO, 32767, cells, current_ca, used_mah, -1, remaining_pc
        )

    def _remaining_pc(self) -> int:
        told_pc = self._sensors.fault.charge_pc
        return round(self._sensors.battery.charge_frac * 100) if told_pc is None else told_pc

    def _sys_status(self) -> Message:
        battery = self._sensors.battery
        sensors = dialect.MAV_SYS_STATUS_SENSOR_3D_GYRO | dialect.MAV_SYS_STATUS_PREARM_CHECK
        healthy = sensors if self.healthy else dialect.MAV_SYS_STATUS_SENSOR_3D_GYRO
        millivolt, centiampere = round(battery.volts * 1000), round(battery.amperes * 100)
        remaining_pc = self._remaining_pc()
        return dialect.MAVLink_sys_status_message(
            sensors, sensors, healthy, 200, millivolt, centiampere, remaining_pc, 0, 0, 0, 0, 0, 0
        )

    def _extended_state(self) -> Message:
        return dialect.MAVLink_extended_sys_state_message(dialect.MAV_VTOL_STATE_UNDEFINED, self.landed_state)

    def _version(self) -> Message:
        capabilities = dialect.MAV_PROTOCOL_CAPABILITY_SET_ATTITUDE_TARGET
        none = [0] * 8
        return dialect.MAVLink_autopilot_version_message(
            capabilities, _BUILD, 0, 0, 0, none, none, none, 0, 0, 0
        )
