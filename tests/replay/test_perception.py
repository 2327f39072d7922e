from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest

from flightd.adapters.recorder.recorder import McapRecorder, wait_for_disk
from flightd.core.topics import RecordedFrame, Topic
from flightd.core.types import Image, Line, LineSet
from flightd.replay.log import LogReader
from flightd.replay.perception_compare import PerceptionDrift, replay_pictures
from flightd.vision.line_detector import Detector
from tests.replay.synthetic_flight import picture, seen_lines


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Ten pictures with the lines that today's detector sees in them before they are compressed."""
    path = tmp_path_factory.mktemp("flight") / "flight.mcap"
    rng = np.random.default_rng(3)
    detector = Detector()
    with McapRecorder(path, when_full=wait_for_disk) as recorder:
        for seq in range(1, 11):
            jpeg = picture(seen_lines(seq, seq, 0.0, rng), rng)
            decoded = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR)
            assert decoded is not None
            image = decoded.astype(np.uint8)
            recorder.record(Topic.LINES, seq, detector.detect(image, seq, seq))
            recorder.image(Topic.FRAME, seq, seq, cv2.imencode(".jpg", image)[1].tobytes())
    return path


def _changed(change: Callable[[Line], Line | None]) -> Callable[[Image, int, int], LineSet]:
    detector = Detector()

    def detect(image: Image, seq: int, stamp_ns: int) -> LineSet:
        seen = detector.detect(image, seq, stamp_ns)
        lines = tuple(line for line in map(change, seen.lines) if line is not None)
        return dataclasses.replace(seen, lines=lines)

    return detect


def test_today_s_detector_sees_the_same_in_the_compressed_pictures(log: Path) -> None:
    drift = replay_pictures(log, Detector().detect)
    assert drift.pictures == 10
    assert drift.pairs >= 10
    assert (drift.gone, drift.new) == (0, 0)
    assert drift.within(0.3)


def test_a_detector_that_shifts_lines_is_told_by_how_much(log: Path) -> None:
    shifted = _changed(lambda line: dataclasses.replace(line, rho_px=line.rho_px + 3.0))
    drift = replay_pictures(log, shifted)
    assert drift.rho_p95_px == pytest.approx(3.0, abs=0.3)
    assert not drift.within(0.5)


def test_a_detector_that_overlooks_lines_is_told(log: Path) -> None:
    drift = replay_pictures(log, _changed(lambda line: None if line.kind == "vertical" else line))
    assert drift.gone >= 9
    assert not drift.within(100.0)


def test_a_line_written_the_other_way_round_is_the_same(tmp_path: Path) -> None:
    line = Line(12.0, 0.001, 30.0, -100.0, 100.0, 1.0, 0.1, 0.001)
    turned = dataclasses.replace(line, rho_px=-12.5, theta_rad=math.pi - 0.001)
    before = LineSet(1, 1, 640, 360, (line,), (), "combined")
    path = tmp_path / "flight.mcap"
    with McapRecorder(path) as recorder:
        recorder.record(Topic.LINES, 1, before)
        recorder.image(Topic.FRAME, 1, 1, picture(before, np.random.default_rng(1)))
    drift = replay_pictures(path, lambda *_: dataclasses.replace(before, lines=(turned,)))
    assert (drift.pairs, drift.gone, drift.new) == (1, 0, 0)
    assert drift.rho_max_px == pytest.approx(0.5)
    assert drift.theta_max_deg == pytest.approx(math.degrees(0.002))


def test_a_picture_without_recorded_lines_is_passed_over(log: Path, tmp_path: Path) -> None:
    path = tmp_path / "flight.mcap"
    with McapRecorder(path) as recorder:
        for entry in LogReader(log).entries({Topic.FRAME}):
            assert isinstance(entry.message, RecordedFrame)
            recorder.image(Topic.FRAME, entry.stamp_ns, entry.message.seq, entry.message.jpeg)
        recorder.image(Topic.FRAME, 99, 99, b"no picture")
    assert replay_pictures(path, Detector().detect).pictures == 0


@pytest.mark.parametrize(
    ("pairs", "new", "gone", "same"),
    [
        (76, 2, 0, True),
        (101, 1, 2, True),
        (101, 3, 3, False),
        (1000, 15, 14, False),
        (1000, 14, 14, True),
        (10, 1, 0, True),
        (4, 1, 0, False),
        (0, 0, 0, True),
    ],
)
def test_lines_at_the_edge_of_being_seen_may_tip_over_as_often_as_chance_has_it(
    pairs: int, new: int, gone: int, same: bool
) -> None:
    drift = PerceptionDrift(pairs, pairs, gone, new, 0.1, 5.0, 0.1, 1.0)
    assert drift.within(0.5) is same
    assert (gone + new <= drift.may_tip) is same
    assert drift.complaint(0.5) == (
        "" if same else f"{gone + new} lines gone or new, {drift.may_tip} allowed"
    )
