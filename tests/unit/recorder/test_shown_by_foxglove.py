"""A log as Foxglove's own reader finds it: whole, its schemas named, and drawn where things were."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import pytest

from flightd.adapters.recorder.recorder import McapRecorder
from flightd.adapters.recorder.schemas import schema_of
from flightd.core.topics import Topic
from flightd.core.types import Junction, JunctionKind, Line, LineSet
from flightd.replay.log import read_log
from tests.unit.recorder.test_recorder import LINES, MESSAGES, POSE, newest_json


def test_the_foxglove_reader_of_the_format_reads_it(tmp_path: Path) -> None:
    from mcap.reader import make_reader

    path = tmp_path / "flight.mcap"
    with McapRecorder(path) as recorder:
        for topic, stamp_ns, message in MESSAGES:
            recorder.record(topic, stamp_ns, message)
        recorder.image(Topic.FRAME, 10, 1, b"jpeg")
    with path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        assert summary.statistics.message_count == len(MESSAGES) + 1
        names = {
            channel.topic: summary.schemas[channel.schema_id].name for channel in summary.channels.values()
        }
        assert names[Topic.EVENT] == "foxglove.Log"
        assert names[Topic.FRAME] == "foxglove.CompressedImage"
        assert names[Topic.LINES] == "foxglove.ImageAnnotations"
        assert names[Topic.POSE] == "foxglove.PoseInFrame"
        assert names[Topic.STATUS] == "flightd.Status"
        assert all(b'"$ref"' not in schema.data for schema in summary.schemas.values())
        found = [channel.topic for _, channel, _ in reader.iter_messages(topics=[Topic.POSE])]
        assert found == [Topic.POSE]


def test_a_pose_is_shown_by_foxglove_where_it_was(tmp_path: Path) -> None:
    turned = dataclasses.replace(POSE, x_m=3.0, y_m=2.0, height_m=1.5, yaw_rad=math.pi / 2)
    with McapRecorder(tmp_path / "flight.mcap") as recorder:
        recorder.record(Topic.POSE, 2, turned)
    pose = newest_json(tmp_path / "flight.mcap", Topic.POSE)["pose"]
    assert pose["position"] == {"x": 3.0, "y": -2.0, "z": 1.5}
    half = math.sqrt(0.5)  # a quarter turn clockwise from above
    assert pose["orientation"] == pytest.approx({"x": 0.0, "y": 0.0, "z": -half, "w": half})


def test_lines_are_drawn_by_foxglove_where_they_were_seen(tmp_path: Path) -> None:
    upright = Line(20.0, 0.0, 30.0, -100.0, 50.0, 1.0, 0.1, 0.001)
    junction = Junction(JunctionKind.END, 20.0, 50.0)
    seen = dataclasses.replace(LINES, width_px=640, height_px=360, lines=(upright,), junctions=(junction,))
    with McapRecorder(tmp_path / "flight.mcap") as recorder:
        recorder.record(Topic.LINES, 5, seen)
    drawn = newest_json(tmp_path / "flight.mcap", Topic.LINES)
    band, centre = drawn["points"]
    assert centre["points"] == [{"x": 340.0, "y": 80.0}, {"x": 340.0, "y": 230.0}]
    assert {corner["x"] for corner in band["points"]} == {325.0, 355.0}
    assert drawn["circles"][0]["position"] == {"x": 340.0, "y": 230.0}
    assert read_log(tmp_path / "flight.mcap").messages(LineSet) == [seen]


@pytest.mark.parametrize(("topic", "message"), [(Topic.LINES, LINES), (Topic.POSE, POSE)])
def test_the_schema_names_every_field_that_is_written(tmp_path: Path, topic: Topic, message: object) -> None:
    with McapRecorder(tmp_path / "flight.mcap") as recorder:
        recorder.record(topic, 5, message)
    _, schema = schema_of(message)
    assert set(newest_json(tmp_path / "flight.mcap", topic)) == set(schema["properties"])
