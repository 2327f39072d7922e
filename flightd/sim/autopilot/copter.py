"""ArduCopter's semantics: modes, arming, attitude flight without position, landing, time-outs.

Measured on ArduCopter 4.5.6 or read in its sources: setpoints are obeyed in GUIDED_NOGPS and GUIDED
only and dropped in silence elsewhere; 0.5 thrust holds the height; after GUID_TIMEOUT the vehicle levels
and holds, it does not land; on the floor with nothing asked it disarms after DISARM_DELAY.
"""

from __future__ import annotations

import enum
import math
import random
from collections import deque

from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.core.geometry import GRAVITY_MPS2
from flightd.ports import Clock
from flightd.sim.autopilot.autopilot import AutopilotPeer, PeerConfig
from flightd.sim.autopilot.climb_loop import ClimbGains
from flightd.sim.autopilot.earth_field import earth_field_mgauss
from flightd.sim.autopilot.external_vision import NOT_TAKEN, Taken
from flightd.sim.autopilot.guided import AngleTarget
from flightd.sim.autopilot.link import MavlinkChannel, Message
from flightd.sim.autopilot.parameters import COPTER_PARAMETERS, ParameterServer
from flightd.sim.autopilot.telemetry import LANDED_AIR, LANDED_GROUND, LANDED_LANDING
from flightd.sim.plant.airframe import Airframe, AirframeCommand

_THRUST_IS_COLLECTIVE = 8
_RELAYS = 16
_IDLE_COLLECTIVE = 0.05
_LAND_DETECT_S = 1.0
_LEARN_S, _LEARN_MPS, _LEARN_RAD = 10.0, 0.6, math.radians(5.0)
"""ArduCopter learns what it hovers at within this time, while it climbs and leans by less and is told to
hold its height."""
_HOLDS_MPS = 1e-3
_LEAST_COLLECTIVE = 0.01
"""Down to here the motors are at their least, without which nothing has landed (`limit.throttle_lower`)."""
_LEAST_HOVER, _MOST_HOVER = 0.125, 0.6875
_PAUSE_S = 4.0
"""A failsafe's landing holds the height for so long before it sinks."""
_WATCH_S = 1.0 / 3.0
"""Failsafes of links are looked at in ArduCopter's loop of 3 Hz."""
_GCS_LAND = 5
"""FS_GCS_ENABLE: land."""
_BRAKE_RADPS, _BRAKE_RAD = 1.2, 0.25
"""How soon a landing brakes the speed that is estimated, and the most it leans for that."""
_FORCE = 21196
_EXTERNAL = 6
"""EK3_SRC1_*: external navigation."""
_LAGS = 100
_FIELD_MGAUSS = 100.0
"""ARMING_MAGTHRESH: north and east may differ by so much, down by twice that."""
_ORIGIN_ID = dialect.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN


class CopterMode(enum.IntEnum):
    """custom_mode of the modes this vehicle can be asked for."""

    STABILIZE = 0
    ALT_HOLD = 2
    AUTO = 3
    GUIDED = 4
    LOITER = 5
    RTL = 6
    LAND = 9
    POSHOLD = 16
    BRAKE = 17
    GUIDED_NOGPS = 20


_NEEDS_POSITION = frozenset(
    {
        CopterMode.AUTO,
        CopterMode.GUIDED,
        CopterMode.LOITER,
        CopterMode.RTL,
        CopterMode.POSHOLD,
        CopterMode.BRAKE,
    }
)
_GUIDED = frozenset({CopterMode.GUIDED, CopterMode.GUIDED_NOGPS})
_NOT_ARMABLE = frozenset({CopterMode.LAND, CopterMode.RTL, CopterMode.BRAKE})


class ArduCopterPeer(AutopilotPeer):
    """A copter on the floor, disarmed, in STABILIZE, until somebody talks to it."""

    takes_keys = True
    pilots_mode = CopterMode.ALT_HOLD
    landing_mode = CopterMode.LAND
    refused_arming = dialect.MAV_RESULT_FAILED

    def __init__(self, clock: Clock, airframe: Airframe, config: PeerConfig | None = None) -> None:
        config = config or PeerConfig()
        parameters = ParameterServer({**COPTER_PARAMETERS, **config.parameters})
        super().__init__(clock, airframe, config, parameters)
        self.mode = CopterMode.STABILIZE
        self._target = AngleTarget()
        self._low_battery_told = False
        self._low_battery_s = 0.0
        self._client_silent_s: float | None = None
        self._client_lost = False
        self._pause_s = 0.0
        self._origin: tuple[int, int] | None = None
        self._pose_lags: deque[int] = deque(maxlen=_LAGS)
        self._watch_due_s = random.Random(config.seed).uniform(0.0, _WATCH_S)

    def reboot(self) -> None:
        super().reboot()
        self._disarm()
        self.mode = CopterMode.STABILIZE
        self._target = AngleTarget()
        self._origin = None
        self.link.broadcast(self._heartbeat())

    # Commands

    def _set_mode(self, custom_mode: int) -> int:
        try:
            mode = CopterMode(custom_mode)
        except ValueError:
            self.say(dialect.MAV_SEVERITY_WARNING, f"No such mode {custom_mode}")
            return int(dialect.MAV_RESULT_FAILED)
        if self.armed and mode in _NEEDS_POSITION and not self._config.has_position:
            text = f"Mode change to {mode.name} failed: requires position"
            self.say(dialect.MAV_SEVERITY_WARNING, text)
            return int(dialect.MAV_RESULT_FAILED)
        if mode != self.mode:
            self.mode = mode
            self._target = AngleTarget(yaw_rad=self.sensors.yaw_rad)
            self._stick_yaw_rad = self.sensors.yaw_rad
            self._climb_loop.gains = self._climb_gains()  # a loop that runs goes on as it is
            self._pause_s = 0.0
            self.link.broadcast(self._heartbeat())
        return int(dialect.MAV_RESULT_ACCEPTED)

    def _land_by_failsafe(self) -> None:
        if self.mode != CopterMode.LAND:
            self._set_mode(CopterMode.LAND)
            self._pause_s = _PAUSE_S

    def _command(self, command: int, params: tuple[float, ...]) -> int:
        match command:
            case dialect.MAV_CMD_COMPONENT_ARM_DISARM:
                return self._arm_or_disarm(params[0], forced=params[1] == _FORCE)
            case dialect.MAV_CMD_NAV_TAKEOFF:
                return int(dialect.MAV_RESULT_FAILED)  # flies in GUIDED with a position only
            case dialect.MAV_CMD_NAV_LAND:
                return self._set_mode(CopterMode.LAND)
            case dialect.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN:
                if params[0] != 1 or self.armed:
                    return int(dialect.MAV_RESULT_DENIED)
                self.reboot()
                return int(dialect.MAV_RESULT_ACCEPTED)
            case _:
                return int(dialect.MAV_RESULT_UNSUPPORTED)

    def _set_output(self, command: int, params: tuple[float, ...]) -> int:
        if command != dialect.MAV_CMD_DO_SET_RELAY:
            return int(dialect.MAV_RESULT_UNSUPPORTED)
        if params[0] not in range(_RELAYS) or params[1] not in {0.0, 1.0}:
            return int(dialect.MAV_RESULT_FAILED)
        self.lamp_lit = params[1] == 1.0
        return int(dialect.MAV_RESULT_ACCEPTED)

    def _arm_or_disarm(self, arm: float, *, forced: bool) -> int:
        if arm == 1:
            return self._arm()
        if arm != 0:
            return int(dialect.MAV_RESULT_DENIED)
        if not self.landed and not forced:
            return int(dialect.MAV_RESULT_FAILED)
        self._disarm()
        return int(dialect.MAV_RESULT_ACCEPTED)

    def _on_armed(self) -> None:
        self._climb_loop.reset(self.sensors.height_m)
        self.say(dialect.MAV_SEVERITY_INFO, "Arming motors")
        self.link.broadcast(self._heartbeat())

    def _arming_refusal(self) -> str | None:
        if not self.is_ready:
            return "PreArm: Gyros still settling"
        unhealthy = self.arming_block or self._unhealthy()
        if unhealthy:
            return f"PreArm: {unhealthy}"
        if self.sensors.battery.volts < self.parameters["BATT_LOW_VOLT"]:
            return "PreArm: Battery 1 below minimum arming voltage"
        if self.mode in _NOT_ARMABLE:
            return f"Arm: {self.mode.name} mode not armable"
        if self.mode in _NEEDS_POSITION and not self._config.has_position:
            return "PreArm: Need Position Estimate"
        return None

    def _unhealthy(self) -> str:
        """The sensor that is against arming; empty: none.  The compass is held against the earth's field of
        where it believes to be, if anywhere."""
        if self.parameters["VISO_TYPE"] and not self.vision.is_heard:
            return "VisOdom: not healthy"
        if self._origin is None:
            return ""
        felt = earth_field_mgauss(*self._config.place_deg)
        expected = earth_field_mgauss(self._origin[0] * 1e-7, self._origin[1] * 1e-7)
        north, east, down = (abs(a - b) for a, b in zip(felt, expected, strict=True))
        if max(north, east) > _FIELD_MGAUSS:
            return f"Check mag field (xy diff:{max(north, east):.0f}>{_FIELD_MGAUSS:.0f})"
        if down > 2.0 * _FIELD_MGAUSS:
            return f"Check mag field (z diff:{down:.0f}>{2.0 * _FIELD_MGAUSS:.0f})"
        return ""

    def _on_disarmed(self) -> None:
        self.say(dialect.MAV_SEVERITY_INFO, "Disarming motors")
        self.link.broadcast(self._heartbeat())

    def _setpoint(self, message: Message) -> None:
        if self.mode in _GUIDED:
            self._target.take(message)

    def _client_beat(self, system_id: int) -> None:
        if system_id == self.parameters["SYSID_MYGCS"]:
            self._client_silent_s = 0.0

    def received(self, channel: MavlinkChannel, message: Message) -> None:
        if message.get_type() == "SET_GPS_GLOBAL_ORIGIN" and self._origin is None:
            self._origin = message.latitude, message.longitude
        super().received(channel, message)

    def _taken(self) -> Taken:
        """Its estimator takes a place before it takes anything, but wants no origin."""
        parameters = self.parameters
        if not parameters["VISO_TYPE"]:
            return NOT_TAKEN
        if parameters["EK3_SRC1_POSXY"] != _EXTERNAL:
            return NOT_TAKEN
        speed = parameters["EK3_SRC1_VELXY"] == _EXTERNAL
        return Taken(speed=speed, place=True, speed_sigma_mps=parameters["VISO_VEL_M_NSE"])

    def _exposed_ns(self, stamp_ns: int, now_ns: int) -> int:
        """It knows nothing of its sender's clock: the fastest pose of late is VISO_DELAY_MS old."""
        self._pose_lags.append(now_ns - stamp_ns)
        least_ns = min(self._pose_lags)
        return stamp_ns + least_ns - round(self.parameters["VISO_DELAY_MS"] * 1e6)

    # Flight code

    def _control(self, dt_s: float) -> AirframeCommand:
        self._target.step(dt_s, max(0.1, self.parameters["GUID_TIMEOUT"]))
        self._watch_battery(dt_s)
        self._watch_client(dt_s)
        if not self.armed:
            return AirframeCommand()
        roll, pitch, yaw, yaw_rate, climb_mps = self._targets(dt_s)
        raw = self._raw_collective()
        if raw is not None:
            climb_mps = 1.0 if raw > self.parameters["MOT_THST_HOVER"] else -1.0
        if self.landed and climb_mps <= 0.0:
            return self._stand(dt_s)
        self.landed = False
        self._idle_s = 0.0
        if raw is None:
            collective = self._hold_climb(dt_s, climb_mps)
        else:
            collective = raw
            self._climb_loop.reset(self.sensors.height_m, raw, self.sensors.climb_mps)
        self._detect_landing(dt_s, climb_mps, collective)
        self._learn_hover(dt_s, collective)
        return self._fly(roll, pitch, yaw, yaw_rate, collective)

    def _targets(self, dt_s: float) -> tuple[float, float, float, float, float]:
        """Roll, pitch, yaw, yaw rate and climb rate of the present mode."""
        if self.mode in _GUIDED:
            target = self._target
            up_mps = self.parameters["WPNAV_SPEED_UP"] / 100.0
            down_mps = self.parameters["WPNAV_SPEED_DN"] / 100.0
            climb_mps = target.climb_mps(up_mps, down_mps)
            return target.roll_rad, target.pitch_rad, target.yaw_rad, target.yaw_rate_radps, climb_mps
        if self.mode == CopterMode.LAND:
            self._pause_s -= dt_s
            sink_mps = 0.0 if self._pause_s > 0.0 else self.parameters["LAND_SPEED"] / 100.0
            return *self._braking(), self._stick_yaw_rad, 0.0, -sink_mps
        sticks = self.sticks
        self._stick_yaw_rad += sticks.yaw_rate_radps * dt_s
        return sticks.roll_rad, sticks.pitch_rad, self._stick_yaw_rad, sticks.yaw_rate_radps, sticks.climb_mps

    def _braking(self) -> tuple[float, float]:
        """Roll and pitch of a landing: against the estimated speed, level where none is estimated."""
        speed = self.vision.speed_mps(self.airframe)
        if speed is None:
            return 0.0, 0.0
        cos, sin = math.cos(self.airframe.yaw_rad), math.sin(self.airframe.yaw_rad)
        ahead, aside = cos * speed[0] + sin * speed[1], -sin * speed[0] + cos * speed[1]
        roll, pitch = -_BRAKE_RADPS * aside / GRAVITY_MPS2, _BRAKE_RADPS * ahead / GRAVITY_MPS2
        return min(max(roll, -_BRAKE_RAD), _BRAKE_RAD), min(max(pitch, -_BRAKE_RAD), _BRAKE_RAD)

    def _raw_collective(self) -> float | None:
        """The setpoint's thrust where GUID_OPTIONS makes it collective, None where the height loop flies."""
        raw = int(self.parameters["GUID_OPTIONS"]) & _THRUST_IS_COLLECTIVE
        if self.mode in _GUIDED and raw and not self._target.holding:
            return max(0.0, self._target.thrust)
        return None

    def _stand(self, dt_s: float) -> AirframeCommand:
        """Armed on the floor: motors idle, targets follow the vehicle, and the disarm delay runs."""
        self._climb_loop.reset(self.sensors.height_m)
        self._stick_yaw_rad = self.sensors.yaw_rad
        if self._target.holding:
            self._target.yaw_rad = self.sensors.yaw_rad
        self._idle_s += dt_s
        delay_s = self.parameters["DISARM_DELAY"]
        if self.mode == CopterMode.LAND or (delay_s > 0 and self._idle_s >= delay_s):
            self._disarm()
        return AirframeCommand(motors=True, collective=_IDLE_COLLECTIVE, yaw_rad=self.airframe.yaw_rad)

    def _detect_landing(self, dt_s: float, climb_mps: float, collective: float) -> None:
        """Down is wanted, the motors are at their minimum, and nothing moves: for a second."""
        low = collective <= _LEAST_COLLECTIVE
        still = abs(self.sensors.climb_mps) < 0.15
        self._settled_s = self._settled_s + dt_s if climb_mps < 0.0 and low and still else 0.0
        if self._settled_s >= _LAND_DETECT_S:
            self.landed = True
            self._settled_s = 0.0

    def _climb_gains(self) -> ClimbGains:
        """As parameters are set; it reads them when it enters a mode."""
        accel_mps2 = self.parameters["WPNAV_ACCEL_Z"] / 100.0
        return ClimbGains(accel_mps2=accel_mps2, jerk_mps3=self.parameters["PSC_JERK_Z"])

    def _learn_hover(self, dt_s: float, collective: float) -> None:
        """MOT_THST_HOVER follows the collective of a hover that is nearly level, where MOT_HOVER_LEARN says
        so."""
        sensors, parameters = self.sensors, self.parameters
        leans = max(abs(sensors.roll_rad), abs(sensors.pitch_rad)) > _LEARN_RAD
        if self.landed or not parameters["MOT_HOVER_LEARN"] or leans or not collective:
            return
        if abs(sensors.climb_mps) < _LEARN_MPS and abs(self._climb_loop.wanted_mps) < _HOLDS_MPS:
            guess = parameters["MOT_THST_HOVER"]
            guess += (collective - guess) * dt_s / (dt_s + _LEARN_S)
            parameters["MOT_THST_HOVER"] = min(max(guess, _LEAST_HOVER), _MOST_HOVER)

    def _watch_client(self, dt_s: float) -> None:
        """The failsafe for the ground station: once the system it watches was heard and has fallen silent, as
        seen three times a second."""
        if self._client_silent_s is None:
            return
        self._client_silent_s += dt_s
        self._watch_due_s -= dt_s
        if self._watch_due_s > 0.0:
            return
        self._watch_due_s += _WATCH_S
        was_lost = self._client_lost
        self._client_lost = self._client_silent_s > self.parameters["FS_GCS_TIMEOUT"]
        if self.armed and self._client_lost and not was_lost:
            self.say(dialect.MAV_SEVERITY_WARNING, "GCS Failsafe")
            if self.parameters["FS_GCS_ENABLE"] == _GCS_LAND:
                self._land_by_failsafe()

    def _watch_battery(self, dt_s: float) -> None:
        """The failsafe for a voltage that stays low for so long."""
        if self._low_battery_told or not self.armed:
            return
        is_low = self.sensors.battery.volts < self.parameters["BATT_LOW_VOLT"]
        self._low_battery_s = self._low_battery_s + dt_s if is_low else 0.0
        if self._low_battery_s > self.parameters["BATT_LOW_TIMER"]:
            self._low_battery_told = True
            self.say(dialect.MAV_SEVERITY_CRITICAL, f"Battery 1 is low {self.sensors.battery.volts:.2f}V")
            if self.parameters["BATT_FS_LOW_ACT"] == 1:
                self._land_by_failsafe()

    # Reports

    def knows(self, message_id: int) -> bool:
        return super().knows(message_id) or (message_id == _ORIGIN_ID and self._origin is not None)

    def messages(self, message_id: int) -> tuple[Message, ...]:
        if message_id == _ORIGIN_ID and self._origin is not None:
            return (dialect.MAVLink_gps_global_origin_message(*self._origin, 0),)
        return super().messages(message_id)

    def _refresh(self, now_ns: int) -> None:
        super()._refresh(now_ns)
        if self.landed and self.reports_landed:
            self.instruments.landed_state = LANDED_GROUND
        else:
            landing = self.mode == CopterMode.LAND
            self.instruments.landed_state = LANDED_LANDING if landing else LANDED_AIR

    def _heartbeat(self) -> Message:
        base = self._base_mode() | (dialect.MAV_MODE_FLAG_GUIDED_ENABLED if self.mode in _GUIDED else 0)
        active = dialect.MAV_STATE_ACTIVE if self.armed and not self.landed else dialect.MAV_STATE_STANDBY
        client_lost = self._client_lost and self.parameters["FS_GCS_ENABLE"]
        if client_lost or self._low_battery_told:  # a failsafe that has acted
            active = dialect.MAV_STATE_CRITICAL
        return dialect.MAVLink_heartbeat_message(
            dialect.MAV_TYPE_QUADROTOR, dialect.MAV_AUTOPILOT_ARDUPILOTMEGA, base, self.mode, active, 3
        )
