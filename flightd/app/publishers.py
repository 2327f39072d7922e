"""Everybody who is told of a flight: the vehicle's own ground station, recorder, ground link, monitors."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from flightd.core.tick import TickInput, TickOutput
from flightd.core.topics import Topic
from flightd.core.types import Event, EventLevel, Phase, Status
from flightd.ports import Ground, Monitor, Recorder, Vehicle, Vitals

_STATUS_NS = 100_000_000


class TelemetryPublishers:
    """Tells each of them what it is there for; none of them can keep the control tick waiting."""

    def __init__(
        self,
        vehicle: Vehicle,
        recorder: Recorder | None,
        ground: Ground | None,
        monitors: Sequence[Monitor],
        observers: Sequence[Callable[[Status], None]],
    ) -> None:
        self._vehicle = vehicle
        self._recorder = recorder
        self._ground = ground
        self._monitors = monitors
        self._observers = observers
        self._status_ns = 0
        self._last_phase: Phase | None = None

    def trouble(self, text: str, now_ns: int) -> None:
        """Something failed that people should know of, outside of any tick."""
        event = Event(now_ns, EventLevel.ERROR, "failure", text)
        if self._recorder is not None:
            self._recorder.record(Topic.EVENT, event.stamp_ns, event)
        self._event(event)

    def flown(self, tick: TickInput, output: TickOutput) -> None:
        """What came in and went out at a tick: its events to everybody, all of it to the record."""
        for event in output.events:
            self._event(event)
        if self._recorder is not None:
            _record(self._recorder, tick, output)

    def status_due(self, now_ns: int, phase: Phase) -> bool:
        """A status is told ten times a second and at each change of phase."""
        if now_ns - self._status_ns < _STATUS_NS and phase is self._last_phase:
            return False
        self._status_ns, self._last_phase = now_ns, phase
        return True

    def status(self, vitals: Vitals, tick: TickInput, output: TickOutput) -> None:
        """How the flight stands."""
        status = vitals.status
        if self._recorder is not None:
            self._recorder.record(Topic.STATUS, status.stamp_ns, status)
        if self._ground is not None:
            self._ground.tell(status, tick, output)
        for monitor in self._monitors:
            monitor.tell(vitals)
        for observer in self._observers:
            observer(status)

    def _event(self, event: Event) -> None:
        self._vehicle.notify(event)
        if self._ground is not None:
            self._ground.event(event)
        for monitor in self._monitors:
            monitor.event(event)


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
