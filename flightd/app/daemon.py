"""The composition root: configuration -> adapters -> one TaskGroup.  The dataflow can be read here.

camera -> latest slot -> detector processes -> tick (pilot) -> pump -> vehicle
front camera -> latest slot -> code reader processes -> tick -> store
vehicle, ground -> tick; tick -> recorder, ground, observers
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field

from flightd.adapters.camera.connect import connect_camera
from flightd.adapters.store.progress import LeftOver, ProgressFile
from flightd.adapters.vehicle.connect import connect_vehicle
from flightd.app.build import pilot_of
from flightd.app.counting.count import Counting
from flightd.app.detection.detector_pool import Detectors
from flightd.app.detection.latency import LatencyBook
from flightd.app.detection.pipeline import DetectionPipeline
from flightd.app.publishers import TelemetryPublishers
from flightd.app.setpoint_pump import SetpointPump
from flightd.config.schema import Config
from flightd.core.errors import FlightdError, TransientError, UnavailableError
from flightd.core.topics import Topic
from flightd.core.types import AttitudeSetpoint, Command, CommandKind, Health, Phase, Status
from flightd.pilot import TICK_S, TickInput, TickOutput
from flightd.ports import Camera, Clock, CountsDrops, Ground, Monitor, PoseTaker, Recorder, Vehicle, Vitals
from flightd.runtime.supervisor import restarted
from flightd.site.site import Site

_FIRST_HEARD_S = 2.0
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
        ailing: FlightdError | None = None,
    ) -> None:
        """`ailing` is what the daemon should not fly with: on the ground it ends with that; a vehicle that it
        finds flying is looked after all the same."""
        self._config = config
        self._clock = clock
        self._detectors = detectors
        self._recorder = recorder
        self._ground = ground
        self._progress = progress
        self._pilot = pilot_of(config, site)
        self._sight = DetectionPipeline(detectors, recorder, ground, config.recorder.picture_fps)
        self._vehicle: Vehicle = connect_vehicle(config.vehicle, clock, config.control)
        self._audience = TelemetryPublishers(self._vehicle, recorder, ground, monitors, observers)
        self._pose_taker: PoseTaker | None = None
        if config.vehicle.shares_pose and isinstance(self._vehicle, PoseTaker):
            self._pose_taker = self._vehicle
        pad = site.nodes[site.home.node]
        self._pad_m = (pad.x_m, pad.y_m) if config.vehicle.landing_target else None
        self._camera = connect_camera(
            config.camera, clock, self._sight.frames.put, self._trouble, self._vehicle
        )
        self._counting = counting if self._pilot.scans else None
        self._front: Camera | None = None
        if self._counting is not None:
            self._front = connect_camera(
                config.front_camera, clock, self._counting.frame, self._trouble, self._vehicle
            )
        self._pump = SetpointPump(self._vehicle, clock, self._sent, TICK_S)
        self._latency = LatencyBook()
        self._commands: list[Command] = []
        self._late_s: list[float] = []
        self._flew = False
        self._ailing = ailing

    def command(self, command: Command) -> None:
        """Hand an operator's order to the next tick."""
        self._commands.append(command)

    async def fly(self) -> FlightResult:
        """Run everything until the mission is over; cancelled, the vehicle is handed back."""
        parts = {
            "vehicle": self._vehicle.run(),
            "camera": restarted(self._look, self.failed),
            "pump": self._pump.run(),
            **{f"detect-{i}": self._sight.run() for i in range(self._config.vision.workers)},
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
        if self._ailing is not None:
            parts["ailing"] = self._fly_only(self._ailing)
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
        """The camera's run.  One that cannot be had ends the daemon, but not in the air."""
        try:
            await self._camera.run()
        except UnavailableError as err:
            await self._in_air_or(err)
            raise TransientError(str(err)) from err

    async def _fly_only(self, err: FlightdError) -> None:
        """Look after a vehicle that flies; once one that only stands there is disarmed, the daemon ends."""
        await self._in_air_or(err)
        self._trouble(str(err))
        while self._pilot.mission.phase is Phase.PREFLIGHT:
            state = self._vehicle.state()
            if state is not None and not state.armed:
                raise err
            await asyncio.sleep(TICK_S)

    async def _in_air_or(self, err: FlightdError) -> None:
        """Raise an error that the daemon ends with, unless its vehicle flies: that needs the daemon more than
        the daemon what it lacks."""
        give_up_ns = self._clock.now_ns() + round(_FIRST_HEARD_S * 1e9)
        while (state := self._vehicle.state()) is None and self._clock.now_ns() < give_up_ns:  # noqa: ASYNC110
            await asyncio.sleep(TICK_S)
        self._flew |= state is not None and state.armed
        if not self._flew:
            raise err

    def failed(self, err: TransientError) -> None:
        """A part that restarts has failed: tell people."""
        self._trouble(str(err))

    def _trouble(self, text: str) -> None:
        """Something that people should know."""
        self._audience.trouble(text, self._clock.now_ns())

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
        detections = self._sight.fresh(now_ns)
        commands, self._commands = self._commands, []
        if self._ground is not None:
            commands += self._ground.take_commands()
        if self._ailing is not None:
            commands = [command for command in commands if command.kind is not CommandKind.START]
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
        if self._front is not None:
            self._front.expose(self._pilot.exposure)
        if output.setpoint is None:
            self._latency.forget()
        if self._progress is not None:
            self._progress.put(LeftOver(self._pilot.mission.remaining, *self._pilot.mission.stand))
        self._audience.flown(tick, output)
        if self._audience.status_due(now_ns, output.phase):
            self._audience.status(self._vitals(tick, output), tick, output)
        return output

    def _health(self, now_ns: int) -> Health:
        recorder = self._recorder
        return Health(
            self._latency.recent_p99_s(now_ns),
            self._detectors.replaced,
            recorder.restarts if recorder is not None else 0,
            recorder.error if recorder is not None else "",
        )

    def _sent(self, setpoint: AttitudeSetpoint, now_ns: int) -> None:
        self._latency.sent(now_ns)
        if self._recorder is not None:
            self._recorder.record(Topic.SETPOINT, setpoint.stamp_ns, setpoint)

    def _vitals(self, tick: TickInput, output: TickOutput) -> Vitals:
        late_s, self._late_s = tuple(self._late_s), []
        dropped = {"camera": self._sight.frames.dropped, "detection": self._sight.lost}
        restarts = {"detector": self._detectors.replaced}
        if isinstance(self._vehicle, CountsDrops):
            dropped["vehicle"] = self._vehicle.dropped
        if self._recorder is not None:
            dropped["recorder"] = self._recorder.dropped
            restarts["recorder"] = self._recorder.restarts
        return Vitals(
            status=self._status(tick, output),
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
            frames_dropped=self._sight.dropped,
            fps=self._sight.fps,
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
            frames_dropped=self._sight.dropped,
            latency_ms=self._latency.quantiles_ms(),
            setpoint_interval_ms=quantile,
        )


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
