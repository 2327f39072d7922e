from __future__ import annotations

import asyncio
import dataclasses
import json
import math
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from flightd.adapters.recorder import recorder as recorder_module
from flightd.adapters.recorder.mcap_repair import is_whole
from flightd.adapters.recorder.recorder import McapRecorder, wait_for_disk
from flightd.adapters.recorder.schemas import schema_of
from flightd.adapters.recorder.writer_watch import WriterWatch
from flightd.adapters.vehicle.mavlink.refusal import OffFloor
from flightd.core.errors import UnavailableError
from flightd.core.refusal import RecordedRefusal
from flightd.core.tick import TickInput
from flightd.core.topics import Document, RecordedFrame, Topic
from flightd.core.tracks import SensorEstimate
from flightd.core.types import (
    Attitude,
    AttitudeSetpoint,
    Command,
    CommandKind,
    Event,
    EventLevel,
    GridPose,
    Junction,
    JunctionKind,
    LandedState,
    Line,
    LineSet,
    Phase,
    Status,
    VehicleState,
)
from flightd.ports import Recorder
from flightd.replay.log import converted, read_log
from tests.rigs.event_loops import real
from tests.rigs.waiting import until

ROOT = Path(__file__).parents[3]
LINE = Line(12.5, 0.1, 31.0, -170.0, 180.0, 0.93, 0.12, 0.0011, 1e-5)
LINES = LineSet(
    7,
    5_000_000_001,
    640,
    360,
    (LINE, LINE),
    (Junction(JunctionKind.TEE, 3.0, -4.0, (0.0, 1.5)),),
    "combined",
    {"hypothesise": 1.25},
)
POSE = GridPose(10, "A1", 0.1, -0.2, 0.01, 3.1, 2.8, 0.4, 0.0, 1.5, tuple(float(i) for i in range(9)), 0.99)
VEHICLE = VehicleState(
    Attitude(11, 0.01, -0.02, 3.0),
    1.5,
    10,
    0.1,
    "GUIDED_NOGPS",
    True,
    True,
    LandedState.IN_AIR,
    0.8,
    15.2,
    9,
    RecordedRefusal("no"),
)
SENSORS = SensorEstimate(0.01, 0.002, 0.02, -0.01, 0.005, 0.001, 0.0, 0.01, 0.0, 0.005, 0.003, 0.02, 0.004)
STATUS = Status(
    12, Phase.FOLLOW, "", "A1", "A2", 1, 6, 0.8, 1.5, 300, 2, 29.9, {"total": 71.0}, None, SENSORS, 1.5, -0.2
)

MESSAGES = [
    (Topic.LINES, 1, LINES),
    (Topic.POSE, 2, POSE),
    (Topic.VEHICLE, 3, VEHICLE),
    (Topic.SETPOINT, 4, AttitudeSetpoint(4, 0.1, -0.1, 0.2, 0.3)),
    (Topic.STATUS, 5, STATUS),
    (Topic.EVENT, 6_500_000_000, Event(6_500_000_000, EventLevel.WARNING, "wind", "gusts of 3 m/s")),
    (Topic.COMMAND, 7, Command("c-1", CommandKind.GOTO, "B3")),
    (Topic.COMMAND, 8, Command("c-2", CommandKind.PLAN, nodes=("B3", "A1"), levels=(1, 2))),
    (Topic.MAP, 8, Document("[site]\n")),
    (Topic.TRUTH, 9, {"stamp_ns": 9, "x_m": 1.5}),
]


def newest_json(path: Path, topic: str) -> dict[str, Any]:
    """The newest message of a topic as it stands in the file."""
    from mcap.reader import make_reader

    with path.open("rb") as stream:
        *_, (_, _, message) = make_reader(stream).iter_messages(topics=[topic])
    fields: dict[str, Any] = json.loads(message.data)
    return fields


@pytest.mark.parametrize(("topic", "stamp_ns", "message"), MESSAGES)
def test_every_message_comes_back_as_it_was(
    tmp_path: Path, topic: Topic, stamp_ns: int, message: object
) -> None:
    path = tmp_path / "flight.mcap"
    with McapRecorder(path, metadata={"site": "demo"}) as recorder:
        recorder.record(topic, stamp_ns, message)
    log = read_log(path)
    assert [(entry.topic, entry.stamp_ns, entry.message) for entry in log.entries] == [
        (topic, stamp_ns, message)
    ]
    assert log.damage == ""
    assert log.metadata["site"] == "demo"
    assert log.metadata["version"]
    assert (recorder.written, recorder.dropped) == (1, 0)


def test_a_picture_comes_back_byte_for_byte(tmp_path: Path) -> None:
    jpeg = bytes(range(256)) * 100
    with McapRecorder(tmp_path / "flight.mcap") as recorder:
        recorder.image(Topic.FRAME, 1_234_567_890_123, 42, jpeg)
    (entry,) = read_log(tmp_path / "flight.mcap").entries
    assert entry.message == RecordedFrame(42, 1_234_567_890_123, jpeg)


def test_a_height_nobody_measured_comes_back_as_nan(tmp_path: Path) -> None:
    unknown = VehicleState(
        Attitude(11, 0.0, 0.0, 0.0), math.nan, 0, 0.0, "", False, False, LandedState.UNKNOWN, 1.0, 15.0, 9
    )
    with McapRecorder(tmp_path / "flight.mcap") as recorder:
        recorder.record(Topic.VEHICLE, 1, unknown)
    (vehicle,) = read_log(tmp_path / "flight.mcap").messages(VehicleState)
    assert math.isnan(vehicle.height_m)
    assert vehicle.battery_v == 15.0


def test_a_reason_is_kept_in_words_and_none_as_an_empty_text(tmp_path: Path) -> None:
    state = dataclasses.replace(VEHICLE, refusal=None, unfit=OffFloor(1.25), battery_a=2.0)
    path = tmp_path / "flight.mcap"
    with McapRecorder(path) as recorder:
        recorder.record(Topic.VEHICLE, 1, state)
        recorder.record(Topic.TICK, 2, TickInput(2, vehicle=state, unfit=RecordedRefusal("disk full")))
        recorder.record("/waiting", 3, TickInput(3))
    told = {"refusal": "", "unfit": "disarming: 1.2 m high"}
    assert newest_json(path, Topic.VEHICLE).items() >= told.items()
    assert newest_json(path, Topic.TICK)["vehicle"].items() >= told.items()
    assert newest_json(path, Topic.TICK)["unfit"] == "disk full"
    assert newest_json(path, "/waiting")["vehicle"] is None
    _, schema = schema_of(state)
    assert schema["properties"]["refusal"] == {"type": "string", "default": ""}
    known = dataclasses.replace(state, unfit=RecordedRefusal(told["unfit"]))
    assert read_log(path).messages(VehicleState) == [known]
    assert converted(newest_json(path, Topic.TICK), TickInput) == TickInput(
        2, vehicle=known, unfit=RecordedRefusal("disk full")
    )


def test_numpy_numbers_are_written_as_numbers(tmp_path: Path) -> None:
    with McapRecorder(tmp_path / "flight.mcap") as recorder:
        recorder.record("/extra", 1, {"a": np.float64(0.5), "b": np.arange(3)})
    (entry,) = read_log(tmp_path / "flight.mcap").entries
    assert entry.message == {"a": 0.5, "b": [0, 1, 2]}


def test_what_has_no_json_form_is_refused_at_once(tmp_path: Path) -> None:
    with (
        McapRecorder(tmp_path / "flight.mcap") as recorder,
        pytest.raises(TypeError, match="cannot be recorded"),
    ):
        recorder.record("/extra", 1, {"a": object()})


def test_the_recorder_is_the_port(tmp_path: Path) -> None:
    with McapRecorder(tmp_path / "flight.mcap") as recorder:
        port: Recorder = recorder
        port.record(Topic.POSE, 2, POSE)
    assert len(read_log(tmp_path / "flight.mcap").messages(GridPose)) == 1


def test_a_place_that_cannot_be_written_is_told_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(UnavailableError, match=r"flight\.mcap: cannot write the flight log"):
        McapRecorder(tmp_path / "file" / "flight.mcap")


def test_a_log_that_another_recorder_writes_is_not_taken_from_it(tmp_path: Path) -> None:
    path = tmp_path / "flight.mcap"
    with McapRecorder(path) as recorder:
        recorder.record(Topic.POSE, 2, POSE)
        recorder.push()
        real(_readable(path, 1))
        with pytest.raises(UnavailableError, match="another process is writing"):
            McapRecorder(path)
    assert len(read_log(path).entries) == 1


def test_nothing_is_lost_in_a_clean_close_under_load(tmp_path: Path) -> None:
    count = 20_000
    with McapRecorder(tmp_path / "flight.mcap", queue_bytes=1 << 16, when_full=wait_for_disk) as recorder:
        for index in range(count):
            recorder.record(Topic.SETPOINT, index, AttitudeSetpoint(index, 0.01))
    assert (recorder.written, recorder.dropped) == (count, 0)
    setpoints = read_log(tmp_path / "flight.mcap").messages(AttitudeSetpoint)
    assert [setpoint.stamp_ns for setpoint in setpoints] == list(range(count))


def test_a_full_queue_drops_and_counts_instead_of_waiting(tmp_path: Path) -> None:
    recorder = McapRecorder(tmp_path / "flight.mcap", queue_bytes=100_000)
    recorder.record(Topic.SETPOINT, 0, AttitudeSetpoint(0))
    os.kill(recorder.pid, signal.SIGSTOP)
    for index in range(1, 20_000):
        recorder.record(Topic.SETPOINT, index, AttitudeSetpoint(index, 0.01))
    dropped = recorder.dropped
    assert dropped > 1_000
    assert recorder.waiting_bytes <= 100_000
    os.kill(recorder.pid, signal.SIGCONT)
    recorder.close()
    assert recorder.dropped == dropped
    assert recorder.written == 20_000 - dropped
    log = read_log(tmp_path / "flight.mcap")
    assert len(log.entries) == recorder.written
    assert log.metadata["dropped"] == str(dropped)


def test_pictures_are_lost_before_decisions(tmp_path: Path) -> None:
    recorder = McapRecorder(tmp_path / "flight.mcap", queue_bytes=1_000_000)
    os.kill(recorder.pid, signal.SIGSTOP)
    for seq in range(50):
        recorder.image(Topic.FRAME, seq, seq, b"x" * 50_000)
    for index in range(1_000):
        recorder.record(Topic.SETPOINT, index, AttitudeSetpoint(index))
    os.kill(recorder.pid, signal.SIGCONT)
    recorder.close()
    log = read_log(tmp_path / "flight.mcap")
    assert len(log.messages(AttitudeSetpoint)) == 1_000
    assert 0 < len(log.messages(RecordedFrame)) < 50


async def _readable(path: Path, count: int) -> None:
    """Until `count` messages can be read from a file that is still being written."""
    await until(lambda: path.stat().st_size > 0 and len(read_log(path).entries) >= count)


def test_the_log_is_readable_after_kill_9_and_goes_on_in_the_same_file(tmp_path: Path) -> None:
    path = tmp_path / "flight.mcap"

    async def fly() -> McapRecorder:
        recorder = McapRecorder(path)
        recorder.record(Topic.MAP, 0, Document("map"))
        for index in range(100):
            recorder.record(Topic.SETPOINT, index, AttitudeSetpoint(index))
        running = asyncio.create_task(recorder.run())
        await _readable(path, 101)
        os.kill(recorder.pid, signal.SIGKILL)
        await until(lambda: recorder.restarts)
        for index in range(100, 200):
            recorder.record(Topic.SETPOINT, index, AttitudeSetpoint(index))
        running.cancel()
        await asyncio.wait([running])
        recorder.close()
        return recorder

    recorder = real(fly())
    log = read_log(path)
    assert log.damage == ""
    assert [setpoint.stamp_ns for setpoint in log.messages(AttitudeSetpoint)] == list(range(200))
    assert log.messages(Document)[-1] == Document("map")
    assert [event.name for event in log.messages(Event)] == ["recorder_died"]
    assert recorder.restarts == 1
    assert recorder.written == len(log.entries)
    assert recorder.dropped == 0


def test_a_writer_that_dies_before_it_took_anything_costs_nothing(tmp_path: Path) -> None:
    path = tmp_path / "flight.mcap"

    async def fly() -> McapRecorder:
        recorder = McapRecorder(path)
        recorder.record(Topic.MAP, 0, Document("map"))
        running = asyncio.create_task(recorder.run())
        await _readable(path, 1)
        first = recorder.pid
        os.kill(first, signal.SIGKILL)
        await until(lambda: recorder.pid != first)
        os.kill(recorder.pid, signal.SIGKILL)
        await until(lambda: recorder.restarts == 2)
        running.cancel()
        await asyncio.wait([running])
        recorder.close()
        return recorder

    recorder = real(fly())
    log = read_log(path)
    assert log.messages(Document) == [Document("map"), Document("map")]
    assert [event.name for event in log.messages(Event)] == ["recorder_died", "recorder_died"]
    assert recorder.written == len(log.entries)
    assert recorder.dropped == 0


def test_what_died_with_the_writer_is_counted_as_dropped(tmp_path: Path) -> None:
    recorder = McapRecorder(tmp_path / "flight.mcap")
    os.kill(recorder.pid, signal.SIGSTOP)
    for index in range(10):
        recorder.record(Topic.SETPOINT, index, AttitudeSetpoint(index))
    recorder.push()
    os.kill(recorder.pid, signal.SIGKILL)
    os.waitid(os.P_PID, recorder.pid, os.WEXITED | os.WNOWAIT)
    recorder.close()
    assert recorder.dropped == 10
    (told,) = read_log(tmp_path / "flight.mcap").entries
    assert told.topic == Topic.EVENT


def test_a_writer_that_takes_nothing_is_killed_and_replaced(tmp_path: Path) -> None:
    """It was left alone, and what found no room behind it was dropped; what waited for it is written now."""
    path = tmp_path / "flight.mcap"

    async def fly() -> McapRecorder:
        recorder = McapRecorder(path, hung_s=2.5)
        recorder.record(Topic.SETPOINT, 0, AttitudeSetpoint(0))
        running = asyncio.create_task(recorder.run())
        await until(lambda: recorder.written)
        os.kill(recorder.pid, signal.SIGSTOP)
        for seq in range(80):
            recorder.image(Topic.FRAME, seq, seq, bytes(40_000))
        recorder.record(Topic.SETPOINT, 1, AttitudeSetpoint(1))
        await until(lambda: recorder.restarts)
        recorder.record(Topic.SETPOINT, 2, AttitudeSetpoint(2))
        running.cancel()
        await asyncio.wait([running])
        recorder.close()
        return recorder

    recorder = real(fly())
    log = read_log(path)
    assert log.damage == ""
    assert [setpoint.stamp_ns for setpoint in log.messages(AttitudeSetpoint)] == [0, 1, 2]
    frames = [frame.seq for frame in log.messages(RecordedFrame)]
    assert frames == list(range(80 - len(frames), 80))
    assert len(frames) > 60
    (event,) = log.messages(Event)
    assert event.text == "the writer of the flight log took nothing any more and was started again"
    assert recorder.written == len(log.entries)
    assert recorder.dropped == 80 - len(frames)
    assert recorder.error == ""


def test_messages_that_find_no_room_are_told_pictures_are_not(tmp_path: Path) -> None:
    with McapRecorder(tmp_path / "flight.mcap", queue_bytes=1 << 20) as recorder:
        os.kill(recorder.pid, signal.SIGSTOP)
        for seq in range(40):
            recorder.image(Topic.FRAME, seq, seq, bytes(40_000))
        assert recorder.dropped > 0
        assert recorder.error == ""
        for index in range(20_000):
            recorder.record(Topic.SETPOINT, index, AttitudeSetpoint(index))
        assert recorder.error == "the disk takes less than is recorded"
        os.kill(recorder.pid, signal.SIGCONT)


def test_a_writer_that_cannot_be_killed_is_trouble() -> None:
    watch = WriterWatch(hung_s=6.0)
    watch.begin(0.0)
    assert not watch.hangs(50.0)
    watch.hear(51.0)
    assert not watch.hangs(56.9)
    assert watch.hangs(57.1)
    watch.kill(57.1)
    assert not watch.hangs(100.0)
    assert watch.trouble(59.0) == ""
    assert watch.trouble(59.2) == "the disk does not answer"
    watch.begin(60.0)
    assert watch.trouble(63.0) == ""


KILLED_DAEMON = """
import os, signal, sys
from pathlib import Path
from flightd.adapters.recorder.recorder import McapRecorder
from flightd.core.topics import Topic
from flightd.core.types import AttitudeSetpoint

recorder = McapRecorder(Path(sys.argv[1]))
recorder.record(Topic.SETPOINT, 1, AttitudeSetpoint(1))
recorder.push()
os.kill(os.getpid(), signal.SIGKILL)
"""


def test_the_log_is_finished_when_the_daemon_is_killed(tmp_path: Path) -> None:
    path = tmp_path / "flight.mcap"
    killed = subprocess.run([sys.executable, "-c", KILLED_DAEMON, str(path)], cwd=ROOT, check=False)
    assert killed.returncode == -signal.SIGKILL
    real(until(lambda: is_whole(path)))
    log = read_log(path)
    assert log.damage == ""
    assert len(log.entries) == 1


def test_a_stop_of_the_service_does_not_stop_the_writer(tmp_path: Path) -> None:
    path = tmp_path / "flight.mcap"
    with McapRecorder(path) as recorder:
        recorder.record(Topic.SETPOINT, 1, AttitudeSetpoint(1))
        recorder.push()
        real(_readable(path, 1))
        for name in (signal.SIGTERM, signal.SIGINT):
            os.kill(recorder.pid, name)
        recorder.record(Topic.SETPOINT, 2, AttitudeSetpoint(2))
    assert recorder.written == 2
    assert recorder.restarts == 0


def test_a_full_disk_costs_messages_and_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A file-size limit stands for the disk that is full."""
    real = subprocess.Popen

    def limited(arguments: list[str], **kwargs: Any) -> Any:
        shell = ["/bin/sh", "-c", 'ulimit -f 64; exec "$@"', "sh"]
        return real([*shell, *map(str, arguments)], **kwargs)

    monkeypatch.setattr(subprocess, "Popen", limited)
    noise = np.random.default_rng(1)
    with McapRecorder(tmp_path / "flight.mcap", when_full=wait_for_disk) as recorder:
        for seq in range(100):
            recorder.image(Topic.FRAME, seq, seq, noise.bytes(40_000))
    assert recorder.written + recorder.dropped == 100
    assert recorder.dropped > 0
    assert "large" in recorder.error.lower()
    assert len(read_log(tmp_path / "flight.mcap").entries) == recorder.written


def test_run_hands_over_what_waits_without_further_messages(tmp_path: Path) -> None:
    path = tmp_path / "flight.mcap"

    async def fly() -> None:
        with McapRecorder(path) as recorder:
            recorder.record(Topic.SETPOINT, 1, AttitudeSetpoint(1))
            running = asyncio.create_task(recorder.run())
            await _readable(path, 1)
            running.cancel()
            with pytest.raises(asyncio.CancelledError):
                await running

    real(fly())


@pytest.mark.filterwarnings("ignore:subprocess:ResourceWarning")  # it goes on by itself, as promised
def test_close_has_one_deadline_for_a_writer_that_stands_still(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recorder_module, "CLOSE_S", 1.5)
    recorder = McapRecorder(tmp_path / "flight.mcap")
    recorder.record(Topic.SETPOINT, 0, AttitudeSetpoint(0))
    os.kill(recorder.pid, signal.SIGSTOP)
    began_s = time.monotonic()
    try:
        recorder.close()
        assert time.monotonic() - began_s < 2.5
    finally:
        os.kill(recorder.pid, signal.SIGCONT)
    os.waitpid(recorder.pid, 0)
    assert is_whole(tmp_path / "flight.mcap")


def test_close_can_be_called_twice(tmp_path: Path) -> None:
    recorder = McapRecorder(tmp_path / "flight.mcap")
    recorder.record(Topic.SETPOINT, 1, AttitudeSetpoint(1))
    for _ in range(2):
        recorder.close()
        assert (recorder.written, recorder.dropped, recorder.restarts) == (1, 0, 0)
    log = read_log(tmp_path / "flight.mcap")
    assert (len(log.entries), log.damage) == (1, "")
