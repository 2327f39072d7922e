"""Frames of the rough world's floor: their labels tell what paint there is left to see, and where."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from flightd.core.errors import InputError
from flightd.sim.dataset.floor_labels import FloorSight, floor_labels
from flightd.sim.dataset.generate import LEVEL_NAMES, frame_of_any_level, write_dataset
from flightd.sim.dataset.rough_floor import FRAMES_A_HALL, RoughHall, rough_frame
from flightd.sim.floor.paint_damage import Stripe
from flightd.sim.plant.kinematics import Kinematics
from flightd.sim.sensors.optics import SimCamera, wide_lens
from flightd.sim.unknowns import Unknowns, WorldKind, unknowns_of
from flightd.vision.line_detector import Detector
from flightd.vision.training.labelled_frames import LabelledImage, LabelledLine
from flightd.vision.training.line_score import Gate, LineScore, score_picture

WIDTH, HEIGHT = 640, 360
CAMERA = SimCamera(lens=replace(wide_lens(WIDTH, HEIGHT), distortion=(0.0, 0.0, 0.0, 0.0, 0.0)))
ABOVE = Kinematics(0, 0.0, 0.0, 1.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
"""At rest, level, nose along x: the picture's up."""
GUIDE = Stripe(0.0, 0.0, 8.0, 0.08, 0.0)


def labels_of(
    *stripes: Stripe, hidden: tuple[tuple[float, float, float, float], ...] = ()
) -> tuple[list[LabelledLine], list[str]]:
    lines, nodes = floor_labels(stripes, hidden, FloorSight(CAMERA, ABOVE))
    return lines, sorted(node.kind for node in nodes)


def test_a_line_straight_below_runs_up_the_middle_of_the_picture() -> None:
    (line,), nodes = labels_of(GUIDE)
    assert line.grade == "main"
    assert nodes == []
    rho, theta = line.hessian(WIDTH, HEIGHT)
    assert rho == pytest.approx(0.0, abs=1e-6)
    assert math.sin(theta) == pytest.approx(0.0, abs=1e-9)
    assert line.thickness == pytest.approx(0.08 / 1.5 * CAMERA.lens.fx_px, rel=1e-6)


def test_paint_that_is_gone_is_no_line_and_its_end_no_node() -> None:
    lines, nodes = labels_of(GUIDE, hidden=((-0.1, -0.06, 0.3, 0.06),))
    assert len(lines) == 2
    assert min(line.length_px for line in lines) > 50
    covered_px = sum(line.length_px for line in lines)
    assert covered_px == pytest.approx(HEIGHT - 0.4 / 1.5 * CAMERA.lens.fy_px, abs=0.5)
    assert nodes == ["bend", "bend"]


def test_a_line_that_is_covered_all_over_need_not_be_found() -> None:
    assert labels_of(GUIDE, hidden=((-4.0, -0.1, 4.0, 0.1),))[0] == []


def test_a_line_of_which_a_part_of_the_width_is_covered_may_be_found() -> None:
    lines, _ = labels_of(GUIDE, hidden=((-4.0, 0.0, 4.0, 0.5),))
    assert [line.grade for line in lines] == ["minor"]


def test_a_line_that_no_map_has_is_paint_like_any_other() -> None:
    false = Stripe(0.1, 0.4, 1.0, 0.06, 0.2)
    lines, nodes = labels_of(GUIDE, false)
    assert [line.grade for line in lines] == ["main", "main"]
    assert nodes == ["end", "end"]


def test_a_faded_line_and_what_meets_it_may_be_found_or_not() -> None:
    faded = [Stripe(0.1, 0.0, 1.0, 0.06, math.pi / 2), Stripe(0.0, 0.3, 8.0, 0.06, 0.0)]
    lines, nodes = floor_labels([GUIDE], (), FloorSight(CAMERA, ABOVE), faded)
    assert [line.grade for line in lines] == ["main", "minor", "minor"]
    assert {node.kind for node in nodes} == {"bend"}
    assert len(nodes) == 4, "two crossings, two ends"


def test_a_crossing_below_a_pallet_may_be_told_or_not() -> None:
    across = Stripe(0.0, 0.0, 1.2, 0.08, math.pi / 2)
    assert labels_of(GUIDE, across)[1] == ["+", "end", "end"]
    nodes = labels_of(GUIDE, across, hidden=((-0.2, -0.2, 0.2, 0.2),))[1]
    assert nodes == ["bend"] * 5 + ["end", "end"]


def test_a_row_shows_the_floor_of_its_own_time() -> None:
    rolled = FloorSight(replace(CAMERA, readout_s=0.02), replace(ABOVE, vy_mps=1.0))
    points = np.array([(0.5, 0.0), (0.0, 0.0), (-0.5, 0.0)])
    moved_px = (rolled.pixels(points) - FloorSight(CAMERA, ABOVE).pixels(points))[:, 0]
    # the upper rows are read first, when the camera was still further left
    assert moved_px[0] > 1.0
    assert moved_px[1] == pytest.approx(0.0, abs=0.05)
    assert moved_px[2] == pytest.approx(-moved_px[0], abs=0.05)


def found_in(*halls: RoughHall) -> LineScore:
    score, detector = LineScore(), Detector("combined", "yellow")
    for hall in halls:
        for number in range(FRAMES_A_HALL):
            bgr, label = hall.frame(number)
            score_picture(score, label, detector.detect(bgr), Gate())
    assert score.labelled > 10
    assert score.missed_part < 0.1
    return score


def test_the_paint_lies_where_the_labels_say(monkeypatch: pytest.MonkeyPatch) -> None:
    def still(kind: WorldKind, seed: int) -> Unknowns:
        return replace(unknowns_of(kind, seed), shake_rad=0.0)

    monkeypatch.setattr("flightd.sim.dataset.rough_floor.unknowns_of", still)
    score = found_in(*(RoughHall(seed, WIDTH, HEIGHT, "yellow") for seed in range(2)))
    assert np.median(score.rho_px()) < 0.1
    assert np.median(np.degrees(score.theta_rad())) < 0.05


def test_labels_tell_where_the_paint_is_on_average_while_the_camera_vibrates() -> None:
    """Nearly: an edge is seen where the camera lingers, not at the mean of what it sweeps, 9 px."""
    score = found_in(*(RoughHall(seed, WIDTH, HEIGHT, "yellow") for seed in range(2)))
    assert np.median(score.rho_px()) < 0.8
    assert np.quantile(score.rho_px(), 0.9) < 2.5
    assert np.median(np.degrees(score.theta_rad())) < 0.1


def test_the_same_seed_gives_the_same_frame_whatever_was_drawn_before() -> None:
    first, label = rough_frame(7, 320, 180)
    rough_frame(FRAMES_A_HALL, 320, 180)
    again, same = rough_frame(7, 320, 180)
    assert np.array_equal(first, again)
    assert label == same
    assert not np.array_equal(first, rough_frame(8, 320, 180)[0])


@pytest.mark.parametrize("level", LEVEL_NAMES)
def test_a_frame_of_each_level_has_its_label(level: str) -> None:
    bgr, label = frame_of_any_level(level, 3, 320, 180, "red")
    assert bgr.shape == (180, 320, 3)
    assert isinstance(label, LabelledImage)
    assert (label.line_colour, label.width, label.complete) == ("red", 320, True)


def test_a_rough_floor_has_no_layout_and_no_masks(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no layouts and no masks"):
        write_dataset(tmp_path / "a", "rough", 1, 0, 320, 180, layout="single")
    with pytest.raises(InputError, match="no layouts and no masks"):
        write_dataset(tmp_path / "b", "rough", 1, 0, 320, 180, masks=True)


def test_a_rough_dataset_is_written(tmp_path: Path) -> None:
    write_dataset(tmp_path, "rough", 2, 10, 320, 180)
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "labels.json", "rough-000010.png", "rough-000011.png",
    ]  # fmt: skip
