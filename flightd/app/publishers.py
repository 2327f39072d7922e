"""Everybody who is told of a flight: the vehicle's own ground station, recorder, ground link, monitors."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial

from flightd.app.record_pace import RecordPace
from flightd.core.snapshot import Snapshot
from flightd.core.tick import StepFailure
from flightd.core.topics import DronePlace, Topic
from flightd.core.types import Event, EventLevel, GridPose, Phase, VehicleState
from flightd.ports import Clock, Ground, Monitor, Recorder, Vehicle
from flightd.runtime.supervisor import FaultBarrier

_STATUS_NS = 100_000_000


class TelemetryPublishers:
    """Tells each of them what it is there for; none of them can keep the control tick waiting, or end it.
    `barrier` keeps what a part raises from the tick, `pace` says what of it is recorded."""

    def __init__(
        self,
        clock: Clock,
        vehicle: Vehicle,
        recorder: Recorder,
        ground: Ground,
        monitors: Sequence[Monitor] = (),
        observers: Sequence[Callable[[Snapshot], None]] = (),
    ) -> None:
        self._clock = clock
        self._vehicle = vehicle
        self._recorder = recorder
        self._ground = ground
        self._monitors = tuple(monitors)
        self._observers = tuple(observers)
        self.barrier = FaultBarrier(self._failed)
        self.pace = RecordPace()
        self._told_ns = 0
        self._told_phase: Phase | None = None
        self._late_s: list[float] = []
        self._latencies_ms: list[Mapping[str, float]] = []

    def trouble(self, text: str) -> None:
        """Something failed that people should know of, outside of any tick."""
        self.note(EventLevel.ERROR, "failure", text)

    def note(self, level: EventLevel, name: str, text: str) -> None:
        """Something happened outside of any tick that people should know of, and the log keeps."""
        event = Event(self._clock.now_ns(), level, name, text)
        self.barrier.call("recorder", lambda: self._recorder.record(Topic.EVENT, event.stamp_ns, event), None)
        self._event(event)

    def _failed(self, part: str, err: Exception) -> None:
        failure = StepFailure.of(self._clock.now_ns(), err, part)
        self.barrier.call(
            "recorder", lambda: self._recorder.record(Topic.FAILURE, failure.stamp_ns, failure), None
        )
        self.trouble(failure.error)

    def tells(self, snapshot: Snapshot) -> bool:
        """Whether `publish` would tell this tick to everybody; of the others only the record needs something:
        what was given and answered, the lateness and latencies, and the failure."""
        return snapshot.stamp_ns - self._told_ns >= _STATUS_NS or snapshot.phase is not self._told_phase

    def publish(self, snapshot: Snapshot) -> None:
        """A tick: its events to everybody, all of it to the record, unless nothing happens for long; ten
        times a second and at each change of phase it is told to everybody."""
        for event in snapshot.output.events:
            self._event(event)
        self.pace.take(snapshot)
        if _happens(snapshot) or self.pace.due(Topic.TICK, snapshot.stamp_ns):
            self.barrier.call("recorder", lambda: _record(self._recorder, snapshot), None)
        self._late_s += snapshot.tick_late_s
        self._latencies_ms += snapshot.latencies_ms
        if self.tells(snapshot):
            self._tell(snapshot)

    def over(self) -> None:
        """No tick follows."""
        for monitor in self._monitors:
            self.barrier.call("monitor", monitor.over, None)

    def _tell(self, snapshot: Snapshot) -> None:
        """How the flight stands."""
        changes = snapshot.phase is not self._told_phase
        self._told_ns, self._told_phase = snapshot.stamp_ns, snapshot.phase
        snapshot = replace(snapshot, tick_late_s=tuple(self._late_s), latencies_ms=tuple(self._latencies_ms))
        self._late_s.clear()
        self._latencies_ms.clear()
        call = self.barrier.call
        status = snapshot.status()
        if changes or self.pace.due(Topic.STATUS, snapshot.stamp_ns):
            call("recorder", lambda: self._recorder.record(Topic.STATUS, snapshot.stamp_ns, status), None)
        call("ground link", lambda: self._ground.tell(snapshot), None)
        for monitor in self._monitors:
            call("monitor", partial(monitor.tell, snapshot), None)
        for observer in self._observers:
            call("display", partial(observer, snapshot), None)

    def _event(self, event: Event) -> None:
        call = self.barrier.call
        call("vehicle", lambda: self._vehicle.notify(event), None)
        call("ground link", lambda: self._ground.event(event), None)
        for monitor in self._monitors:
            call("monitor", partial(monitor.event, event), None)


def _happens(snapshot: Snapshot) -> bool:
    """Whether a tick is more than one of many alike."""
    tick, output = snapshot.tick, snapshot.output
    happened = tick.commands, tick.codes, tick.counted, output.events, output.findings, output.settled
    return any(happened) or snapshot.failure is not None


def _record(recorder: Recorder, snapshot: Snapshot) -> None:
    """All that the pilot was given and answered, for the replay, and its parts for people."""
    tick, output, now_ns = snapshot.tick, snapshot.output, snapshot.stamp_ns
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
        recorder.record(Topic.DRONE_FRAME, now_ns, _place(output.pose, tick.vehicle))
    for command in tick.commands:
        recorder.record(Topic.COMMAND, now_ns, command)
    for event in output.events:
        recorder.record(Topic.EVENT, event.stamp_ns, event)
    if snapshot.failure is not None:
        recorder.record(Topic.FAILURE, now_ns, snapshot.failure)


def _place(pose: GridPose, vehicle: VehicleState | None) -> DronePlace:
    attitude = None if vehicle is None else vehicle.attitude
    roll_rad, pitch_rad = (0.0, 0.0) if attitude is None else (attitude.roll_rad, attitude.pitch_rad)
    return DronePlace(pose.stamp_ns, pose.x_m, pose.y_m, pose.height_m, roll_rad, pitch_rad, pose.yaw_rad)
