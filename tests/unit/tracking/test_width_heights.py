"""When the lines' width is believed against the range finder, and when it is not."""

from __future__ import annotations

import math
import random
from collections.abc import Sequence

import pytest

from flightd.tracking.width_heights import NearFloor, WidthHeights, climbed_between_m


class Frames(WidthHeights):
    """So many frames a second."""

    def __init__(self, fps: float = 30.0) -> None:
        super().__init__()
        self._period_ns, self._at_ns = round(1e9 / fps), 0

    def sees(
        self, by_width_m: Sequence[float], told_m: float, climbed_m: tuple[float, float] = (0.0, 0.0)
    ) -> float:
        """What is believed of the next frame."""
        self._at_ns += self._period_ns
        return self.believed_m(by_width_m, told_m, self._at_ns, climbed_m)


def test_a_height_that_all_widths_contradict_is_theirs() -> None:
    heights = Frames()
    for _ in range(30):
        assert heights.sees([1.6], 1.62) == 1.62
    told = [heights.sees([1.6], 2.4) for _ in range(90)]
    assert told[-1] == 1.6
    assert heights.share == pytest.approx(1.5, abs=0.05)


def test_widths_that_contradict_each_other_tell_no_height() -> None:
    """Boards and boxes at the edge of the picture, taken for lines now and then."""
    heights, rng = Frames(), random.Random(3)
    for _ in range(30):
        heights.sees([1.6], 1.6)
    for _ in range(120):
        false = [rng.uniform(0.35, 1.3)]
        assert heights.sees(false, 1.6) == 1.6
        assert heights.share == 1.0


def test_a_range_finder_that_swings_is_contradicted_by_a_steady_width() -> None:
    heights = Frames()
    for n in range(90):
        heights.sees([1.6], 1.6 if n < 30 else (0.5 if n % 2 else 1.6))
    assert heights.share < 0.85


def test_without_widths_a_contradicted_height_is_put_right_by_what_they_said() -> None:
    heights = Frames()
    for n in range(120):
        heights.sees([1.6], 1.6 if n < 30 else 2.4)
    assert heights.sees([], 1.2) == pytest.approx(0.8, abs=0.02)


def test_one_width_that_agrees_is_enough_and_none_at_all_changes_nothing() -> None:
    heights = Frames()
    for _ in range(60):
        assert heights.sees([0.5, 1.6, 3.0], 1.62) == 1.62
    assert heights.sees([], 1.62) == 1.62
    assert heights.sees([1.5, 1.6, 1.7], float("nan")) == 1.6


def test_a_height_that_leaps_away_from_a_width_is_not_believed_for_one_frame() -> None:
    heights = Frames()
    for _ in range(30):
        heights.sees([1.6], 1.6)
    assert heights.sees([1.59], 0.9) == 1.59
    assert heights.sees([1.58], 1.58) == 1.58


@pytest.mark.parametrize("climb_mps", [-1.0, 1.0])
def test_what_a_late_range_finder_tells_in_a_climb_does_not_contradict_the_widths(climb_mps: float) -> None:
    """0.1 s late by itself, over a frame that is 40 ms later than it is thought to be."""
    told, at_once = Frames(), Frames()
    between_m = climbed_between_m(climb_mps, 0.02)
    assert between_m == pytest.approx(sorted((-0.04 * climb_mps, 0.14 * climb_mps)))
    for n in range(30):
        true_m = (0.5 if climb_mps > 0.0 else 1.5) + climb_mps * n / 30.0
        told.sees([true_m], true_m - 0.14 * climb_mps, between_m)
        at_once.sees([true_m], true_m - 0.14 * climb_mps)
    assert told.share == pytest.approx(1.0, abs=0.01)
    assert abs(at_once.share - 1.0) > 0.09


def test_what_no_climb_explains_contradicts_the_widths_by_the_rest() -> None:
    """One that reads the half, as soon in a climb as in a hover; and one that is late the other way."""
    half, early = Frames(), Frames()
    for n in range(45):
        true_m = 0.3 + n / 30.0
        half.sees([true_m], 0.5 * true_m, climbed_between_m(1.0, 0.01))
        early.sees([1.5], 1.9, climbed_between_m(1.0, 0.01))
    assert half.share < 0.7
    assert early.share > 1.2
    assert climbed_between_m(math.nan, 0.03) == (0.0, 0.0)


def test_a_line_of_another_width_does_not_contradict_the_height_at_once() -> None:
    heights = Frames()
    for _ in range(30):
        heights.sees([1.6], 1.6)
    assert heights.sees([0.8], 1.6) == 1.6
    assert heights.sees([0.8], 1.6) == 1.6


def test_an_old_line_of_half_the_width_that_is_seen_alone_is_no_height() -> None:
    """As long as it takes to fly over it: what the picture moves by would be doubled."""
    heights = Frames()
    for _ in range(30):
        heights.sees([1.6], 1.6)
    for _ in range(45):
        assert heights.sees([3.25], 1.6) == 1.6
        assert heights.share == 1.0
    assert heights.sees([1.6, 3.25], 1.6) == 1.6


def test_a_width_after_a_climb_that_nobody_saw_is_held_against_the_height_at_once() -> None:
    """Blind for a while: both have changed alike, the range finder reads too much as before."""
    heights = Frames()
    for n in range(120):
        heights.sees([1.0], 1.0 if n < 30 else 1.5)
    assert heights.sees([1.6], 2.4) == pytest.approx(1.6, abs=0.02)


def test_once_contradicted_a_width_is_not_taken_for_being_nearer_to_what_is_wrong() -> None:
    heights = Frames()
    for _ in range(30):
        heights.sees([1.6, 1.45], 1.6)
    for n in range(30):
        assert heights.sees([1.6, 1.45 - 0.01 * n], 0.9) == 1.6


def test_a_scratch_that_agrees_with_what_leapt_away_from_the_lines_does_not_put_it_right() -> None:
    heights = Frames()
    for n in range(60):
        heights.sees([1.6], 1.6 if n < 30 else 5.8)
    for n in range(60):
        assert heights.sees([1.6, 1.7, 5.4] if n % 3 < 2 else [1.6], 5.8) == pytest.approx(1.6, abs=0.2)
    assert heights.sees([1.6, 5.4], 1.6) == 1.6, "right again, by the lines that were followed"


def test_widths_that_never_agreed_contradict_a_height_that_is_always_the_same_share_of_theirs() -> None:
    heights = Frames()
    for n in range(40):
        true_m = 0.3 + 0.03 * n
        heights.sees([true_m], 0.8 * true_m)
    assert heights.share == pytest.approx(0.8, abs=0.03)
    assert heights.off_m == pytest.approx(-0.2 * true_m, abs=0.06)


def test_false_widths_before_the_first_true_one_contradict_nothing() -> None:
    heights, rng = Frames(), random.Random(5)
    for _ in range(90):
        heights.sees([rng.uniform(0.35, 1.0)], 1.6)
    assert (heights.share, heights.off_m) == (1.0, 0.0)


@pytest.mark.parametrize("fps", [12.0, 15.0, 20.0, 30.0, 60.0])
def test_a_height_that_stuck_near_the_floor_is_contradicted_as_soon_by_a_slow_camera(fps: float) -> None:
    """From one of its pictures to the next the width of a line changes by more than a tenth."""
    heights = Frames(fps)
    true_m = 0.4
    while heights.share > 0.6:
        assert true_m < 1.2
        heights.sees([true_m], min(true_m, 0.45))
        true_m += 0.8 / fps


@pytest.mark.parametrize("fps", [10.0, 20.0, 60.0])
def test_false_widths_contradict_nothing_however_many_frames_there_are(fps: float) -> None:
    heights, rng = Frames(fps), random.Random(7)
    for _ in range(round(fps)):
        heights.sees([1.6], 1.6)
    for _ in range(round(4 * fps)):
        assert heights.sees([rng.uniform(0.35, 1.3)], 1.6) == 1.6
        assert heights.share == 1.0


def test_a_height_that_was_contradicted_is_put_right_down_to_the_floor() -> None:
    heights = Frames()
    for n in range(120):
        heights.sees([1.6], 1.6 if n < 30 else 3.2)
    for n in range(132):
        sunk_m = 1.6 - 0.011 * n
        believed_m = heights.sees([sunk_m], 2.0 * sunk_m)
    assert believed_m == pytest.approx(sunk_m, rel=0.1)
    assert sunk_m < 0.175


def test_a_range_finder_that_reads_its_least_above_a_drone_that_stands_is_right() -> None:
    """Doubted, it ended the take-off of every eighth flight whose camera saw lines from the floor."""
    heights = Frames()
    for _ in range(90):
        assert heights.sees([0.1], 0.3) == 0.3
    for n in range(30):
        climbed_m = 0.1 + 0.025 * n
        heights.sees([climbed_m], max(climbed_m, 0.3))
        assert heights.share == pytest.approx(1.0, abs=0.15)


def test_near_the_floor_the_widths_tell_the_height_and_higher_up_the_range_finder() -> None:
    """A range finder whose least reading is 0.3 m and that lags 0.1 s, in a take-off of 0.9 m/s."""
    heights, off = NearFloor(), []
    for frame in range(60):
        true_m = 0.2 + 0.9 * frame / 30.0
        told_m = max(true_m - 0.09, 0.3)
        off.append((true_m, heights.height_m([0.97 * true_m], told_m, frame * 33_333_333) / true_m))
    assert all(share == pytest.approx(0.97, abs=0.01) for true_m, share in off if 0.25 < true_m < 0.55)
    assert all(share > (true_m - 0.09) / true_m for true_m, share in off if 0.4 < true_m < 0.95)
    assert all(share * true_m == pytest.approx(true_m - 0.09) for true_m, share in off if true_m > 1.0)


@pytest.mark.parametrize("true_m", [0.1, 0.15, 0.2, 0.25])
def test_below_what_a_range_finder_measures_a_line_tells_the_height_however_far_off_its_least_is(
    true_m: float,
) -> None:
    """What leapt when the line came near enough to it was learnt as a delay of the camera."""
    heights = NearFloor()
    placed = [heights.height_m([true_m + 0.01 * n], 0.3, n * 50_000_000) for n in range(4)]
    assert placed[1:] == pytest.approx([true_m + 0.01 * n for n in range(1, 4)])


@pytest.mark.parametrize("share", [0.45, 0.69, 1.45, 2.0])
def test_near_the_floor_nothing_is_believed_of_a_line_of_another_width(share: float) -> None:
    heights, other_m = NearFloor(), share * 0.45
    assert [heights.height_m([other_m], 0.45, frame * 33_000_000) for frame in range(20)] == [0.45] * 20
    beside = [heights.height_m([other_m, 0.41], 0.45, frame * 33_000_000) for frame in range(20, 40)]
    assert beside[0] == 0.45
    assert beside[1:] == pytest.approx([0.41] * 19)


def test_near_the_floor_a_line_that_comes_and_goes_tells_no_height() -> None:
    heights = NearFloor()
    told = [heights.height_m([(0.36, 0.56)[frame % 2]], 0.45, frame * 33_000_000) for frame in range(40)]
    assert told == [0.45] * 40
    assert heights.height_m([], 0.45, 40 * 33_000_000) == 0.45
    assert heights.height_m([0.4], 0.0, 41 * 33_000_000) == 0.0


@pytest.mark.parametrize("gap_at_m", [math.inf, 0.15, 0.25, 0.5])
@pytest.mark.parametrize("fps", [10.0, 12.0, 15.0, 30.0])
def test_a_take_off_by_a_reading_that_sticks_near_the_floor_is_told_by_the_widths(
    fps: float, gap_at_m: float
) -> None:
    """There a climb of ordinary speed changes what the lines tell by a quarter from frame to frame, and more
    where they are not seen for a quarter of a second."""
    heights, height_m, climb_mps = Frames(fps), 0.1, 0.0
    gap = 0
    while height_m < 1.0:
        gap += height_m > gap_at_m
        heights.sees([] if 0 < gap <= fps / 4 else [height_m], 0.1)
        climb_mps = min(climb_mps + 1.3 / fps, 1.1)
        height_m += climb_mps / fps
    assert heights.tell
    assert heights.off_m < -0.25


@pytest.mark.parametrize("last_m", [0.12, 0.2])
def test_a_line_of_another_width_is_not_taken_for_a_climb_that_nobody_saw(last_m: float) -> None:
    heights = Frames()
    for _ in range(30):
        heights.sees([last_m], last_m)
    for _ in range(24):
        heights.sees([], 1.0)
    for _ in range(60):
        assert heights.sees([0.5], 1.0) == 1.0
    assert not heights.tell


def test_a_line_that_flickers_near_the_floor_with_another_is_not_believed() -> None:
    heights = Frames()
    for _ in range(30):
        heights.sees([0.4], 0.4)
    for n in range(60):
        assert heights.sees([0.25 if n % 2 else 0.34], 0.4) == 0.4
