"""What a command writes on stderr: its own one line, and a progress bar where a person watches."""

from __future__ import annotations

import os
import pty
import re
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

from flightd.adapters.store.sqlite import SqliteStore
from flightd.core.inventory import PlannedLocation

ROOT = Path(__file__).parents[3]


def on_a_terminal(*arguments: object) -> tuple[int, str]:
    """Exit code of a command whose stderr is a terminal, and what it shows there."""
    ours, theirs = pty.openpty()
    command = [sys.executable, "-m", "flightd", *map(str, arguments)]
    shown = b""
    with subprocess.Popen(
        command, cwd=ROOT, env={**os.environ, "TERM": "xterm"}, stdout=subprocess.DEVNULL, stderr=theirs
    ) as program:
        os.close(theirs)
        while True:
            try:
                piece = os.read(ours, 4096)
            except OSError:  # the other end is closed
                break
            if not piece:
                break
            shown += piece
        code = program.wait(60.0)
    os.close(ours)
    return code, shown.decode()


@pytest.fixture(scope="module")
def video(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("video") / "floor.mp4"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"mp4v"), 10.0, (640, 360))
    for _ in range(150):
        writer.write(np.zeros((360, 640, 3), np.uint8))
    writer.release()
    return path


@pytest.mark.parametrize("buffered", ["", "1"])
@pytest.mark.parametrize("arguments", [("guide", "counting"), ("guide", "--json"), ("log", "--help")])
def test_an_output_that_takes_no_more_is_one_line(arguments: tuple[str, ...], buffered: str) -> None:
    with Path("/dev/full").open("wb") as full:
        done = subprocess.run(
            [sys.executable, "-m", "flightd", *arguments],
            cwd=ROOT, env={**os.environ, "PYTHONUNBUFFERED": buffered},
            stdout=full, stderr=subprocess.PIPE, text=True, timeout=60, check=False,
        )  # fmt: skip
    assert (done.returncode, done.stderr) == (2, "flightd: output: cannot write: No space left on device\n")


@pytest.mark.parametrize(("closed", "code"), [(">&-", 0), ("2>&-", 0), (">&- 2>&-", 0), ("| true", 1)])
def test_an_output_that_nobody_reads_is_no_failure_to_tell(closed: str, code: int, tmp_path: Path) -> None:
    with SqliteStore(tmp_path) as store:
        store.plan([PlannedLocation("A-01", "A1")])
    command = f"{sys.executable} -m flightd inventory export {tmp_path} {closed}; exit ${{PIPESTATUS[0]}}"
    done = subprocess.run(
        ["bash", "-c", command], cwd=ROOT, capture_output=True, text=True, timeout=60, check=False
    )
    assert (done.returncode, done.stderr) == (code, "")


def test_a_video_that_cannot_be_read_is_one_line(tmp_path: Path) -> None:
    path = tmp_path / "walk.mp4"
    path.write_text("no video")
    done = subprocess.run(
        [sys.executable, "-m", "flightd", "detect", str(path)],
        cwd=ROOT, capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == f"flightd: {path}: no frame can be read (damaged, or a codec that is not there)\n"


def test_a_camera_that_is_not_there_says_nothing_through_opencv() -> None:
    code = (
        "import sys\n"
        "from flightd.cli.main import main\n"
        "sys.argv = ['flightd', '--version']\n"
        "try:\n    main()\nexcept SystemExit:\n    pass\n"
        "import cv2\n"
        "cv2.VideoCapture('/dev/video9', cv2.CAP_V4L2)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, timeout=60, check=True
    )
    assert done.stderr == ""


def test_a_video_is_counted_picture_by_picture(video: Path) -> None:
    code, shown = on_a_terminal("detect", video)
    assert code == 0
    assert "detecting" in shown
    assert len(set(re.findall(r"\d+%", shown))) > 2, "not only its begin and end"


def test_a_replay_shows_how_far_it_is() -> None:
    log = next(ROOT.glob("tests/replay/flights/*.mcap"))
    _, shown = on_a_terminal("replay", log, "--tolerance", "1e-6")
    assert "deciding" in shown
    assert len(set(re.findall(r"\d+%", shown))) > 2
    assert "seeing" in shown
