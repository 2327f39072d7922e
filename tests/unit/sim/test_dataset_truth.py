"""The generated frames show exactly the lines that their labels tell."""

from __future__ import annotations

import math

import numpy as np
import pytest

from flightd.sim.dataset.generate import COLOURS, generate
from flightd.sim.dataset.paint import Bend, coverage
from flightd.sim.dataset.scenes import (
    LAYOUTS,
    Scene,
    SceneBand,
    random_scene,
    truth_lines,
    truth_nodes,
    visible_span,
)
from flightd.sim.dataset.severity import LEVELS
from flightd.vision.training.labelled_frames import LabelledLine


def measured_line(paint: np.ndarray, line: LabelledLine) -> tuple[float, float]:
    """(px at the middle of the span, degrees) from the label to the paint's own axis, by moments."""
    height, width = paint.shape
    rho, theta = line.hessian(width, height)
    c, s = math.cos(theta), math.sin(theta)
    y, x = np.mgrid[0:height, 0:width].astype(float)
    x, y = x - (width - 1) / 2, y - (height - 1) / 2
    across, along = x * c + y * s - rho, y * c - x * s
    reach = line.thickness / 2 + 3
    band = SceneBand(rho, theta, line.thickness)
    spans = [visible_span(band, width, height, side * reach) for side in (-1, 1)]
    start, end = max(span[0] for span in spans if span), min(span[1] for span in spans if span)
    ends = sorted(
        (_along(line.x1, line.y1, width, height, theta), _along(line.x2, line.y2, width, height, theta))
    )
    start, end = max(start, ends[0] + 2), min(end, ends[1] - 2)
    inside = (np.abs(across) < reach) & (along > start) & (along < end)
    weight, offset, place = paint[inside].astype(float), across[inside], along[inside]
    slope, intercept = np.polyfit(place, offset, 1, w=np.sqrt(weight))
    middle = float(np.average(place, weights=weight))
    return float(intercept + slope * middle), float(math.degrees(math.atan(slope)))


def _along(x: float, y: float, width: int, height: int, theta: float) -> float:
    return (y - (height - 1) / 2) * math.cos(theta) - (x - (width - 1) / 2) * math.sin(theta)


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("size", [(640, 360), (960, 540)])
def test_paint_lies_within_two_hundredths_of_a_pixel_of_its_label(seed: int, size: tuple[int, int]) -> None:
    frame = generate("clean", seed, *size, layout="single")
    (line,) = frame.label.lines
    rho_error, theta_error = measured_line(frame.paint, line)
    assert abs(rho_error) < 0.02
    assert abs(theta_error) < 0.01


def test_the_picture_itself_is_centred_on_the_label() -> None:
    """Colour, blur and noise move nothing: the contrast's centroid agrees too, to the noise."""
    errors = []
    for seed in range(8):
        frame = generate("clean", seed, 960, 540, colour="white", layout="single")
        grey = frame.bgr.astype(float).mean(axis=2)
        contrast = np.clip(grey - np.median(grey) - 8, 0, None)
        errors.append(measured_line(contrast, frame.label.lines[0])[0])
    assert np.abs(errors).max() < 0.06
    assert abs(np.mean(errors)) < 0.02


def test_the_edge_of_a_vertical_band_is_where_it_was_asked_for() -> None:
    scene = Scene(64, 48, "single", (SceneBand(rho=3.3, theta=0.0, thickness=10.0),))
    row = coverage(scene, Bend())[20]
    x = np.arange(64) - 31.5
    assert row.sum() == pytest.approx(10.0, abs=1e-4)
    assert (row * x).sum() / row.sum() == pytest.approx(3.3, abs=0.01)


def test_residual_distortion_moves_paint_and_label_together() -> None:
    for seed in range(6):
        frame = generate("hard", seed, 1920, 1080, layout="single")
        clean_paint = frame.paint
        rho_error, _ = measured_line(clean_paint, frame.label.lines[0])
        # worn paint is ragged, so its centroid is looser than the truth
        assert abs(rho_error) < 0.15 * frame.label.lines[0].thickness + 0.3


@pytest.mark.parametrize("level", LEVELS)
def test_the_same_seed_gives_the_same_frame(level: str) -> None:
    first, again = (generate(level, 7, 320, 180) for _ in range(2))
    assert np.array_equal(first.bgr, again.bgr)
    assert first.label == again.label


def test_different_seeds_and_levels_give_different_frames() -> None:
    frames = [generate(level, seed, 320, 180).bgr for level in LEVELS for seed in range(3)]
    assert len({frame.tobytes() for frame in frames}) == len(frames)


def test_a_hundred_seeds_show_every_colour_and_layout() -> None:
    rngs = [np.random.default_rng(seed) for seed in range(100)]
    assert {random_scene(rng, 640, 360).layout for rng in rngs} == set(LAYOUTS)
    assert {generate("clean", seed, 160, 90).label.line_colour for seed in range(40)} == set(COLOURS)


def test_negative_frames_have_no_line_and_say_so() -> None:
    frame = generate("hard", 3, 320, 180, layout="negative")
    assert frame.label.negative
    assert frame.label.lines == []
    assert not frame.paint.any()


@pytest.mark.parametrize(
    ("layout", "kinds"),
    [
        ("cross", ["+"]),
        ("tee", ["T"]),
        ("corner", ["L"]),
        ("end", ["end"]),
        ("grid", ["+", "+"]),
        ("single", []),
        ("parallel", []),
    ],
)
def test_each_layout_has_its_nodes(layout: str, kinds: list[str]) -> None:
    for seed in range(20):
        scene = random_scene(np.random.default_rng(seed), 1920, 1080, layout)  # type: ignore[arg-type]
        found = [node.kind for node in truth_nodes(scene)]
        assert len(found) <= len(kinds)
        assert set(found) <= set(kinds)
        if layout != "grid":
            assert found == kinds


def test_a_line_of_which_only_one_edge_is_in_the_picture_is_minor() -> None:
    scene = Scene(640, 360, "single", (SceneBand(rho=318.0, theta=0.0, thickness=40.0),))
    assert [line.grade for line in truth_lines(scene)] == ["minor"]


def test_a_label_gives_back_the_hessian_form_it_was_made_of() -> None:
    rng = np.random.default_rng(5)
    for _ in range(200):
        theta = rng.uniform(0, math.pi)
        scene = Scene(
            640, 360, "single", (SceneBand(rho=rng.uniform(-150, 150), theta=theta, thickness=12.0),)
        )
        (line,) = truth_lines(scene)
        rho, angle = line.hessian(640, 360)
        assert rho == pytest.approx(scene.bands[0].rho, abs=1e-6)
        assert angle == pytest.approx(theta, abs=1e-9)
