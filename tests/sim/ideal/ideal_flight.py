"""A whole flight without pixels, sockets or event loop: pilot, airframe and ideal sight in one loop."""

from __future__ import annotations

import math
import random
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

from flightd.app.absent_parts import NO_LAMP
from flightd.app.build import assemble, pilot_of
from flightd.app.flight import Flight
from flightd.app.publishers import TelemetryPublishers
from flightd.app.tick import Tick
from flightd.config.schema import Config
from flightd.core.flight_order import FlightOrder
from flightd.core.geometry import angle_rates, wrap_pi
from flightd.core.scanning import CodeSet, CountedPlace
from flightd.core.snapshot import Snapshot
from flightd.core.tick import TickOutput
from flightd.core.types import (
    HEALTHY,
    Attitude,
    AttitudeSetpoint,
    Command,
    Demand,
    Event,
    Health,
    LandedState,
    LineSet,
    Phase,
    PictureCheck,
    VehicleState,
)
from flightd.ports import Lamp
from flightd.sim.autopilot.climb_loop import ClimbLoop
from flightd.sim.leap import LeapInFlight
from flightd.sim.plant.airframe import Airframe, AirframeCommand, AirframeParams
from flightd.sim.plant.charge_pads import ChargePads, PadService
from flightd.sim.plant.kinematics import Kinematics
from flightd.sim.plant.wind import WindParams
from flightd.sim.sensors.battery_monitor import MonitorParams
from flightd.sim.sensors.instruments import SensorParams, Sensors
from flightd.sim.sensors.optics import SimCamera
from flightd.sim.sensors.vibration import Shaken
from flightd.sim.unknowns import Unknowns
from flightd.site.site import Site
from tests.sim.ideal.ideal_front import IdealFront
from tests.sim.ideal.ideal_link import IdealLink
from tests.sim.ideal.ideal_ports import (
    HeldSetpoint,
    IdealCount,
    IdealGround,
    IdealInterlock,
    IdealRecorder,
    IdealVehicle,
    IdealVision,
)
from tests.sim.ideal.ideal_sight import EyeErrors, EyeView, IdealEye

STEP_NS = 5_000_000
TICK_NS = 20_000_000
FRAME_NS = 50_000_000
"""As often as the small camera of the flights by pixels."""
ATTITUDE_NS = 20_000_000
"""As often as an adapter asks an autopilot for it."""
FRONT_NS = 250_000_000
READING_NS = 150_000_000
UNHEARD_NS = 3_000_000_000
"""Without a heartbeat for so long an adapter no longer knows whose the vehicle is."""


@dataclass
class Faults:
    """What is wrong just now; a test changes it in flight."""

    blind: bool = False
    frozen: bool = False
    blank: bool = False
    bare: bool = False
    late_ns: int = 0
    delay_ns: int = 0
    """The camera's delay is another one by so much: frames come so much later, and are stamped so."""
    stall_ns: int = 0
    """No tick for so long; the setpoint before holds, what comes meanwhile waits."""
    silent: bool = False
    untold: bool = False
    """The adapter fails when it is asked for the vehicle's state."""
    heartless: bool = False
    rangeless: bool = False
    climbless: bool = False
    misread: Callable[[float], float] = lambda height_m: height_m
    """What the range finder makes of the height (m)."""
    climb_by_range: bool = False
    """The climb rate that is told is the slope of the range finder's height."""
    yaw_rad: float = 0.0
    height_m: float = 0.0
    battery: float | None = None
    cell_v: float | None = None
    """What each of three cells has; None: the cells are not told."""
    stamps_refused: int = 0
    clock_error_s: float = 0.0
    landing_unreported: bool = False
    in_failsafe: bool = False
    endless: bool = False
    health: Health = HEALTHY


@dataclass
class Flown:
    """Everything that happened, for a test to judge."""

    phase: Phase = Phase.PREFLIGHT
    reason: str = ""
    visited: list[str] = field(default_factory=list)
    truth: list[tuple[Phase, Kinematics]] = field(default_factory=list)
    outputs: list[TickOutput] = field(default_factory=list)
    events: list[Event] = field(default_factory=list)

    def on_lines(self) -> list[Kinematics]:
        return [k for phase, k in self.truth if phase in {Phase.FOLLOW, Phase.HOVER, Phase.TURN}]


class IdealFlight:
    """`fly` runs until the mission is over.  Sensors, wind and sight are those of the simulator."""

    def __init__(
        self,
        site: Site,
        config: Config,
        *,
        visits: tuple[str, ...] = (),
        seed: int = 1,
        wind: WindParams | None = None,
        errors: EyeErrors | None = None,
        delay_ns: int = 68_000_000,
        airframe: AirframeParams | None = None,
        pads: PadService | None = None,
        front: IdealFront | None = None,
        world: Site | None = None,
        carried_to: str = "",
        observers: Sequence[Callable[[Snapshot], None]] = (),
        unknowns: Unknowns | None = None,
    ) -> None:
        """`unknowns` is what the configuration does not know of drone and link, None: nothing."""
        self._observers = observers
        if unknowns is None:  # with a link there are clocks to compare first
            config = config.with_values(mission={"autostart_countdown_s": 0.0})  # it has tests of its own
        self._config, self._site = config, site
        self.pilot = pilot_of(config, site, FlightOrder(visits, autostart=config.mission.autostart))
        self._front = front
        self._looked: deque[tuple[int, CodeSet]] = deque()
        self._exposed: deque[Kinematics] = deque()
        self._front_ns = 0
        self.frame_ns = FRAME_NS
        world = world or site
        x_m, y_m = world.pad_centre(world.home)
        if carried_to:
            x_m, y_m = site.nodes[carried_to].x_m, site.nodes[carried_to].y_m
        self._armed = False
        self._now_ns = 1_000_000_000_000
        unknown = unknowns or Unknowns()
        configured = airframe or AirframeParams()
        frame = unknown.airframe(configured)
        wash = unknown.wash(world, seed)
        self.seed = seed
        self.airframe = Airframe(frame, wind=wind, seed=seed, x_m=x_m, y_m=y_m, wash=wash)
        battery = MonitorParams(configured.battery_capacity_ah)
        self.sensors = Sensors(unknown.sensors(SensorParams(battery=battery)), seed)
        camera = unknown.camera(SimCamera(config.camera.lens(), config.camera.mount()))
        self._eye = IdealEye(world, camera.lens, camera.mount, errors, seed)
        self._shaken = Shaken(unknown.shake_rad, seed)
        self._camera_off_ns = round(unknown.camera_delay_s * 1e9)
        self._camera_leap = LeapInFlight(unknown.camera_leap)
        self._jitter_s, self._jitter = unknown.camera_jitter_s, random.Random(f"jitter {seed}")
        self._climb = ClimbLoop()
        self._delay_ns = delay_ns
        self.link: IdealLink | None = None
        """Between autopilot and daemon; None: telemetry and setpoints are there at once."""
        if unknowns is not None:
            self.link = IdealLink(unknowns, self.airframe, self.sensors, seed, self._now_ns)
        self._yaw_target = 0.0
        self.in_control = True
        self.faults = Faults()
        self._told: VehicleState | None = None
        self._beat_ns = self._now_ns
        self._range = (0.1, self._now_ns)
        self._last_seen: LineSet | None = None
        self.ground_silent_s = 0.0
        self.aisle_closed = True
        self.lamp: Lamp = NO_LAMP
        self.detected_as: Callable[[LineSet, EyeView], LineSet] | None = None
        """What a detector makes of what is to be seen in a frame."""
        self.commands: list[Command] = []
        """Orders that the next tick takes."""
        self._charge_pads = ChargePads(site, self.airframe, pads) if pads else None
        self.counted: tuple[CountedPlace, ...] = ()
        self.on_record: Callable[[str, int, object], None] = lambda _topic, _stamp_ns, _message: None
        self.on_tick: Callable[[Phase, int], None] = lambda _phase, _now_ns: None

    def now_ns(self) -> int:
        """`ports.Clock`."""
        return self._now_ns

    def _composed(self, vehicle: IdealVehicle, vision: IdealVision, setpoints: HeldSetpoint) -> Flight:
        """The daemon's own tick flies it, with these behind its ports."""
        recorder = IdealRecorder(lambda: self.faults.health, self.on_record)
        ground = IdealGround(self._take_commands, lambda: self.ground_silent_s)
        return assemble(
            self._config,
            self._site,
            self.pilot,
            vehicle=vehicle,
            setpoints=setpoints,
            vision=vision,
            publishers=TelemetryPublishers(self, vehicle, recorder, ground, observers=self._observers),
            clock=self,
            recorder=recorder,
            ground=ground,
            counting=IdealCount(self._codes, self._take_counted),
            interlock=IdealInterlock(lambda: self.aisle_closed),
            lamp=self.lamp,
        )

    def fly(self, limit_s: float = 600.0) -> Flown:
        flown = Flown()
        vehicle = IdealVehicle(self._state, self._obey)
        vision, setpoints = IdealVision(lambda: self.faults.health), HeldSetpoint()
        tick = Tick(self._composed(vehicle, vision, setpoints))
        frame_ns = tick_ns = self._now_ns
        seq = 0
        end_ns = self._now_ns + round(limit_s * 1e9)
        self.sensors.update(STEP_NS * 1e-9, self.airframe)
        while self._now_ns < end_ns:
            self._now_ns += STEP_NS
            if self.link is None:
                self._step(setpoints.newest)
                if self._now_ns % ATTITUDE_NS == 0 and not self.faults.silent:
                    vehicle.samples.append(self._attitude())
            else:
                self.link.command(self._now_ns, setpoints.newest)
                self._step(self.link.obeyed if setpoints.newest is not None else None)
                self.link.tell(self._now_ns, armed=self._armed)
                vehicle.samples += self.link.attitudes()
            if self._now_ns >= frame_ns:
                frame_ns += self.frame_ns
                seq += 1
                if not self.faults.blind:
                    late_ns = self.faults.late_ns + round(self._jitter.random() * self._jitter_s * 1e9)
                    due_ns = self._now_ns + self._delay_ns + self._off_ns + late_ns
                    vision.put(due_ns, self._see(seq))
            self._photograph()
            if self._now_ns >= tick_ns:
                tick_ns += TICK_NS + self.faults.stall_ns
                self.faults.stall_ns = 0
                if self._charge_pads is not None:
                    self._charge_pads.look(self._now_ns)
                output = tick.run(self._now_ns)
                self.on_tick(output.phase, self._now_ns)
                flown.outputs.append(output)
                flown.events.extend(output.events)
                flown.truth.append((output.phase, self.airframe.kinematics(self._now_ns)))
                if output.phase in {Phase.DONE, Phase.ABORTED, Phase.PILOT}:
                    break
        flown.phase, flown.reason = flown.outputs[-1].phase, flown.outputs[-1].reason
        flown.visited = list(self.pilot.mission.visited)
        return flown

    def _photograph(self) -> None:
        """The front camera's picture; its reader answers a while later."""
        if self._front is None:
            return
        if self._now_ns >= self._front_ns:
            self._front_ns = self._now_ns + FRONT_NS
            self._exposed.append(self.airframe.kinematics(self._now_ns))
        if self._exposed and self._exposed[0].stamp_ns + 60_000_000 <= self._now_ns:
            then = self._exposed.popleft()
            places = self.pilot.places(then.stamp_ns)
            if places:
                seen = self._front.see(then, places, then.stamp_ns)
                self._looked.append((self._now_ns + READING_NS, seen))

    def _take_commands(self) -> list[Command]:
        orders, self.commands = self.commands, []
        return orders

    def _take_counted(self) -> tuple[CountedPlace, ...]:
        counted, self.counted = self.counted, ()
        return counted

    def _codes(self) -> tuple[CodeSet, ...]:
        sets = []
        while self._looked and self._looked[0][0] <= self._now_ns:
            sets.append(self._looked.popleft()[1])
        return tuple(sets)

    def _obey(self, demand: Demand) -> None:
        if demand is Demand.FLY and not self._armed:
            self._armed = True
            self._yaw_target = self.airframe.yaw_rad
        elif demand is Demand.DISARM and not self.faults.endless:
            self._armed = False

    def _step(self, setpoint: AttitudeSetpoint | None) -> None:
        dt_s = STEP_NS * 1e-9
        wanted = setpoint or AttitudeSetpoint(self._now_ns)
        flying = (
            self._armed and (setpoint is not None) and (wanted.climb_mps > 0 or not self.airframe.on_floor)
        )
        self._yaw_target += wanted.yaw_rate_radps * dt_s
        collective = 0.05
        if not flying:
            self._climb.reset(self.sensors.height_m)
        else:
            collective = self._climb.step(
                dt_s,
                wanted.climb_mps,
                height_m=self.sensors.height_m,
                speed_mps=self.sensors.climb_mps,
                accel_mps2=self.sensors.accel_mps2,
                tilt_cos=self.airframe.tilt_cos,
            )
        self.airframe.step(
            dt_s,
            AirframeCommand(
                self._armed,
                wanted.roll_rad - self.sensors.roll_error_rad,
                wanted.pitch_rad - self.sensors.pitch_error_rad,
                self._yaw_target,
                wanted.yaw_rate_radps,
                collective,
            ),
        )
        self.sensors.update(dt_s, self.airframe)

    @property
    def _off_ns(self) -> int:
        leapt_ns = self._camera_leap.ns(self._now_ns, self.airframe.height_m)
        return self._camera_off_ns + self.faults.delay_ns + leapt_ns

    def _see(self, seq: int) -> LineSet:
        faults = self.faults
        pose = self._shaken(self.airframe.kinematics(self._now_ns))
        seen = self._eye.see(pose, seq, self._now_ns + self._off_ns)
        if self.detected_as is not None:
            seen = self.detected_as(seen, self._eye.view(pose))
        seen = replace(seen, picture=PictureCheck(seq, 120.0, 40.0))
        if faults.bare:
            seen = replace(seen, lines=())
        if faults.blank:
            seen = replace(seen, lines=(), picture=PictureCheck(0, 0.0, 0.0))
        if faults.frozen and self._last_seen is not None:
            seen = replace(self._last_seen, frame_seq=seq, stamp_ns=self._now_ns)
        self._last_seen = seen
        return seen

    def _attitude(self) -> Attitude:
        s = self.sensors
        body_radps = s.body_rates_radps(self.airframe.kinematics(self._now_ns))
        felt_radps = angle_rates(s.roll_rad, s.pitch_rad, body_radps)
        told_rad = wrap_pi(s.yaw_rad + self.faults.yaw_rad)
        return Attitude(self._now_ns, s.roll_rad, s.pitch_rad, told_rad, *felt_radps)

    def _state(self) -> VehicleState | None:
        if self.faults.untold:
            raise ValueError("what no adapter ever raises")
        if self.link is not None:
            return self.link.state(self._now_ns, in_control=lambda armed: armed and self.in_control)
        faults = self.faults
        unheard = self._now_ns - self._beat_ns > UNHEARD_NS
        in_control = self._armed and self.in_control and not unheard
        if faults.silent and self._told is not None:
            return replace(self._told, in_control=in_control, unheard=unheard)
        on_floor = self.airframe.on_floor
        climb_mps = math.nan if faults.climbless else self.sensors.climb_mps
        if not faults.rangeless:
            measured_m = faults.misread(self.airframe.height_m + faults.height_m)
            last_m, last_ns = self._range
            if faults.climb_by_range:
                climb_mps = (measured_m - last_m) / max((self._now_ns - last_ns) * 1e-9, 0.005)
            self._range = (round(measured_m, 2), self._now_ns)
        if not faults.heartless:
            self._beat_ns = self._now_ns
        standing = on_floor and not faults.landing_unreported
        battery = self.sensors.battery.charge_frac if faults.battery is None else faults.battery
        self._told = VehicleState(
            attitude=self._attitude(),
            height_m=math.nan if self._now_ns - self._range[1] > 10**9 else self._range[0],
            height_stamp_ns=self._range[1],
            climb_mps=climb_mps,
            mode="GUIDED_NOGPS",
            in_control=in_control,
            armed=self._armed,
            landed=LandedState.ON_GROUND if standing else LandedState.IN_AIR,
            battery_frac=battery,
            battery_v=12.0 if faults.cell_v is None else 3 * faults.cell_v,
            battery_cells=0 if faults.cell_v is None else 3,
            heartbeat_ns=self._beat_ns,
            stamps_refused=faults.stamps_refused,
            clock_error_s=faults.clock_error_s,
            in_failsafe=faults.in_failsafe,
            unheard=unheard,
        )
        return self._told


def rms_off_line(flown: Flown, site: Site) -> float:
    """Cross-track error of the flight between take-off and landing, root mean square, metres."""
    squares = [
        min(_to_segment(k.x_m, k.y_m, site, edge.a, edge.b) for edge in site.edges) ** 2
        for k in flown.on_lines()
    ]
    return math.sqrt(math.fsum(squares) / max(len(squares), 1))


def _to_segment(x: float, y: float, site: Site, a: str, b: str) -> float:
    p, q = site.nodes[a], site.nodes[b]
    dx, dy = q.x_m - p.x_m, q.y_m - p.y_m
    share = min(max(((x - p.x_m) * dx + (y - p.y_m) * dy) / (dx * dx + dy * dy), 0.0), 1.0)
    return math.hypot(x - p.x_m - share * dx, y - p.y_m - share * dy)
