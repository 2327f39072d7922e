"""The dataset format: what it takes, and what it says when it cannot."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from flightd.core.errors import InputError
from flightd.vision.training.labelled_frames import (
    LabelledImage,
    LabelledLine,
    LabelledNode,
    Labels,
    read_labels,
    write_labels,
)

REAL = Path(__file__).resolve().parents[4] / "shared" / "real" / "lines"


def test_labels_survive_their_file(tmp_path: Path) -> None:
    line = LabelledLine(x1=0.1234, y1=5.0, x2=100.0, y2=7.25, thickness=20.0)
    image = LabelledImage(
        file="a.png", width=640, height=360, lines=[line], nodes=[LabelledNode(x=1.0, y=2.0, kind="T")]
    )
    write_labels(tmp_path, Labels(images=[image], about={"by": "hand"}))
    folder, again = read_labels(tmp_path)
    assert folder == tmp_path
    assert again.images == [image]


def test_a_labels_file_may_be_named_itself(tmp_path: Path) -> None:
    write_labels(tmp_path, Labels(images=[LabelledImage(file="a.png")]))
    assert read_labels(tmp_path / "labels.json")[0] == tmp_path


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('{"images": [{"width": 3}]}', r"`file`.*images\[0\]"),
        ('{"images": [{"file": "a", "lines": [{"x1": "zero"}]}]}', r"images\[0\]\.lines\[0\]\.x1"),
        ('{"images": []}', r"`images` is empty"),
        ("not json", r"labels\.json: .*malformed"),
        ('{"images": [{"file": "a", "nodes": [{"x": 1, "y": 2, "kind": "star"}]}]}', "star"),
    ],
)
def test_a_malformed_file_is_named_with_the_key(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "labels.json").write_text(text)
    with pytest.raises(InputError, match=message) as caught:
        read_labels(tmp_path)
    assert "labels.json" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_missing_dataset_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="nowhere"):
        read_labels(tmp_path / "nowhere")


def test_hessian_form_is_about_the_image_centre() -> None:
    line = LabelledLine(x1=10.0, y1=0.0, x2=10.0, y2=99.0)
    rho, theta = line.hessian(101, 100)
    assert abs(rho) == pytest.approx(40.0)
    assert math.isclose(rho * math.cos(theta), -40.0)


@pytest.mark.skipif(not REAL.is_dir(), reason="the labelled photographs are not here")
def test_the_photographs_are_a_dataset_as_they_are() -> None:
    _, labels = read_labels(REAL)
    assert len(labels.images) >= 30
    assert sum(line.grade == "main" for image in labels.images for line in image.lines) > 40
    assert all((image.negative and not image.lines) or not image.negative for image in labels.images)
