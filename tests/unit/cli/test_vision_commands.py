"""detect, evaluate, bench and train-colour as their user meets them."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

from flightd.cli.main import app
from flightd.core.errors import InputError, UnavailableError
from flightd.sim.dataset.generate import generate, write_dataset

RUNNER = CliRunner()


def run(*arguments: object) -> str:
    """Standard output of a command that must succeed."""
    result = RUNNER.invoke(app, [str(argument) for argument in arguments])
    assert result.exit_code == 0, result.output + repr(result.exception)
    return result.stdout


def error_of(*arguments: object) -> str:
    """The one line of a command that must refuse its input."""
    result = RUNNER.invoke(app, [str(argument) for argument in arguments])
    assert isinstance(result.exception, InputError | UnavailableError), result.output + repr(result.exception)
    text = str(result.exception)
    assert "\n" not in text
    return text


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("dataset")
    write_dataset(folder, "clean", 4, 40, 640, 360, colour="yellow", layout="cross", masks=True)
    return folder


@pytest.fixture
def picture(tmp_path: Path) -> Path:
    path = tmp_path / "floor.png"
    cv2.imwrite(str(path), generate("clean", 3, 640, 360, colour="yellow", layout="cross").bgr)
    return path


def test_detect_gives_lines_and_junctions_as_the_contract_says(picture: Path) -> None:
    truth = generate("clean", 3, 640, 360, colour="yellow", layout="cross").label
    (image,) = json.loads(run("detect", picture, "--json"))["images"]
    assert {"path", "width", "height", "ms", "lines", "junctions"} <= image.keys()
    assert (image["path"], image["width"], image["height"]) == (str(picture), 640, 360)
    assert len(image["lines"]) == 2
    for line in image["lines"]:
        assert {"rho_px", "theta_deg", "x1", "y1", "x2", "y2", "width_px", "kind"} <= line.keys()
        c, s = (f(math.radians(line["theta_deg"])) for f in (math.cos, math.sin))
        for x, y in ((line["x1"], line["y1"]), (line["x2"], line["y2"])):
            assert (x - 319.5) * c + (y - 179.5) * s == pytest.approx(line["rho_px"], abs=0.02)
        errors = [abs(abs(t.hessian(640, 360)[0]) - abs(line["rho_px"])) for t in truth.lines]
        assert min(errors) < 0.5
        assert line["kind"] in ("vertical", "horizontal")
    (junction,) = image["junctions"]
    assert junction["kind"] == "cross"
    assert junction["x"] == pytest.approx(truth.nodes[0].x, abs=2.0)
    assert junction["y"] == pytest.approx(truth.nodes[0].y, abs=2.0)


@pytest.mark.parametrize("method", ["centroid", "skeleton", "combined", "naive"])
def test_every_method_can_be_asked_for(picture: Path, method: str) -> None:
    (image,) = json.loads(run("detect", picture, "--method", method, "--json"))["images"]
    assert len(image["lines"]) >= 2


def test_detect_tells_people_the_same(picture: Path) -> None:
    text = run("detect", picture)
    assert str(picture) in text
    assert "cross at" in text


def test_a_folder_and_a_video_are_read_frame_by_frame(dataset: Path, tmp_path: Path) -> None:
    frames = [cv2.imread(str(path)) for path in sorted(dataset.glob("clean-*[0-9].png"))]
    clip = tmp_path / "clip.avi"
    writer = cv2.VideoWriter(str(clip), cv2.VideoWriter.fourcc(*"MJPG"), 10, (640, 360))
    for frame in frames:
        assert frame is not None
        writer.write(frame)
    writer.release()
    images = json.loads(run("detect", clip, dataset, "--json"))["images"]
    assert [image["path"] for image in images[:4]] == [f"{clip}#{n}" for n in range(4)]
    assert len(images) == 4 + len(list(dataset.glob("*.png")))


def test_overlays_are_pictures_of_the_frames_size_and_never_overwrite_each_other(tmp_path: Path) -> None:
    bgr = generate("clean", 3, 640, 360, colour="yellow", layout="cross").bgr
    for folder, suffix in (("a", "png"), ("b", "png"), ("b", "jpg")):
        (tmp_path / folder).mkdir(exist_ok=True)
        cv2.imwrite(str(tmp_path / folder / f"floor.{suffix}"), bgr)
    run("detect", tmp_path / "a", tmp_path / "b", "--overlay", tmp_path / "out")
    written = sorted((tmp_path / "out").iterdir())
    assert [path.name for path in written] == ["floor-2.jpg", "floor-3.jpg", "floor.jpg"]
    for path in written:
        drawn = cv2.imread(str(path))
        assert drawn is not None
        assert drawn.shape == bgr.shape
        assert np.abs(drawn.astype(int) - bgr).max() > 80


def plain(bgr: np.ndarray) -> np.ndarray:
    return bgr


def grey(bgr: np.ndarray) -> np.ndarray:
    """Grey as a camera with a colour profile of white lines would give: the paint is brighter."""
    return np.asarray(cv2.cvtColor(bgr, cv2.COLOR_BGR2GRAY))


def deep(bgr: np.ndarray) -> np.ndarray:
    return bgr.astype(np.uint16) * 257


def transparent(bgr: np.ndarray) -> np.ndarray:
    return np.dstack([bgr, np.full(bgr.shape[:2], 255, np.uint8)])


@pytest.mark.parametrize("change", [plain, grey, deep, transparent])
@pytest.mark.parametrize("suffix", [".png", ".tiff"])
def test_every_kind_of_pixel_gives_the_right_lines(tmp_path: Path, change, suffix: str) -> None:  # type: ignore[no-untyped-def]
    frame = generate("clean", 5, 640, 360, colour="white", layout="single")
    path = tmp_path / f"floor{suffix}"
    cv2.imwrite(str(path), change(frame.bgr))
    (image,) = json.loads(run("detect", path, "--profile", "white", "--json"))["images"]
    (line,) = image["lines"]
    assert abs(line["rho_px"]) == pytest.approx(abs(frame.label.lines[0].hessian(640, 360)[0]), abs=0.5)


@pytest.mark.parametrize(
    "content", [b"", b"no picture", b"\x89PNG\r\n\x1a\n" + bytes(50), b"\xff\xd8\xff\xe0" + bytes(100)]
)
def test_a_damaged_image_is_named(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "damaged.png"
    path.write_bytes(content)
    assert str(path) in error_of("detect", path)


def test_a_damaged_video_is_named(tmp_path: Path) -> None:
    path = tmp_path / "damaged.mp4"
    path.write_bytes(b"no video" * 100)
    assert str(path) in error_of("detect", path)


def test_a_pipe_is_refused_and_not_waited_for(tmp_path: Path) -> None:
    path = tmp_path / "pipe.png"
    os.mkfifo(path)
    assert str(path) in error_of("detect", path)
    assert str(path) in error_of("detect", tmp_path)


def test_a_tiny_image_is_named(tmp_path: Path) -> None:
    path = tmp_path / "tiny.png"
    cv2.imwrite(str(path), np.zeros((3, 5, 3), np.uint8))
    message = error_of("detect", path)
    assert str(path) in message
    assert "5x3" in message


@pytest.mark.parametrize("bgr", [(30, 190, 225), (0, 0, 0), (255, 255, 255)])
@pytest.mark.parametrize("method", ["centroid", "skeleton", "combined", "naive"])
def test_a_picture_of_one_colour_shows_no_line(
    tmp_path: Path, bgr: tuple[int, int, int], method: str
) -> None:
    path = tmp_path / "plain.png"
    cv2.imwrite(str(path), np.full((360, 640, 3), bgr, np.uint8))
    for profile in ("yellow", "white", "black"):
        found = run("detect", path, "--profile", profile, "--method", method, "--json")
        assert json.loads(found)["images"][0]["lines"] == []


def test_a_huge_image_is_searched(tmp_path: Path) -> None:
    bgr = np.full((5000, 7000, 3), (110, 112, 114), np.uint8)
    bgr[:, 3000:3200] = (30, 190, 225)
    path = tmp_path / "huge.jpg"
    cv2.imwrite(str(path), bgr)
    (line,) = json.loads(run("detect", path, "--json"))["images"][0]["lines"]
    assert line["x1"] == pytest.approx(3099.5, abs=1.0)
    assert line["width_px"] == pytest.approx(200, abs=4)


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["detect", "nowhere.png"], "nowhere.png"),
        (["detect", "."], "."),
        (["detect", "floor.png", "--method", "magic"], "magic"),
        (["detect", "floor.png", "--profile", "purple"], "purple"),
        (["evaluate", "nowhere"], "nowhere"),
        (["evaluate", ".", "--method", "magic"], "magic"),
    ],
)
def test_bad_arguments_are_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str], named: str
) -> None:
    (tmp_path / "empty").mkdir()
    cv2.imwrite(str(tmp_path / "floor.png"), np.zeros((64, 64, 3), np.uint8))
    monkeypatch.chdir(tmp_path / "empty" if arguments[1] == "." else tmp_path)
    assert named in error_of(*arguments)


def test_bad_input_exits_with_two_and_one_line(tmp_path: Path) -> None:
    path = tmp_path / "damaged.png"
    path.write_bytes(b"no picture")
    done = subprocess.run(
        [sys.executable, "-m", "flightd", "detect", str(path), "--json"],
        cwd=Path(__file__).parents[3], capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.startswith("flightd: ")
    assert done.stderr.count("\n") == 1


def test_evaluate_measures_all_methods_beside_the_paper(dataset: Path) -> None:
    document = json.loads(run("evaluate", dataset, "--json"))
    assert document["pictures"] == 4
    assert list(document["methods"]) == ["naive", "centroid", "skeleton", "combined"]
    combined = document["methods"]["combined"]
    assert combined["lines"] == 8
    assert combined["missed"] == combined["false"] == 0
    assert combined["rho_p95_px"] < 0.3
    assert combined["paper"]["simulation"] == {"rho_mean_px": 6.0, "theta_mean_deg": 3.0}
    text = run("evaluate", dataset)
    for method in document["methods"]:
        assert method in text


def test_evaluate_shows_what_went_wrong(dataset: Path, tmp_path: Path) -> None:
    document = json.loads(
        run("evaluate", dataset, "--method", "combined", "--profile", "blue", "--overlay", tmp_path, "--json")
    )
    assert document["methods"]["combined"]["missed"] == 8
    assert len(document["failures"]) == 4
    assert len(list(tmp_path.glob("*-combined.jpg"))) == 4


def test_evaluate_refuses_a_picture_of_another_size(tmp_path: Path) -> None:
    write_dataset(tmp_path, "clean", 1, 0, 320, 180)
    (picture,) = tmp_path.glob("*.png")
    cv2.imwrite(str(picture), np.zeros((90, 160, 3), np.uint8))
    message = error_of("evaluate", tmp_path)
    assert picture.name in message
    assert "320x180" in message


def test_a_profile_trained_on_masks_finds_its_lines(tmp_path: Path, dataset: Path) -> None:
    pytest.importorskip("sklearn")
    lessons = tmp_path / "lessons"
    write_dataset(lessons, "clean", 30, 80, 320, 180, colour="yellow", layout="single", masks=True)
    profile = tmp_path / "mine.npz"
    report = json.loads(run("train-colour", lessons, "--colour", "yellow", "--out", profile, "--json"))
    assert report["name"] == "mine"
    assert report["cross_validated"]["balanced_accuracy"] > 0.93
    assert profile.stat().st_size < 200_000
    document = json.loads(run("evaluate", dataset, "--profile", profile, "--method", "combined", "--json"))
    assert document["methods"]["combined"]["missed"] == 0
    first = profile.read_bytes()
    run("train-colour", lessons, "--colour", "yellow", "--out", profile)
    assert profile.read_bytes() == first


def test_a_profile_can_be_taught_by_lines_or_by_strokes(tmp_path: Path) -> None:
    pytest.importorskip("sklearn")
    write_dataset(tmp_path, "clean", 6, 90, 320, 180, colour="red", layout="single")
    by_lines = json.loads(
        run("train-colour", tmp_path, "--colour", "red", "--out", tmp_path / "l.npz", "--json")
    )
    assert by_lines["cross_validated"]["balanced_accuracy"] > 0.93

    labels = json.loads((tmp_path / "labels.json").read_text())
    for image in labels["images"]:
        (line,) = image["lines"]
        ends = [[line["x1"], line["y1"]], [line["x2"], line["y2"]]]
        image["regions"] = [
            {"paint": False, "box": [0, 0, 320, 180]},
            {"paint": False, "stroke": ends, "width": line["thickness"] * 1.6 + 4},
            {"paint": True, "stroke": ends, "width": line["thickness"] * 0.6},
        ]
        image["lines"] = []
    (tmp_path / "labels.json").write_text(json.dumps(labels))
    by_strokes = json.loads(
        run("train-colour", tmp_path, "--colour", "red", "--out", tmp_path / "s.npz", "--json")
    )
    assert by_strokes["strong_colours"] > 100


def test_training_without_paint_says_so(dataset: Path, tmp_path: Path) -> None:
    assert "line_colour" in error_of(
        "train-colour", dataset, "--colour", "green", "--out", tmp_path / "g.npz"
    )


def test_bench_measures_every_method_in_units_of_a_conversion() -> None:
    document = json.loads(run("bench", "--seconds", "0.02", "--frames", "4", "--one-core", "--json"))
    assert document["levels"] == ["clean", "perturbed", "hard", "rough"]
    rows = {(row["method"], row["width"]): row for row in document["results"]}
    for width in (1920, 640):
        assert rows["cvtColor", width]["cvtcolor_units"] == 1.0
        for method in ("centroid", "skeleton", "combined", "naive", "LSD + merging"):
            assert rows[method, width]["fps_one_core"] > 0
        for method in ("combined", "combined, in flight"):
            assert rows[method, width]["frames"] == 4
            assert min(rows[method, width]["ms_median_of_level"].values()) > 0
        assert {"pads", "features", "markers"} < rows["combined, in flight", width]["stages_ms"].keys()
    assert rows["centroid", 1920]["paper_fps"] == {"on_board": 4.23, "off_board": 15.1}


def test_help_is_quick_because_nothing_heavy_is_imported() -> None:
    heavy = ("cv2", "numpy", "sklearn", "rich.table")
    code = f"import sys, flightd.cli.main; print([m for m in {heavy} if m in sys.modules])"
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=Path(__file__).parents[3], capture_output=True, text=True, timeout=60, check=True,
    )  # fmt: skip
    assert done.stdout.strip() == "[]"
