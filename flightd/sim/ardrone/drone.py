"""The drone's flight states, watchdogs and state bits: commands and time in, telemetry out; no sockets.

Where the real firmware is not documented the choice is a field of `DroneOptions`.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from flightd.sim.ardrone.at_commands import DroneCommand, SequenceRule, parse
from flightd.sim.ardrone.configuration import Configuration, Ids
from flightd.sim.ardrone.flight import FlightLoops, LoopTargets
from flightd.sim.ardrone.navdata_writer import ALL_OPTIONS, OPTION_BYTES, NavdataReport, bootstrap, packet
from flightd.sim.ardrone.states import (
    AIRBORNE,
    BIT_ALTITUDE,
    BIT_BOOTSTRAP,
    BIT_CAMERA,
    BIT_COM_LOST,
    BIT_COM_WATCHDOG,
    BIT_COMMAND_ACK,
    BIT_DEMO,
    BIT_EMERGENCY,
    BIT_FLY,
    BIT_VBAT_LOW,
    BITS_THREADS,
    PCMD_PROGRESSIVE,
    REF_EMERGENCY,
    REF_FLY,
    DroneOptions,
    MajorState,
    Stick,
)
from flightd.sim.plant.airframe import Airframe
from flightd.sim.sensors.instruments import Sensors

DEMO_PERIOD_NS = 1_000_000_000 // 15
COM_WATCHDOG_NS = 50_000_000
COM_LOST_NS = 2_000_000_000


_FLYING_ALT_OUT_ZONE = 3
_HOVERING_LOST_COM = 8


class Drone:
    """One AR.Drone 2.0.  `command` takes datagrams of the AT port, `step` lets time pass, `navdata` gives
    the packet that is due.  `faults` are state bits that a test or scenario forces (a cut-out, angles out
    of range): they raise an emergency and keep it up for as long as they stand; `warnings` are such bits
    that raise none (a deaf sonar)."""

    def __init__(self, airframe: Airframe, sensors: Sensors, options: DroneOptions | None = None) -> None:
        self.airframe = airframe
        self.options = options or DroneOptions()
        self.configuration = Configuration()
        self.loops = FlightLoops(airframe, sensors)
        self._battery = sensors.battery
        self._battery.update(0.0, airframe)  # it may be told to fly at once
        self.send_configuration: Callable[[bytes], None] = lambda _text: None
        self.faults = 0
        self.warnings = 0
        self.ignored_commands = 0
        self._boot()

    def _boot(self) -> None:
        self.major = MajorState.LANDED
        self.minor = 0
        self.emergency = False
        self.streaming = False
        self._bootstrap = True
        self._ack = False
        self._rule = SequenceRule()
        self._stick = Stick()
        self._fly = False
        self._emergency_bit = False
        self._named: Ids | None = None
        self._navdata_sequence = 1
        self._navdata_due_ns = 0
        self._entered_ns = 0
        self._booted_ns: int | None = None
        self._command_ns: int | None = None
        self._profile_ready_ns = 0
        self._com_lost = True

    def reboot(self) -> None:
        """Power off and on: counters restart, the configuration stays."""
        self._boot()
        self.loops.zero_yaw()

    @property
    def airborne(self) -> bool:
        return self.major in AIRBORNE

    @property
    def acknowledges(self) -> bool:
        """Whether the acknowledge bit of the last configuration command still stands."""
        return self._ack

    @property
    def last_sequence(self) -> int:
        """Number of the last command obeyed."""
        return self._rule.last

    # commands

    def command(self, datagram: bytes, now_ns: int) -> None:
        """Obey one datagram of the AT port."""
        for command in parse(datagram):
            if not self._rule.accept(command.sequence):
                self.ignored_commands += 1
                continue
            self._command_ns = now_ns
            named, self._named = self._named, None
            self._obey(command, named, now_ns)

    def _obey(self, command: DroneCommand, named: Ids | None, now_ns: int) -> None:
        match command.name:
            case "REF":
                self._ref(command.integer(0), now_ns)
            case "PCMD" | "PCMD_MAG":
                self._pcmd(command)
            case "FTRIM" if self.major == MajorState.LANDED:
                self.loops.trim()
            case "CTRL":
                self._ctrl(command.integer(0))
            case "CONFIG_IDS":
                session, user, application = (command.text(n) or "" for n in range(3))
                self._named = Ids(session, user, application)
            case "CONFIG":
                self._config(command, named, now_ns)
            case _:
                pass  # COMWDG has done its work by arriving; the rest changes nothing here

    def _ref(self, bits: int | None, now_ns: int) -> None:
        if bits is None:
            return
        self._fly = bool(bits & REF_FLY)
        pressed = bool(bits & REF_EMERGENCY)
        if pressed and not self._emergency_bit:
            if not self.emergency:
                self._cut_motors(now_ns)
            elif not self.faults:
                self.emergency = False
                self._enter(MajorState.LANDED, now_ns)
        self._emergency_bit = pressed

    def _pcmd(self, command: DroneCommand) -> None:
        flag = command.integer(0)
        roll, pitch, gaz, yaw = (command.fraction(n) for n in range(1, 5))
        if flag is None or roll is None or pitch is None or gaz is None or yaw is None:
            return
        self._stick = Stick(flag, roll, pitch, gaz, yaw)

    def _ctrl(self, mode: int | None) -> None:
        if mode in (0, 5):
            self._ack = False
        elif mode in (4, 6) and not self._ack:
            self._ack = True
            self.send_configuration(self.configuration.dump() if mode == 4 else self.configuration.dump_ids())

    def _config(self, command: DroneCommand, named: Ids | None, now_ns: int) -> None:
        key, value = command.text(0), command.text(1)
        if key is None or value is None or (self._ack and self.options.config_needs_clear_ack):
            return
        self._ack = True
        deaf = self.options.config_needs_navdata and not self.streaming
        if deaf or now_ns < self._profile_ready_ns:
            return  # acknowledged and lost, as users saw it
        written = self.configuration.write(key, value, named)
        if key.startswith("custom:"):
            self._profile_ready_ns = now_ns + round(self.options.profile_switch_s * 1e9)
        if written and key == "general:navdata_demo":
            self._bootstrap = False

    # time

    def step(self, now_ns: int, dt_s: float) -> None:
        """Let `dt_s` pass until `now_ns`."""
        if self._booted_ns is None:
            self._booted_ns = now_ns
        self._watch(now_ns)
        self._advance(now_ns)
        self.loops.step(dt_s, self._targets())

    def _watch(self, now_ns: int) -> None:
        silent_ns = now_ns - self._command_ns if self._command_ns is not None else None
        lost = silent_ns is None or silent_ns > COM_LOST_NS
        if lost and not self._com_lost:
            self._rule.reset()
            self._ack = False
            self._stick = Stick()
            self.streaming, self._bootstrap = False, True
        self._com_lost = lost
        if silent_ns is not None and silent_ns > self.configuration.number("general:com_watchdog") * 1e9:
            self._fly = False
        if self.faults and not self.emergency:
            self._cut_motors(now_ns)
        if self._battery.charge_frac < self.options.forced_landing_frac:
            self._fly = False

    def _advance(self, now_ns: int) -> None:
        since_s = (now_ns - self._entered_ns) / 1e9
        options = self.options
        if self.major == MajorState.LANDED:
            charged = self._battery.charge_frac >= options.low_battery_frac
            if self._fly and charged and not self.emergency:
                self._enter(MajorState.TAKE_OFF, now_ns)
        elif self.major == MajorState.LANDING:
            if self.airframe.on_floor:
                self._enter(MajorState.LANDED, now_ns)
        elif self.airborne and not self._fly:
            self._enter(MajorState.LANDING, now_ns)
        elif self.major == MajorState.TAKE_OFF:
            self.minor = int(since_s >= options.spin_up_s)
            if self.loops.height_m >= options.take_off_height_m:
                self._enter(MajorState.HOVERING, now_ns)
        elif self.airborne:
            self._follow_stick(now_ns, since_s)

    def _follow_stick(self, now_ns: int, since_s: float) -> None:
        obeyed = self._stick.flag & PCMD_PROGRESSIVE and not self.configuration.number("control:flying_mode")
        if obeyed and self.major != MajorState.FLYING:
            self._enter(MajorState.FLYING, now_ns)
        elif not obeyed and self.major == MajorState.FLYING:
            self._enter(MajorState.GO_TO_FIX, now_ns)
        elif self.major == MajorState.GO_TO_FIX and (self.loops.still or since_s > 3.0):
            self._enter(MajorState.HOVERING, now_ns)
        if self.major == MajorState.FLYING:
            self.minor = _FLYING_ALT_OUT_ZONE if self._too_high else 0
        elif self.major == MajorState.HOVERING:
            self.minor = _HOVERING_LOST_COM if self._com_lost else 0

    @property
    def _too_high(self) -> bool:
        return self.loops.height_m >= self.configuration.number("control:altitude_max") / 1000.0

    def _targets(self) -> LoopTargets:
        if not self.airborne or self.emergency:
            return LoopTargets()
        if self.major == MajorState.TAKE_OFF:
            return LoopTargets(motors=True, idle=not self.minor, climb_mps=self.options.take_off_climb_mps)
        if self.major == MajorState.LANDING:
            return LoopTargets(motors=True, climb_mps=-self.options.land_sink_mps)
        if self.major != MajorState.FLYING:
            return LoopTargets(motors=True)
        tilt_rad = self.configuration.number("control:euler_angle_max")
        climb_mps = self._stick.gaz * self.configuration.number("control:control_vz_max") / 1000.0
        return LoopTargets(
            motors=True,
            hold=False,
            roll_rad=self._stick.roll * tilt_rad,
            pitch_rad=self._stick.pitch * tilt_rad,
            yaw_rate_radps=self._stick.yaw * self.configuration.number("control:control_yaw"),
            climb_mps=min(climb_mps, 0.0) if self._too_high else climb_mps,
        )

    def _enter(self, major: MajorState, now_ns: int) -> None:
        self.major, self.minor, self._entered_ns = major, 0, now_ns

    def _cut_motors(self, now_ns: int) -> None:
        self.emergency = True
        self._fly = False
        self._enter(MajorState.DEFAULT, now_ns)

    # telemetry

    def wake(self) -> None:
        """A client asked for navdata."""
        self.streaming = True

    def navdata(self, now_ns: int) -> bytes | None:
        """The packet to send now, if a client listens and one is due."""
        if not self.streaming or now_ns < self._navdata_due_ns:
            return None
        demo = self._bootstrap or self.configuration.flag("general:navdata_demo")
        if self._navdata_due_ns < now_ns - DEMO_PERIOD_NS:
            self._navdata_due_ns = now_ns
        self._navdata_due_ns += DEMO_PERIOD_NS if demo else 0
        state = self._state(now_ns)
        if self._bootstrap:
            return bootstrap(state)
        self._navdata_sequence += 1
        mask = int(self.configuration.number("general:navdata_options"))
        tags = [tag for tag in OPTION_BYTES if mask >> tag & 1] if demo else ALL_OPTIONS
        return packet(self._report(now_ns, state), tags)

    def _state(self, now_ns: int) -> int:
        late = self._command_ns is None or now_ns - self._command_ns > COM_WATCHDOG_NS
        flags = {
            BIT_FLY: self.airborne,
            BIT_COMMAND_ACK: self._ack,
            BIT_DEMO: self._bootstrap or self.configuration.flag("general:navdata_demo"),
            BIT_BOOTSTRAP: self._bootstrap,
            BIT_COM_LOST: self._com_lost and self._command_ns is not None,
            BIT_VBAT_LOW: self._battery.charge_frac < self.options.low_battery_frac,
            BIT_COM_WATCHDOG: late,
            BIT_EMERGENCY: self.emergency,
        }
        standing = BIT_ALTITUDE | BIT_CAMERA | BITS_THREADS
        return standing | self.faults | self.warnings | sum(bit for bit, raised in flags.items() if raised)

    def _report(self, now_ns: int, state: int) -> NavdataReport:
        loops = self.loops
        height_m = loops.height_m if self.airborne else 0.0
        return NavdataReport(
            state=state,
            sequence=self._navdata_sequence,
            major=self.major,
            minor=self.minor,
            battery_percent=round(self._battery.charge_frac * 100),
            battery_mv=round(self._battery.volts * 1000),
            theta_mdeg=math.degrees(loops.pitch_rad) * 1000,
            phi_mdeg=math.degrees(loops.roll_rad) * 1000,
            psi_mdeg=math.degrees(loops.yaw_rad) * 1000,
            altitude_mm=max(0, round(height_m * 1000)),
            sonar_mm=round(loops.sonar_m * 1000),
            vx_mmps=loops.vx_mps * 1000,
            vy_mmps=loops.vy_mps * 1000,
            vz_mmps=loops.climb_mps * 1000,
            time_us=(now_ns - (self._booted_ns or now_ns)) // 1000,
        )
