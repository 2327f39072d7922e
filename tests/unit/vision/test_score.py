"""Who matches whom, what is missed, what is false, and how far off a match is."""

from __future__ import annotations

import math

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flightd.core.geometry import normalise_line
from flightd.core.types import Junction, JunctionKind, Line, LineSet
from flightd.vision.training.labelled_frames import Grade, LabelledImage, LabelledLine, LabelledNode
from flightd.vision.training.line_score import Gate, LineScore, score_picture

WIDTH, HEIGHT = 640, 360


def label(rho: float, theta: float, half: float = 150.0, grade: Grade = "main") -> LabelledLine:
    """A line through the foot of its normal, `half` px to either side."""
    c, s = math.cos(theta), math.sin(theta)
    x, y = rho * c + (WIDTH - 1) / 2, rho * s + (HEIGHT - 1) / 2
    return LabelledLine(
        x1=x + half * s, y1=y - half * c, x2=x - half * s, y2=y + half * c, thickness=20.0, grade=grade
    )


def line(rho: float, theta: float) -> Line:
    rho, theta = normalise_line(rho, theta)
    return Line(rho, theta, 20.0, -150.0, 150.0, 1.0, 0.1, 0.001)


def seen(*lines: Line, junctions: tuple[Junction, ...] = ()) -> LineSet:
    return LineSet(0, 0, WIDTH, HEIGHT, lines, junctions, "combined")


def shown(
    *lines: LabelledLine, complete: bool = True, nodes: list[LabelledNode] | None = None
) -> LabelledImage:
    return LabelledImage(file="a.png", lines=list(lines), complete=complete, nodes=nodes or [])


def scored(picture: LabelledImage, found: LineSet) -> LineScore:
    score = LineScore()
    score_picture(score, picture, found, Gate())
    return score


@given(
    rho=st.floats(-150, 150),
    theta=st.floats(0, 3.14),
    off=st.floats(-10, 10),
    turn=st.floats(-0.03, 0.03),
)
def test_errors_are_those_of_rho_and_theta_also_where_theta_wraps(
    rho: float, theta: float, off: float, turn: float
) -> None:
    score = scored(shown(label(rho, theta)), seen(line(rho + off, theta + turn)))
    assert score.missed == score.false == 0
    (error,) = score.errors
    assert error.rho_px == pytest.approx(abs(off), abs=1e-6)
    assert error.theta_rad == pytest.approx(abs(turn), abs=1e-9)
    assert error.rho_sigmas == pytest.approx(abs(off) / 0.1, abs=1e-4)


def test_the_doubt_of_the_label_is_part_of_the_error() -> None:
    doubted = msgspec.structs.replace(label(0, 0.5), uncert_px=2.0, uncert_deg=0.5)
    (error,) = scored(shown(doubted), seen(line(2, 0.5 + math.radians(0.25)))).errors
    assert error.rho_sigmas == pytest.approx(1.0, rel=0.01)
    assert error.theta_sigmas == pytest.approx(0.5, rel=0.01)


def test_the_part_within_a_sigma_is_counted() -> None:
    score = scored(shown(label(0, 0.5), label(60, 0.5)), seen(line(0.05, 0.5), line(60.5, 0.5)))
    assert score.within_sigma_parts() == (0.5, 1.0)
    assert all(map(math.isnan, LineScore().within_sigma_parts()))


def test_a_line_beyond_the_gate_is_missed_and_its_detection_false() -> None:
    for found in (line(40, 0.5), line(0, 0.5 + math.radians(6))):
        score = scored(shown(label(0, 0.5)), seen(found))
        assert (score.labelled, score.missed, score.detected, score.false) == (1, 1, 1, 1)


def test_two_detections_of_one_line_are_one_match_and_one_false() -> None:
    score = scored(shown(label(0, 0.5)), seen(line(3, 0.5), line(1, 0.5)))
    assert [error.rho_px for error in score.errors] == [pytest.approx(1.0)]
    assert (score.missed, score.false) == (0, 1)


def test_parallel_lines_closer_than_the_gate_are_each_matched_by_their_own() -> None:
    score = scored(shown(label(0, 0.5), label(20, 0.5)), seen(line(21, 0.5), line(1, 0.5)))
    assert [error.rho_px for error in score.errors] == [pytest.approx(1.0)] * 2
    assert score.missed == score.false == 0


def stretch(first: float, last: float, across: float = 0.0, turn: float = 0.0) -> LabelledLine:
    """A piece of a level line, from and to so far from the picture's middle."""
    (x1, x2), y = (at + (WIDTH - 1) / 2 for at in (first, last)), across + (HEIGHT - 1) / 2
    return LabelledLine(x1=x1, y1=y, x2=x2, y2=y + (last - first) * math.tan(turn), thickness=20.0)


@pytest.mark.parametrize("reverse", [False, True])
def test_one_detection_finds_both_stretches_of_a_line_that_something_hides(reverse: bool) -> None:
    stretches = [stretch(-300, -60), stretch(40, 250, across=4)]
    score = scored(shown(*stretches[:: -1 if reverse else 1]), seen(line(2, math.pi / 2)))
    assert (score.labelled, score.missed, score.found_part, score.false) == (2, 0, 1.0, 0)
    assert sorted(error.rho_px for error in score.errors) == [pytest.approx(2.0)] * 2


@pytest.mark.parametrize(
    "other",
    [
        stretch(40, 250, across=11),  # beside the first one's paint
        stretch(-70, 250, across=4),  # side by side with it for a while
        stretch(40, 250, turn=math.radians(3.5)),
    ],
)
def test_two_lines_need_two_detections(other: LabelledLine) -> None:
    score = scored(shown(stretch(-300, -60), other), seen(line(2, math.pi / 2)))
    assert (score.labelled, score.missed, score.false) == (2, 1, 0)


def test_stretches_of_a_line_excuse_no_repeated_and_no_distant_detection() -> None:
    picture = shown(stretch(-300, -60), stretch(40, 250))
    thrice = scored(picture, seen(*(line(across, math.pi / 2) for across in (0, 1, 2))))
    assert (thrice.missed, thrice.detected, thrice.false) == (0, 3, 1)
    distant = scored(picture, seen(line(14, math.pi / 2)))
    assert (distant.missed, distant.found_part, distant.false) == (1, 0.0, 0)


def test_minor_lines_are_neither_missed_nor_false() -> None:
    picture = shown(label(0, 0.5, grade="minor"))
    for found in (seen(), seen(line(0, 0.5))):
        score = scored(picture, found)
        assert (score.labelled, score.missed, score.detected, score.false) == (0, 0, 0, 0)


def test_false_lines_count_only_where_every_line_is_labelled() -> None:
    assert scored(shown(), seen(line(0, 0.5))).false == 1
    incomplete = scored(shown(complete=False), seen(line(0, 0.5)))
    assert (incomplete.false, incomplete.detected) == (0, 0)


def test_found_is_stricter_than_matched() -> None:
    near = scored(shown(label(0, 0.5)), seen(line(12, 0.5)))
    far = scored(shown(label(0, 0.5)), seen(line(14, 0.5)))
    assert (near.found_part, far.found_part, far.missed_part) == (1.0, 0.0, 0.0)


def test_a_negative_is_clean_when_nothing_is_seen() -> None:
    score = LineScore()
    negative = LabelledImage(file="a.png", complete=True, negative=True)
    for found in (seen(), seen(line(0, 1.0))):
        score_picture(score, negative, found, Gate())
    assert (score.negatives, score.negatives_clean, score.false) == (2, 1, 1)


def test_nodes_are_found_by_place_and_named_by_kind() -> None:
    nodes = [LabelledNode(x=100.0, y=100.0, kind="+"), LabelledNode(x=400.0, y=200.0, kind="T")]
    nodes.append(LabelledNode(x=600.0, y=30.0, kind="bend"))
    found = (
        Junction(JunctionKind.CROSS, 100 - 319.5, 104 - 179.5),
        Junction(JunctionKind.CORNER, 400 - 319.5, 200 - 179.5),
        Junction(JunctionKind.CORNER, 600 - 319.5, 30 - 179.5),
        Junction(JunctionKind.END, 0.0, 0.0),
    )
    score = scored(shown(nodes=nodes), seen(junctions=found))
    assert (score.nodes_labelled, score.nodes_found, score.nodes_named) == (2, 2, 1)
    assert (score.nodes_detected, score.nodes_false) == (3, 1)
