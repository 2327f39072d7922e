"""The frames that `flightd bench` shows: new ones each time, of all levels; no room for them is told."""

from __future__ import annotations

import os
import resource
import signal
from pathlib import Path

import numpy as np
import pytest

from flightd.core.errors import UnavailableError
from flightd.studies.bench_frames import BenchFrames

SIZE = (160, 90)


def test_each_frame_is_another(tmp_path: Path) -> None:
    drawn = BenchFrames(tmp_path, 4)
    drawn.make([SIZE], 1)
    frames = {number: bgr.tobytes() for number, bgr in drawn.of(SIZE)}
    assert list(frames) == [0, 1, 2, 3]
    assert len({*frames.values(), drawn.first(SIZE).tobytes()}) == 5
    assert all(np.frombuffer(bgr, np.uint8).std() > 1 for bgr in frames.values())


def test_a_disk_without_room_for_the_frames_is_told(tmp_path: Path) -> None:
    usual = resource.getrlimit(resource.RLIMIT_FSIZE)
    heard = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, usual[1]))
    try:
        with pytest.raises(UnavailableError, match="--frames") as told:
            BenchFrames(tmp_path, 4).make([SIZE], 1)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, usual)
        signal.signal(signal.SIGXFSZ, heard)
    assert os.fspath(tmp_path.parent) in str(told.value)
