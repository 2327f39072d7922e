"""What is recorded of a drone that waits on the ground, and of one that is about to fly."""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Iterable
from dataclasses import replace
from typing import Any, cast

from flightd.app.absent_parts import NO_GROUND, NoRecorder
from flightd.app.detection.detector_pool import Detection
from flightd.app.detection.pipeline import DetectionPipeline
from flightd.app.publishers import TelemetryPublishers
from flightd.app.record_pace import RecordPace
from flightd.core.geometry import Lens
from flightd.core.snapshot import Snapshot
from flightd.core.topics import Topic
from flightd.core.types import Command, CommandKind, Event, EventLevel, LineSet, Phase
from flightd.ports import Vehicle
from flightd.runtime.frame_ring import FrameTicket
from tests.rigs.event_loops import virtual
from tests.unit.service.vitals import MS, START_NS, vitals

S = 1000 * MS
TICK_NS = 20 * MS
MINUTE = 60 * S


class Log(NoRecorder):
    """What came, and when."""

    def __init__(self) -> None:
        self.kept: list[tuple[str, int]] = []

    def record(self, topic: str, stamp_ns: int, message: object) -> None:
        self.kept.append((topic, stamp_ns - START_NS))

    def image(self, topic: str, stamp_ns: int, seq: int, jpeg: bytes) -> None:
        self.kept.append((topic, stamp_ns - START_NS))

    def counted(self, from_ns: int, to_ns: int) -> Counter[str]:
        return Counter(topic for topic, stamp_ns in self.kept if from_ns <= stamp_ns < to_ns)


class Unheard:
    """A vehicle to which events are nothing."""

    def notify(self, event: Event) -> None: ...


def ticked(
    from_ns: int, to_ns: int, phase: Phase = Phase.PREFLIGHT, *, armed: bool = False
) -> Iterable[Snapshot]:
    """Ticks of a drone that stands, its vehicle heard, a picture with every other one."""
    for since_ns in range(from_ns, to_ns, TICK_NS):
        now_ns = START_NS + since_ns
        tick = vitals(now_ns, phase=phase, heard_ns=now_ns)
        assert tick.vehicle is not None
        seen = (LineSet(0, now_ns, 64, 36, (), (), "combined"),) if since_ns // TICK_NS % 2 else ()
        told = replace(tick.tick, vehicle=replace(tick.vehicle, armed=armed), lines=seen)
        yield replace(tick, tick=told)


def logged(*stretches: Iterable[Snapshot]) -> Log:
    log = Log()
    publishers = TelemetryPublishers(cast(Any, None), cast(Vehicle, Unheard()), log, NO_GROUND)
    for stretch in stretches:
        for tick in stretch:
            publishers.publish(tick)
    return log


def test_of_a_long_wait_a_tick_a_second_is_kept_after_a_minute_of_all() -> None:
    log = logged(ticked(0, 4 * MINUTE))
    assert log.counted(0, MINUTE)[Topic.TICK] == 3000
    waits = log.counted(MINUTE, 4 * MINUTE)
    assert 170 <= waits[Topic.TICK] <= 181
    assert waits[Topic.TICK] == waits[Topic.DECISION] == waits[Topic.VEHICLE]
    assert 160 <= waits[Topic.STATUS] <= 181
    kept = [since_ns for topic, since_ns in log.kept if topic == Topic.TICK and since_ns >= MINUTE]
    assert all(since_ns // TICK_NS % 2 for since_ns in kept[1:]), "a replay starts by the newest picture"


def test_from_arming_on_all_is_kept_with_the_change_of_phase() -> None:
    log = logged(ticked(0, 2 * MINUTE), ticked(2 * MINUTE, 2 * MINUTE + 10 * S, Phase.ARMING))
    assert log.counted(2 * MINUTE, 3 * MINUTE)[Topic.TICK] == 500
    assert (Topic.STATUS, 2 * MINUTE) in log.kept
    assert (Topic.TICK, 2 * MINUTE) in log.kept


def test_a_vehicle_that_somebody_else_has_armed_is_recorded_whole() -> None:
    assert logged(ticked(0, 2 * MINUTE, armed=True)).counted(MINUTE, 2 * MINUTE)[Topic.TICK] == 3000


def test_what_happens_in_a_wait_is_kept_and_after_a_command_a_minute_more() -> None:
    order = Command("order", CommandKind.START)
    event = Event(START_NS, EventLevel.INFO, "some", "thing")
    early, late = ticked(0, 2 * MINUTE), ticked(2 * MINUTE + 2 * TICK_NS, 4 * MINUTE)
    (told, asked) = ticked(2 * MINUTE, 2 * MINUTE + 2 * TICK_NS)
    told = replace(told, output=replace(told.output, events=(event,)))
    asked = replace(asked, tick=replace(asked.tick, commands=(order,)))
    log = logged(early, (told, asked), late)
    assert {(Topic.TICK, 2 * MINUTE), (Topic.TICK, 2 * MINUTE + TICK_NS)} <= {*log.kept}
    assert (Topic.COMMAND, 2 * MINUTE + TICK_NS) in log.kept
    assert log.counted(2 * MINUTE, 3 * MINUTE)[Topic.TICK] == 3000
    assert log.counted(3 * MINUTE + S, 4 * MINUTE)[Topic.TICK] < 61


class Sees:
    """Detectors that always answer, with a picture where one is wanted."""

    replaced = 0

    async def detect(self, ticket: FrameTicket, with_jpeg: bool = False) -> Detection:
        lines = LineSet(ticket.seq, ticket.stamp_ns, 64, 36, (), (), "combined", {})
        return Detection(ticket, lines, 0, 0, b"jpeg" if with_jpeg else None)


def test_a_picture_every_ten_seconds_is_kept_of_a_long_wait_and_all_of_a_flight() -> None:
    async def main() -> Log:
        log, pace, lens = Log(), RecordPace(), Lens(64, 36, 50.0, 50.0, 31.5, 17.5)
        pipeline = DetectionPipeline(Sees(), 1, log, NO_GROUND, 2.0, lens, pace)
        task = asyncio.ensure_future(pipeline.run())
        flies = ticked(3 * MINUTE, 4 * MINUTE, Phase.FOLLOW, armed=True)
        for seq, tick in enumerate([*ticked(0, 3 * MINUTE), *flies]):
            pace.take(tick)
            if seq % 5 == 0:
                now_ns = tick.stamp_ns
                pipeline.frames.put(FrameTicket("ring", 0, 4, seq, now_ns, now_ns, 64, 36))
                await asyncio.sleep(0.001)
        task.cancel()
        await asyncio.wait([task])
        return log

    log = virtual(main())
    assert log.counted(0, MINUTE)[Topic.FRAME] == 120
    assert 11 <= log.counted(MINUTE, 3 * MINUTE)[Topic.FRAME] <= 13
    assert log.counted(3 * MINUTE, 4 * MINUTE)[Topic.FRAME] == 120
