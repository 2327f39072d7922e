"""The composition root: configuration -> adapters -> one TaskGroup.  The dataflow can be read here.

camera -> latest slot -> detector processes -> tick (pilot) -> pump -> vehicle
front camera -> latest slot -> code reader processes -> tick -> store
vehicle, ground -> tick; tick -> recorder, ground, observers
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial

from flightd.adapters.camera.connect import connect_camera
from flightd.adapters.ground.link import ZmqGround
from flightd.adapters.store.progress import LeftOver, ProgressFile
from flightd.adapters.vehicle.connect import connect_vehicle
from flightd.config.schema import HEIGHT_ROOM_M, Config
from flightd.core.errors import FlightdError, InputError, TransientError, UnavailableError
from flightd.core.topics import Topic
from flightd.core.types import AttitudeSetpoint, Command, Event, EventLevel, Health, Phase, Status
from flightd.grid.site import Site
from flightd.mission.assign import FrontSight
from flightd.mission.guidance import CEILING_MARGIN_M
from flightd.mission.legs import Pace
from flightd.mission.plan import FlightPlan, VisitOrder, make_plan
from flightd.mission.route import ordered_best
from flightd.mission.scanner import Scanner
from flightd.mission.sorties import check_battery
from flightd.mission.views import view_height_m
from flightd.pilot import Pilot, TickInput, TickOutput
from flightd.ports import Camera, Clock, CountsDrops, Ground, Monitor, PoseTaker, Recorder, Vehicle, Vitals
from flightd.runtime.counting import Counting
from flightd.runtime.latency import LatencyBook
from flightd.runtime.latest import Latest
from flightd.runtime.pool import Detection, DetectorPool, Detectors
from flightd.runtime.pump import SetpointPump
from flightd.runtime.ring import FrameTicket
from flightd.runtime.supervise import restarted
from flightd.vision.detector import Detector

TICK_S = 0.02
_FIRST_HEARD_S = 2.0
_STATUS_NS = 100_000_000
_OVER = {Phase.DONE, Phase.ABORTED, Phase.PILOT}
_SILENT_NS = 30_000_000_000
"""A vehicle that nobody heard for so long after the mission's end is not waited for."""
_LINGER_NS = 1_500_000_000
"""Time after the mission's end in which the vehicle is still watched (disarming)."""


@dataclass(slots=True)
class FlightResult:
    """What the daemon itself knows of a flight when it is over."""

    phase: Phase
    reason: str
    visited: tuple[str, ...]
    planned: int
    frames: int
    frames_dropped: int
    latency_ms: dict[str, float]
    setpoint_interval_ms: dict[str, float] = field(default_factory=dict)


def plan_of(config: Config, site: Site) -> FlightPlan:
    """The flight plan that the configuration asks for, from the home pad and back."""
    return _plan_on(config, site.between(*flown_between_m(config, site)))


def _plan_on(config: Config, site: Site) -> FlightPlan:
    """The plan on a site that has only the keep-outs of the heights flown."""
    mission = config.mission
    visits: Sequence[str] = mission.nodes or site.serpentine_route()
    start, policy, yaw_rad = (
        start_of(config, site),
        config.heading_policy(),
        math.radians(mission.start_yaw_deg),
    )
    if mission.order is VisitOrder.BEST:
        visits = ordered_best(
            site, visits, (start, site.home.node), policy, Pace.of(mission.params()), yaw_rad
        )
    return make_plan(site, visits, start, site.home.node, policy, yaw_rad)


def start_of(config: Config, site: Site) -> str:
    """The node of the pad on which the drone stands at first.  InputError when the site lacks that pad."""
    wanted = config.mission.pad
    pad = site.home if wanted is None else next((pad for pad in site.pads if pad.id == wanted), None)
    if pad is None:
        names = ", ".join(pad.id for pad in site.pads)
        raise InputError(f"mission.pad {wanted!r}: site {site.name} has the pads {names}")
    return pad.node


def pilot_of(config: Config, site: Site) -> Pilot:
    """A fresh pilot for one flight.  Raises InputError where map and configuration contradict each other."""
    if config.mission.height_m > site.ceiling_m - CEILING_MARGIN_M:
        raise InputError(
            f"mission.height_m {config.mission.height_m} is not {CEILING_MARGIN_M} m below the ceiling of"
            f" {site.name} ({site.ceiling_m} m)"
        )
    flown = site.between(*flown_between_m(config, site))
    plan, policy = _plan_on(config, flown), config.heading_policy()
    params = config.pilot_params(site)
    scanner = scanner_of(config, site)
    check_battery(flown, plan, policy, params.mission, scanner)
    return Pilot(flown, plan, policy, params, scanner)


def scanner_of(config: Config, site: Site) -> Scanner | None:
    """What counts the shelves; None without a front camera or locations."""
    front = config.front_camera
    if not front.is_fitted or not site.locations:
        return None
    highest_m = site.ceiling_m - CEILING_MARGIN_M
    if config.scan.min_height_m > highest_m:
        raise InputError(
            f"scan.min_height_m {config.scan.min_height_m} is not {CEILING_MARGIN_M} m below the ceiling of"
            f" {site.name} ({site.ceiling_m} m)"
        )
    return Scanner(site, FrontSight(front.lens(), front.mount()), config.scan_params(highest_m))


def flown_between_m(config: Config, site: Site) -> tuple[float, float]:
    """The heights that are flown between: with a scan, those of its views too."""
    low_m, high_m = config.mission.flown_between_m()
    if not config.front_camera.is_fitted or not site.locations:
        return low_m, high_m
    scan, mount = config.scan_params(site.ceiling_m - CEILING_MARGIN_M), config.front_camera.mount()
    views_m = [
        view_height_m(place.height_m, abs(place.y_m - site.nodes[place.node].y_m), mount, scan)
        for place in site.locations.values()
    ]
    return min(low_m, min(views_m) - HEIGHT_ROOM_M), max(high_m, max(views_m) + HEIGHT_ROOM_M)


def profile_of(config: Config, site: Site) -> str:
    """The colour profile that is configured, or else that of the site's lines."""
    return config.vision.profile or site.line_colour.value


def detector_pool(config: Config, site: Site, clock: Clock) -> DetectorPool:
    """Detector processes after the configuration; the colour profile is read here, so that a wrong one
    is found before anything flies."""
    make = detector_of(config, site)
    make()
    return DetectorPool(make, config.vision.workers, config.vision.timeout_s, clock)


def detector_of(config: Config, site: Site) -> Callable[[], Detector]:
    """What makes the detector that configuration and map ask for (in its own process, where it flies)."""
    camera, vision = config.camera, config.vision
    lens = camera.lens() if camera.lens().is_distorted else None
    profile = profile_of(config, site)
    return partial(Detector, vision.method, profile, lens, markers=site.marker_set)


def ground_link(
    config: Config, site: Site, clock: Clock, counting: Counting | None = None
) -> ZmqGround | None:
    """The link to ground stations, if the configuration wants one."""
    if not config.ground.listen:
        return None
    return ZmqGround(config.ground, site, clock, counting.places if counting is not None else None)


class Daemon:
    """One flight of one vehicle.  `fly` runs until the mission is over."""

    def __init__(
        self,
        config: Config,
        site: Site,
        clock: Clock,
        detectors: Detectors,
        recorder: Recorder | None = None,
        observers: Sequence[Callable[[Status], None]] = (),
        ground: Ground | None = None,
        monitors: Sequence[Monitor] = (),
        progress: ProgressFile | None = None,
        counting: Counting | None = None,
    ) -> None:
        self._config = config
        self._clock = clock
        self._detectors = detectors
        self._recorder = recorder
        self._observers = observers
        self._ground = ground
        self._monitors = monitors
        self._progress = progress
        self._pilot = pilot_of(config, site)
        self._frames: Latest[FrameTicket] = Latest()
        self._vehicle: Vehicle = connect_vehicle(config.vehicle, clock, config.control.limits())
        self._pose_taker: PoseTaker | None = None
        if config.vehicle.shares_pose and isinstance(self._vehicle, PoseTaker):
            self._pose_taker = self._vehicle
        pad = site.nodes[site.home.node]
        self._pad_m = (pad.x_m, pad.y_m) if config.vehicle.landing_target else None
        self._camera = connect_camera(config.camera, clock, self._frames.put, self._trouble, self._vehicle)
        self._counting = counting if self._pilot.scans else None
        self._front: Camera | None = None
        if self._counting is not None:
            self._front = connect_camera(
                config.front_camera, clock, self._counting.frame, self._trouble, self._vehicle
            )
        self._pump = SetpointPump(self._vehicle, clock, self._sent, TICK_S)
        self._latency = LatencyBook()
        self._detections: list[Detection] = []
        self._commands: list[Command] = []
        self._lost = 0
        self._newest_ns = -1
        self._picture_ns = 0
        self._status_ns = 0
        self._last_phase: Phase | None = None
        self._rate: list[int] = []
        self._late_s: list[float] = []
        self._flew = False

    def command(self, command: Command) -> None:
        """Hand an operator's order to the next tick."""
        self._commands.append(command)

    async def fly(self) -> FlightResult:
        """Run everything until the mission is over; cancelled, the vehicle is handed back."""
        parts = {
            "vehicle": self._vehicle.run(),
            "camera": restarted(self._look, self.failed),
            "pump": self._pump.run(),
            **{f"detect-{i}": self._detect() for i in range(self._config.vision.workers)},
        }
        if self._recorder is not None:
            parts["recorder"] = restarted(self._recorder.run, self.failed)
        if self._ground is not None:
            parts["ground"] = restarted(self._ground.run, self.failed)
        if self._progress is not None:
            parts["progress"] = restarted(self._progress.run, self.failed)
        if self._counting is not None and self._front is not None:
            parts["front-camera"] = restarted(self._front.run, self.failed)
            parts |= self._counting.begin(self._pilot.places, self._trouble)
        try:
            async with asyncio.TaskGroup() as tasks:
                services = [tasks.create_task(part, name=name) for name, part in parts.items()]
                output = await self._tick_until_over()
                for service in services:
                    service.cancel()
        except ExceptionGroup as group:
            raise _first(group) from group
        return self._result(output)

    async def _look(self) -> None:
        """The camera's run.  One that cannot be had ends the daemon, but not in the air: a vehicle that flies
        needs the daemon more than the daemon its camera."""
        try:
            await self._camera.run()
        except UnavailableError as err:
            give_up_ns = self._clock.now_ns() + round(_FIRST_HEARD_S * 1e9)
            while (state := self._vehicle.state()) is None and self._clock.now_ns() < give_up_ns:  # noqa: ASYNC110
                await asyncio.sleep(TICK_S)
            self._flew |= state is not None and state.armed
            if not self._flew:
                raise
            raise TransientError(str(err)) from err

    def failed(self, err: TransientError) -> None:
        """A part that restarts has failed: tell people."""
        self._trouble(str(err))

    def _trouble(self, text: str) -> None:
        """Something that people should know."""
        event = Event(self._clock.now_ns(), EventLevel.ERROR, "failure", text)
        self._vehicle.notify(event)
        if self._recorder is not None:
            self._recorder.record(Topic.EVENT, event.stamp_ns, event)
        self._announce(event)

    def _announce(self, event: Event) -> None:
        """Tell everybody but the vehicle and the log of an event."""
        if self._ground is not None:
            self._ground.event(event)
        for monitor in self._monitors:
            monitor.event(event)

    async def _detect(self) -> None:
        """One frame after the other, as many of these loops as there are detector processes."""
        period_ns = round(1e9 / fps) if (fps := self._config.recorder.picture_fps) else 0
        while True:
            ticket = await self._frames.get()
            keep = (
                bool(period_ns)
                and self._recorder is not None
                and ticket.stamp_ns - self._picture_ns >= period_ns
            )
            if keep:
                self._picture_ns = ticket.stamp_ns
            show = self._ground is not None and self._ground.picture_due(ticket.stamp_ns)
            detection = await self._detectors.detect(ticket, keep or show)
            if detection is None:
                self._lost += 1
                continue
            if detection.jpeg is not None and keep and self._recorder is not None:
                self._recorder.image(Topic.FRAME, ticket.stamp_ns, ticket.seq, detection.jpeg)
            if detection.jpeg is not None and show and self._ground is not None:
                self._ground.picture(ticket.seq, ticket.stamp_ns, detection.jpeg)
            self._detections.append(detection)

    async def _tick_until_over(self) -> TickOutput:
        """The control tick, at a fixed rate."""
        clock = self._clock
        due_ns = clock.now_ns()
        over_ns: int | None = None
        while True:
            due_ns += round(TICK_S * 1e9)
            await asyncio.sleep((due_ns - clock.now_ns()) * 1e-9)
            now_ns = clock.now_ns()
            self._late_s.append((now_ns - due_ns) * 1e-9)
            due_ns = max(due_ns, now_ns - round(TICK_S * 1e9))  # late: leave ticks out, never bunch them
            output = self._tick(now_ns)
            if output.phase not in _OVER:
                continue
            over_ns = over_ns or now_ns
            state = self._vehicle.state()
            silent = state is not None and now_ns - state.attitude.stamp_ns > _SILENT_NS
            down = state is None or not state.armed or silent
            if down and now_ns - over_ns > _LINGER_NS:
                return output

    def _tick(self, now_ns: int) -> TickOutput:
        detections = self._fresh()
        commands, self._commands = self._commands, []
        if self._ground is not None:
            commands += self._ground.take_commands()
        tick = TickInput(
            now_ns,
            tuple(d.lines for d in detections),
            self._vehicle.state(),
            tuple(self._vehicle.attitudes()),
            tuple(commands),
            self._ground.silent_s(now_ns) if self._ground is not None else 0.0,
            self._counting.take() if self._counting is not None else (),
            self._counting.take_counted() if self._counting is not None else (),
            self._health(now_ns),
        )
        for detection in detections:
            self._latency.taken(detection, now_ns)
        output = self._pilot.step(tick)
        self._vehicle.demand(output.demand)
        self._pump.set(output.setpoint)
        if self._pose_taker is not None and output.pose is not None:
            self._pose_taker.share_pose(output.pose, self._pad_m)
        if self._counting is not None:
            self._counting.keep(output)
        if output.setpoint is None:
            self._latency.forget()
        if self._progress is not None:
            self._progress.put(LeftOver(self._pilot.mission.remaining, *self._pilot.mission.stand))
        for event in output.events:
            self._vehicle.notify(event)
            self._announce(event)
        self._tell(tick, output)
        return output

    def _health(self, now_ns: int) -> Health:
        recorder = self._recorder
        return Health(
            self._latency.recent_p99_s(now_ns),
            self._detectors.replaced,
            recorder.restarts if recorder is not None else 0,
            recorder.error if recorder is not None else "",
        )

    def _fresh(self) -> list[Detection]:
        """Detections since the last tick in the order of their frames; one overtaken is dropped."""
        arrived, self._detections = sorted(self._detections, key=lambda d: d.ticket.stamp_ns), []
        fresh = [d for d in arrived if d.ticket.stamp_ns > self._newest_ns]
        self._lost += len(arrived) - len(fresh)
        if fresh:
            self._newest_ns = fresh[-1].ticket.stamp_ns
        return fresh

    def _sent(self, setpoint: AttitudeSetpoint, now_ns: int) -> None:
        self._latency.sent(now_ns)
        if self._recorder is not None:
            self._recorder.record(Topic.SETPOINT, setpoint.stamp_ns, setpoint)

    def _tell(self, tick: TickInput, output: TickOutput) -> None:
        """Record what came in and went out; status ten times a second and at each change of phase."""
        now_ns, recorder = tick.now_ns, self._recorder
        if recorder is not None:
            _record(recorder, tick, output)
        self._rate = [stamp for stamp in self._rate if now_ns - stamp < 10**9]
        self._rate.extend([now_ns] * len(tick.lines))
        if now_ns - self._status_ns < _STATUS_NS and output.phase is self._last_phase:
            return
        self._status_ns, self._last_phase = now_ns, output.phase
        status = self._status(tick, output)
        if recorder is not None:
            recorder.record(Topic.STATUS, now_ns, status)
        if self._ground is not None:
            self._ground.tell(status, tick, output)
        vitals = self._vitals(status, tick)
        for monitor in self._monitors:
            monitor.tell(vitals)
        for observer in self._observers:
            observer(status)

    def _vitals(self, status: Status, tick: TickInput) -> Vitals:
        late_s, self._late_s = tuple(self._late_s), []
        dropped = {"camera": self._frames.dropped, "detection": self._lost}
        restarts = {"detector": self._detectors.replaced}
        if isinstance(self._vehicle, CountsDrops):
            dropped["vehicle"] = self._vehicle.dropped
        if self._recorder is not None:
            dropped["recorder"] = self._recorder.dropped
            restarts["recorder"] = self._recorder.restarts
        return Vitals(
            status=status,
            vehicle=tick.vehicle,
            ground_silent_s=tick.ground_silent_s,
            tick_late_s=late_s,
            latencies_ms=self._latency.drain(),
            dropped=dropped,
            restarts=restarts,
            repeated_level=self._pump.stale,
        )

    def _status(self, tick: TickInput, output: TickOutput) -> Status:
        vehicle = tick.vehicle
        return Status(
            stamp_ns=tick.now_ns,
            phase=output.phase,
            reason=output.reason,
            node=output.pose.node if output.pose else "",
            goal=output.goal,
            nodes_done=output.visited,
            nodes_planned=output.planned,
            battery_frac=vehicle.battery_frac if vehicle else 0.0,
            height_m=output.pose.height_m if output.pose else 0.0,
            frames=self._camera.frames,
            frames_dropped=self._frames.dropped + self._lost,
            fps=float(len(self._rate)),
            latency_ms=dict(self._latency.newest),
        )

    def _result(self, output: TickOutput) -> FlightResult:
        intervals = self._pump.intervals_ms
        quantile = {
            name: round(intervals.quantile(share), 2)
            for name, share in (("p50", 0.5), ("p99", 0.99), ("max", 1.0))
        }
        return FlightResult(
            phase=output.phase,
            reason=output.reason,
            visited=tuple(self._pilot.mission.visited),
            planned=output.planned,
            frames=self._camera.frames,
            frames_dropped=self._frames.dropped + self._lost,
            latency_ms=self._latency.quantiles_ms(),
            setpoint_interval_ms=quantile,
        )


def _record(recorder: Recorder, tick: TickInput, output: TickOutput) -> None:
    """All that the pilot was given and answered, for the replay, and its parts for people."""
    now_ns = tick.now_ns
    recorder.record(Topic.TICK, now_ns, tick)
    recorder.record(Topic.DECISION, now_ns, output)
    for lines in tick.lines:
        recorder.record(Topic.LINES, lines.stamp_ns, lines)
    for codes in tick.codes:
        recorder.record(Topic.CODES, codes.stamp_ns, codes)
    for finding in output.findings:
        recorder.record(Topic.FINDING, finding.stamp_ns, finding)
    if tick.vehicle is not None:
        recorder.record(Topic.VEHICLE, now_ns, tick.vehicle)
    if output.pose is not None:
        recorder.record(Topic.POSE, now_ns, output.pose)
    for command in tick.commands:
        recorder.record(Topic.COMMAND, now_ns, command)
    for event in output.events:
        recorder.record(Topic.EVENT, event.stamp_ns, event)


def _first(group: ExceptionGroup[Exception]) -> Exception:
    """The error that a person can act on, out of a group; the first one if there is none."""
    leaves = list(_leaves(group))
    return next((err for err in leaves if isinstance(err, FlightdError)), leaves[0])


def _leaves(group: ExceptionGroup[Exception]) -> Iterator[Exception]:
    for err in group.exceptions:
        if isinstance(err, ExceptionGroup):
            yield from _leaves(err)
        else:
            yield err
