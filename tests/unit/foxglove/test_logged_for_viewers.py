"""What a flight log has for viewers, as Foxglove's own types take it; flightd reads none of it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader

from flightd.adapters.recorder.recorder import McapRecorder, wait_for_disk
from flightd.app.flight_orders import configured_order
from flightd.app.recording import FlightSetting, record_setting, recorded_setting
from flightd.core.topics import FOR_PEOPLE, FOR_VIEWERS, RETAINED, DronePlace, Topic
from flightd.replay.log import read_log
from tests.sim.ideal.ideal_flight import IdealFlight
from tests.unit.foxglove.test_camera_frames import FITTED, matrix
from tests.unit.foxglove.test_warehouse_scene import SITE

messages = pytest.importorskip("foxglove.messages", reason="needs foxglove-sdk: pip install -e '.[dev]'")

START_NS = 1_000_000_000_000


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Some seconds of a flight."""
    path = tmp_path_factory.mktemp("log") / "flight.mcap"
    with McapRecorder(path, when_full=wait_for_disk) as recorder:
        record_setting(recorder, START_NS, FlightSetting(FITTED, SITE, configured_order(FITTED)))
        flight = IdealFlight(SITE, FITTED)
        flight.on_record = recorder.record
        flight.fly(6.0)
    return path


def told(log: Path, topic: str) -> list[tuple[str, dict[str, Any]]]:
    """Schema and fields of a topic's messages, by a reader that is not ours."""
    with log.open("rb") as stream:
        found = make_reader(stream).iter_messages(topics=[topic])
        return [(schema.name if schema else "", json.loads(message.data)) for schema, _, message in found]


@pytest.mark.parametrize(
    ("topic", "kind"),
    [
        (Topic.SCENE, "SceneUpdate"),
        (Topic.CAMERA_FRAMES, "FrameTransforms"),
        (Topic.DRONE_FRAME, "FrameTransforms"),
        (Topic.DOWN_CALIBRATION, "CameraCalibration"),
        (Topic.FRONT_CALIBRATION, "CameraCalibration"),
    ],
)
def test_foxgloves_own_types_take_it(log: Path, topic: Topic, kind: str) -> None:
    from tests.unit.foxglove.sdk_messages import taken

    said = told(log, topic)
    assert said
    for schema, fields in said:
        assert schema == f"foxglove.{kind}"
        assert len(taken(getattr(messages, kind), fields).encode()) > 20


def test_what_stands_is_told_once_at_the_start(log: Path) -> None:
    with log.open("rb") as stream:
        found = list(make_reader(stream).iter_messages(topics=list(FOR_VIEWERS - {Topic.DRONE_FRAME})))
    assert len(found) == len(FOR_VIEWERS) - 1
    assert {message.log_time for _, _, message in found} == {START_NS}
    assert FOR_VIEWERS - {Topic.DRONE_FRAME} < RETAINED, "a writer that dies leaves them to the next one"


def test_the_drones_frame_goes_where_its_pose_is(log: Path) -> None:
    frames, poses = told(log, Topic.DRONE_FRAME), told(log, Topic.POSE)
    assert len(frames) == len(poses) > 50
    for (_, frame), (_, pose) in zip(frames, poses, strict=True):
        (moved,) = frame["transforms"]
        assert moved["translation"] == pose["pose"]["position"]
        assert moved["timestamp"] == pose["timestamp"]
    leaning = [matrix(frame["transforms"][0])[2, 2] for _, frame in frames]
    assert min(leaning) < 0.9999, "it leans as the drone does"


def test_a_place_without_a_number_is_kept_as_it_is(tmp_path: Path) -> None:
    path = tmp_path / "flight.mcap"
    with McapRecorder(path) as recorder:
        recorder.record(Topic.DRONE_FRAME, 5, DronePlace(5, 1.0, 2.0, float("nan"), 0.0, 0.0, 0.0))
        recorder.record(Topic.DRONE_FRAME, 6, DronePlace(6, 1.0, 2.0, 0.5, float("nan"), 0.0, 0.0))
    (_, low), (_, unknown) = told(path, Topic.DRONE_FRAME)
    assert low["transforms"][0]["translation"] == {"x": 1.0, "y": -2.0, "z": 0.0}
    assert unknown["roll_rad"] is None


def test_flightd_reads_none_of_it(log: Path) -> None:
    assert not FOR_VIEWERS & FOR_PEOPLE
    assert not {entry.topic for entry in read_log(log, FOR_PEOPLE).entries} & FOR_VIEWERS
    setting = recorded_setting(read_log(log, FOR_PEOPLE))
    assert (setting.site, setting.config) == (SITE, FITTED)
