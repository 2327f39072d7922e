from __future__ import annotations

import csv
import json
from pathlib import Path

import cv2
import pytest

from flightd.adapters.recorder.recorder import McapRecorder
from flightd.core.topics import Topic
from flightd.core.types import AttitudeSetpoint
from tests.command import Command
from tests.replay.synthetic_flight import write_flight

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_flight(tmp_path_factory.mktemp("flight"), truth=False, summary=False)


def test_info_tells_what_is_in_the_log(flightd: Command, log: Path) -> None:
    result = flightd("log", "info", log, "--json")
    assert (result.returncode, result.stderr) == (0, "")
    told = json.loads(result.stdout)
    assert told["damage"] == ""
    assert told["metadata"]["vehicle"] == "ardupilot"
    assert told["topics"]["/setpoint"]["hz"] == pytest.approx(50.0, abs=0.1)
    assert told["messages"] == sum(topic["messages"] for topic in told["topics"].values())
    assert 60 < told["duration_s"] < 120


def test_export_writes_tables_and_a_video(flightd: Command, log: Path, tmp_path: Path) -> None:
    result = flightd(
        "log", "export", log, "--csv", tmp_path / "tables", "--video", tmp_path / "flight.mp4", "--json"
    )
    assert (result.returncode, result.stderr) == (0, "")
    written = {Path(path).name for path in json.loads(result.stdout)["written"]}
    assert written >= {
        "lines.csv",
        "pose.csv",
        "vehicle.csv",
        "status.csv",
        "event.csv",
        "map.toml",
        "flight.mp4",
    }
    with (tmp_path / "tables" / "vehicle.csv").open() as stream:
        vehicle = list(csv.DictReader(stream))
    assert {"t_s", "attitude.roll_rad", "height_m", "battery_frac"} <= set(vehicle[0])
    assert float(vehicle[-1]["t_s"]) > 60
    with (tmp_path / "tables" / "lines.csv").open() as stream:
        lines = list(csv.DictReader(stream))
    assert lines[0]["width_px"] == "640"
    assert lines[0]["line.width_px"] == "30.0"
    assert {row["line.kind"] for row in lines} == {"vertical", "horizontal"}
    video = cv2.VideoCapture(str(tmp_path / "flight.mp4"))
    assert video.isOpened()
    assert video.get(cv2.CAP_PROP_FRAME_COUNT) >= 30
    assert (video.get(cv2.CAP_PROP_FRAME_WIDTH), video.get(cv2.CAP_PROP_FRAME_HEIGHT)) == (640, 360)


def test_a_log_that_was_cut_off_is_repaired(flightd: Command, log: Path, tmp_path: Path) -> None:
    path = tmp_path / "flight.mcap"
    path.write_bytes(log.read_bytes()[:-50_000])
    assert json.loads(flightd("log", "info", path, "--json").stdout)["damage"] != ""
    assert flightd("log", "repair", path).returncode == 0
    assert json.loads(flightd("log", "info", path, "--json").stdout)["damage"] == ""


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("info", "none.mcap"), "none.mcap: cannot open"),
        (("export", "flight.mcap"), "--csv DIR"),
        (("export", "flight.mcap", "--video", "x.mp4"), "holds no pictures"),
        (("export", "flight.mcap", "--video", "flight.mcap"), "is no name of a video; name it .mp4"),
        (("export", "flight.mcap", "--csv", "flight.mcap/tables"), "cannot export"),
        (("repair", "note.txt"), "not a flight log"),
    ],
)
def test_what_cannot_be_done_is_one_line_and_exit_2(
    flightd: Command, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, arguments: tuple[str, ...], told: str
) -> None:
    with McapRecorder(tmp_path / "flight.mcap") as recorder:
        recorder.record(Topic.SETPOINT, 1, AttitudeSetpoint(1))
    (tmp_path / "note.txt").write_text("hello")
    monkeypatch.chdir(tmp_path)
    result = flightd("log", *arguments)
    assert (result.returncode, result.stdout) == (2, "")
    assert len(result.stderr.splitlines()) == 1
    assert told in result.stderr


@pytest.mark.parametrize("words", [("log", "info"), ("log", "repair"), ("replay",), ("report",)])
def test_an_empty_file_is_no_log(flightd: Command, tmp_path: Path, words: tuple[str, ...]) -> None:
    empty = tmp_path / "flight.mcap"
    empty.touch()
    result = flightd(*words, empty)
    assert (result.returncode, result.stdout) == (2, "")
    assert result.stderr == f"flightd: {empty}: the file is empty: nothing was recorded in it\n"
    assert sorted(tmp_path.iterdir()) == [empty], "no report of nothing"
    assert empty.stat().st_size == 0
