"""PX4's semantics: OFFBOARD by a stream that must run already, raw thrust, its land detector and failsafes.

Read in PX4's documentation and sources, not measured: no PX4 was at hand.
"""

from __future__ import annotations

import enum
import math
from typing import ClassVar

from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.core.geometry import GRAVITY_MPS2
from flightd.ports import Clock
from flightd.sim.autopilot.autopilot import AutopilotPeer, PeerConfig
from flightd.sim.autopilot.external_vision import Taken
from flightd.sim.autopilot.guided import euler
from flightd.sim.autopilot.link import MavlinkChannel, Message
from flightd.sim.autopilot.parameters import PX4_PARAMETERS, ParameterServer
from flightd.sim.autopilot.telemetry import LANDED_AIR, LANDED_GROUND, LANDED_LANDING
from flightd.sim.plant.airframe import Airframe, AirframeCommand

_STREAM_S = 1.0
_STREAM_GAP_S = 0.5
_IDLE_COLLECTIVE = 0.04
_LAND_DETECT_S = 1.0
_LOW_SHARE = 0.1
"""Of the way from MPC_THR_MIN to the hover thrust."""
_HOVER_S, _LEAST_FELT = 2.0, 0.5
"""The hover thrust is known within this time; of a fall (share of the weight felt) nothing is learnt."""
_FORCE = 21196
_EV_PLACE, _EV_SPEED = 1, 4
"""Bits of EKF2_EV_CTRL."""
_TIMESYNC_NS = 1_000_000_000
_IGNORE_YAW_RATE = 4
_IGNORE_THRUST = 64
_IGNORE_ATTITUDE = 128
_AUTO = 4
_OBL_LAND = 4


class Px4Mode(enum.IntEnum):
    """custom_mode: main mode << 16 | sub mode << 24."""

    MANUAL = 1 << 16
    ALTCTL = 2 << 16
    POSCTL = 3 << 16
    AUTO_LOITER = _AUTO << 16 | 3 << 24
    AUTO_LAND = _AUTO << 16 | 6 << 24
    OFFBOARD = 6 << 16
    STABILIZED = 7 << 16


_NEEDS_POSITION = frozenset({Px4Mode.POSCTL, Px4Mode.AUTO_LOITER})


class Px4Peer(AutopilotPeer):
    """A PX4 multicopter on the floor, disarmed, in ALTCTL.  What it hovers at it begins to
    estimate at MPC_THR_HOVER, by what its accelerometers feel in the air."""

    pilots_mode = Px4Mode.ALTCTL
    landing_mode = Px4Mode.AUTO_LAND
    unasked_ns: ClassVar = {dialect.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: 20_000_000}
    fixed_rates: ClassVar = frozenset({dialect.MAVLINK_MSG_ID_HEARTBEAT})
    refused_arming = dialect.MAV_RESULT_TEMPORARILY_REJECTED

    def __init__(self, clock: Clock, airframe: Airframe, config: PeerConfig | None = None) -> None:
        config = config or PeerConfig()
        parameters = ParameterServer({**PX4_PARAMETERS, **config.parameters}, bytewise=True)
        super().__init__(clock, airframe, config, parameters)
        self.instruments.tell_local_position()
        self.streams.timesync_ns = _TIMESYNC_NS
        self.mode = Px4Mode.ALTCTL
        self._q_target = (0.0, 0.0, 0.0)
        self._yaw_rate_radps = 0.0
        self._thrust = 0.0
        self._hover = parameters["MPC_THR_HOVER"]
        self._setpoint_age_s = math.inf
        self._stream_s = 0.0
        self._has_flown = self._in_failsafe = False
        self._companion_ns: int | None = None
        """Its companion's clock is so far ahead of its own since boot."""

    @property
    def thrust(self) -> float:
        """Of the newest setpoint, 0 to 1."""
        return self._thrust

    @property
    def stream_s(self) -> float:
        """How long setpoints have come without a gap."""
        return self._stream_s

    def reboot(self) -> None:
        super().reboot()
        self._disarm()
        self.mode = Px4Mode.ALTCTL
        self._setpoint_age_s, self._stream_s = math.inf, 0.0
        self._companion_ns = None

    # Commands

    def _set_mode(self, custom_mode: int) -> int:
        try:
            mode = Px4Mode(custom_mode)
        except ValueError:
            return int(dialect.MAV_RESULT_DENIED)
        if mode == Px4Mode.OFFBOARD and self._stream_s < _STREAM_S:
            return self._unavailable("Offboard")
        if mode in _NEEDS_POSITION:
            return self._unavailable("Position" if mode == Px4Mode.POSCTL else "Hold")
        self._enter(mode)
        return int(dialect.MAV_RESULT_ACCEPTED)

    def _unavailable(self, name: str) -> int:
        self.say(dialect.MAV_SEVERITY_CRITICAL, f"Switching to {name} is currently not available")
        return int(dialect.MAV_RESULT_TEMPORARILY_REJECTED)

    def _enter(self, mode: Px4Mode) -> None:
        self._in_failsafe = False
        if mode != self.mode:
            self.mode = mode
            self._stick_yaw_rad = self.sensors.yaw_rad
            self._climb_loop.reset(self.sensors.height_m, self._hover, self.sensors.climb_mps)

    def _mode_of(self, params: tuple[float, ...]) -> int:
        """DO_SET_MODE carries main and sub mode as parameters 2 and 3."""
        main, sub = params[1], params[2]
        return int(main) << 16 | int(sub) << 24 if 0 <= main < 256 and 0 <= sub < 256 else -1

    def _set_output(self, command: int, params: tuple[float, ...]) -> int:
        if command != dialect.MAV_CMD_DO_SET_ACTUATOR or params[6] != 0.0:
            return int(dialect.MAV_RESULT_UNSUPPORTED)
        set_to = [value for value in params[:6] if not math.isnan(value)]
        self.lamp_lit = any(value > 0.0 for value in set_to) if set_to else self.lamp_lit
        return int(dialect.MAV_RESULT_ACCEPTED)

    def _command(self, command: int, params: tuple[float, ...]) -> int:
        match command:
            case dialect.MAV_CMD_COMPONENT_ARM_DISARM if params[0] == 1:
                return self._arm()
            case dialect.MAV_CMD_COMPONENT_ARM_DISARM if params[0] == 0:
                if self.armed and not self.landed and params[1] != _FORCE:
                    self.say(dialect.MAV_SEVERITY_CRITICAL, "Disarming denied: not landed")
                    return int(dialect.MAV_RESULT_TEMPORARILY_REJECTED)
                self._disarm()
                return int(dialect.MAV_RESULT_ACCEPTED)
            case dialect.MAV_CMD_NAV_LAND:
                return self._set_mode(Px4Mode.AUTO_LAND)
            case dialect.MAV_CMD_COMPONENT_ARM_DISARM | dialect.MAV_CMD_NAV_TAKEOFF:
                return int(dialect.MAV_RESULT_DENIED)
            case _:
                return int(dialect.MAV_RESULT_UNSUPPORTED)

    def _on_armed(self) -> None:
        self._has_flown = False
        self.instruments.home_m = -self._config.home_leap_m
        self.say(dialect.MAV_SEVERITY_INFO, "Armed by external command")

    def _arming_refusal(self) -> str | None:
        if not self.is_ready:
            return "Preflight Fail: system power unstable"
        if self.arming_block:
            return f"Preflight Fail: {self.arming_block}"
        if self.mode == Px4Mode.OFFBOARD and self._setpoint_age_s > self.parameters["COM_OF_LOSS_T"]:
            return "Arming denied: no offboard signal"
        if self.mode == Px4Mode.AUTO_LAND:
            return "Arming denied: mode not armable"
        return None

    def _on_disarmed(self) -> None:
        self.say(dialect.MAV_SEVERITY_INFO, "Disarmed")

    def received(self, channel: MavlinkChannel, message: Message) -> None:
        if message.get_type() == "TIMESYNC" and message.tc1:
            now_ns = self.boot_clock_ns(self._clock.now_ns())
            self._companion_ns = message.tc1 - (message.ts1 + now_ns) // 2
        super().received(channel, message)

    def _taken(self) -> Taken:
        bits = int(self.parameters["EKF2_EV_CTRL"])
        return Taken(speed=bool(bits & _EV_SPEED), place=bool(bits & _EV_PLACE), own_attitude=True)

    def _exposed_ns(self, stamp_ns: int, now_ns: int) -> int:
        """By its companion's clock as TIMESYNC compared it; until then a pose is of when it came."""
        if self._companion_ns is None:
            return now_ns
        boot_ns = stamp_ns - self._companion_ns
        age_ns = self.boot_clock_ns(now_ns) - boot_ns + round(self.parameters["EKF2_EV_DELAY"] * 1e6)
        return now_ns - age_ns

    def _setpoint(self, message: Message) -> None:
        """Proof of life in any mode; obeyed in OFFBOARD only.  A missing thrust is none at all."""
        mask = message.type_mask
        if mask & _IGNORE_ATTITUDE or not self.parameters["MAV_FWDEXTSP"]:
            return
        gap_s, self._setpoint_age_s = self._setpoint_age_s, 0.0
        if gap_s > _STREAM_GAP_S:
            self._stream_s = 0.0
        norm = math.hypot(*message.q)
        if not norm > 0.0:  # undefined there: it must not crash here
            return
        self._q_target = euler(*(part / norm for part in message.q))
        self._yaw_rate_radps = 0.0 if mask & _IGNORE_YAW_RATE else message.body_yaw_rate
        missing = mask & _IGNORE_THRUST or not math.isfinite(message.thrust)
        self._thrust = 0.0 if missing else min(max(message.thrust, 0.0), 1.0)

    # Flight code

    def _control(self, dt_s: float) -> AirframeCommand:
        self._setpoint_age_s += dt_s
        self._stream_s = self._stream_s + dt_s if self._setpoint_age_s <= _STREAM_GAP_S else 0.0
        if not self.armed:
            return AirframeCommand()
        if self.mode == Px4Mode.OFFBOARD and self._setpoint_age_s > self.parameters["COM_OF_LOSS_T"]:
            self._lose_offboard()
        roll, pitch, yaw, yaw_rate, collective, down = self._targets(dt_s)
        self._estimate_hover(dt_s, collective)
        self._detect_landing(dt_s, collective, down=down)
        self._disarm_when_done(dt_s)
        return self._fly(roll, pitch, yaw, yaw_rate, max(collective, _IDLE_COLLECTIVE))

    def _targets(self, dt_s: float) -> tuple[float, float, float, float, float, bool]:
        """Roll, pitch, yaw, yaw rate, collective, and whether a height loop wants to go down."""
        if self.mode == Px4Mode.OFFBOARD:
            return *self._q_target, self._yaw_rate_radps, self._thrust, False
        sticks = self.sticks
        climb_mps = sticks.climb_mps
        roll, pitch = sticks.roll_rad, sticks.pitch_rad
        if self.mode == Px4Mode.AUTO_LAND:
            climb_mps, roll, pitch = -self.parameters["MPC_LAND_SPEED"], 0.0, 0.0
        if self.landed and climb_mps <= 0.0:
            self._climb_loop.reset(self.sensors.height_m)
            return 0.0, 0.0, self.sensors.yaw_rad, 0.0, 0.0, climb_mps < 0.0
        self._stick_yaw_rad += sticks.yaw_rate_radps * dt_s
        collective = self._hold_climb(dt_s, climb_mps)
        return roll, pitch, self._stick_yaw_rad, sticks.yaw_rate_radps, collective, climb_mps < 0.0

    def _estimate_hover(self, dt_s: float, collective: float) -> None:
        """As its hover thrust estimator, which begins anew with each flight and learns by its own height loop
        alone: nothing while this computer holds the height."""
        if self.landed:
            self._hover = self.parameters["MPC_THR_HOVER"]
        if self.landed or self.mode == Px4Mode.OFFBOARD:
            return
        felt = 1.0 + self.sensors.accel_mps2 / GRAVITY_MPS2
        if felt > _LEAST_FELT:
            hovers = collective * self.sensors.tilt_cos / felt
            self._hover += (hovers - self._hover) * min(dt_s / _HOVER_S, 1.0)

    def _detect_landing(self, dt_s: float, collective: float, *, down: bool) -> None:
        """Without a climb-rate setpoint only a thrust near zero counts as landed; with one also a thrust that
        is low by what it believes to hover at."""
        least, idle = self.parameters["MPC_THR_MIN"], self.parameters["MPC_MANTHR_MIN"] + 0.01
        low = collective <= (least + _LOW_SHARE * (self._hover - least) if down else idle)
        still = abs(self.sensors.climb_mps) < self.parameters["LNDMC_Z_VEL_MAX"]
        self._settled_s = self._settled_s + dt_s if low and still else 0.0
        if self._settled_s >= _LAND_DETECT_S:
            self.landed = True
        elif self.sensors.climb_mps > 0.15 and collective > idle:
            self.landed = False
            self._has_flown = True

    def _disarm_when_done(self, dt_s: float) -> None:
        self._idle_s = self._idle_s + dt_s if self.landed else 0.0
        name = "COM_DISARM_LAND" if self._has_flown else "COM_DISARM_PRFLT"
        delay_s = self.parameters[name]
        if delay_s > 0 and self._idle_s >= delay_s:
            self._disarm()

    def _lose_offboard(self) -> None:
        self.say(dialect.MAV_SEVERITY_CRITICAL, "Offboard control lost")
        lands = self.parameters["COM_OBL_RC_ACT"] == _OBL_LAND
        self._enter(Px4Mode.AUTO_LAND if lands else Px4Mode.ALTCTL)
        self._in_failsafe = True

    # Reports

    def _refresh(self, now_ns: int) -> None:
        super()._refresh(now_ns)
        landing = LANDED_LANDING if self.mode == Px4Mode.AUTO_LAND else LANDED_AIR
        self.instruments.landed_state = LANDED_GROUND if self.landed and self.reports_landed else landing

    def _heartbeat(self) -> Message:
        flying = dialect.MAV_STATE_CRITICAL if self._in_failsafe else dialect.MAV_STATE_ACTIVE
        active = flying if self.armed else dialect.MAV_STATE_STANDBY
        return dialect.MAVLink_heartbeat_message(
            dialect.MAV_TYPE_QUADROTOR, dialect.MAV_AUTOPILOT_PX4, self._base_mode(), self.mode, active, 3
        )
