"""When range finder and lines' width together contradict the told climb, and when one alone does not."""

from __future__ import annotations

import math
import random
from collections.abc import Callable

import pytest

from flightd.tracking.climb_doubt import ClimbDoubt

_FRAME_NS = 33_000_000
Of = Callable[[float], float]


def flown(range_m: Of, width_m: Of, climbed_m: Of, lasts_s: float = 4.0) -> tuple[ClimbDoubt, int]:
    """What is thought after so long, and when; all as functions of the time, s."""
    doubt, now_ns = ClimbDoubt(), 0
    for frame in range(round(lasts_s * 1e9 / _FRAME_NS)):
        now_ns = 1 + frame * _FRAME_NS
        at_s = now_ns * 1e-9
        doubt.step(now_ns, range_m(at_s), width_m(at_s), climbed_m(at_s))
    return doubt, now_ns


@pytest.mark.parametrize("drift_mps", [-1.0, -0.4, 0.6])
def test_both_heights_against_the_told_climb_say_by_how_much_it_errs(drift_mps: float) -> None:
    """The drone hovers by its own estimate."""
    doubt, now_ns = flown(lambda s: 3.0 - drift_mps * s, lambda s: 3.0 - drift_mps * s, lambda _: 0.0, 1.5)
    assert doubt.found
    assert doubt.error_mps(now_ns) == pytest.approx(drift_mps)


@pytest.mark.parametrize(
    ("range_m", "width_m", "climbed_m"),
    [
        pytest.param(lambda s: 1.6, lambda s: 1.6 + 0.8 * s, lambda s: 0.8 * s, id="the range finder sticks"),
        pytest.param(lambda s: 0.5 * s, lambda s: s, lambda s: s, id="it reads the half"),
        pytest.param(lambda s: 2.0 - (s > 2.0), lambda s: 2.0, lambda s: 0.0, id="goods came below"),
        pytest.param(lambda s: 2.0, lambda s: 2.0 - 0.8 * (s > 2.0), lambda s: 0.0, id="another line"),
        pytest.param(lambda s: 1.0 + 0.1 * s, lambda s: 1.0 + 0.1 * s, lambda s: 0.0, id="a slow drift"),
        pytest.param(
            lambda s: 1.6 + 0.4 * (2.4 < s < 2.6),
            lambda s: 1.6 + 0.59 * (2.45 < s < 2.55),
            lambda s: 0.0,
            id="an echo, and a wide stripe",
        ),
    ],
)
def test_one_of_them_alone_does_not_contradict_the_climb(range_m: Of, width_m: Of, climbed_m: Of) -> None:
    doubt, now_ns = flown(range_m, width_m, climbed_m)
    assert not doubt.found
    assert abs(doubt.error_mps(now_ns)) < 0.15


def test_a_drift_is_found_as_soon_though_the_width_leaps_for_a_frame() -> None:
    def found_s(leaps_s: float) -> float:
        doubt = ClimbDoubt()
        for frame in range(100):
            at_s = frame * _FRAME_NS * 1e-9
            width_m = (1.6 + at_s) * (1.4 if leaps_s < at_s < leaps_s + 0.04 else 1.0)
            doubt.step(1 + frame * _FRAME_NS, 1.6 + at_s, width_m, 0.0)
            if doubt.found:
                return at_s
        return math.inf

    assert found_s(math.inf) == pytest.approx(0.38, abs=0.02)
    assert all(found_s(leaps_s) == found_s(math.inf) for leaps_s in (0.1, 0.2, 0.25))


def alone(width_m: Of, shows: Callable[[float], bool] = lambda _: True) -> ClimbDoubt:
    """After 3 s of hovering at 1.6 m, of which the range finder tells the first; lines show then and when."""
    doubt = ClimbDoubt()
    for frame in range(round(3e9 / _FRAME_NS)):
        at_s = frame * _FRAME_NS * 1e-9
        if at_s < 1.0:
            doubt.step(1 + frame * _FRAME_NS, 1.6, 1.6, 0.0)
        elif shows(at_s):
            doubt.step(1 + frame * _FRAME_NS, width_m(at_s), width_m(at_s), 0.0, alone=True)
    return doubt


def test_lines_alone_contradict_the_climb_once_they_do_so_for_long() -> None:
    assert alone(lambda s: 1.6 + max(s - 1.0, 0.0)).found
    assert not alone(lambda _: 1.6).found


def test_what_looks_like_a_line_in_a_few_frames_contradicts_nothing() -> None:
    for until_s in (2.5, 2.6, 2.7):
        doubt = alone(lambda _: 1.2, lambda s, until_s=until_s: 2.45 < s < until_s)  # type: ignore[misc]
        assert not doubt.found
        assert doubt.error_mps(round(until_s * 1e9)) == 0.0
    assert not alone(lambda _: 1.2, lambda s: math.fmod(s, 0.3) < 0.1).found, "it comes and goes"
    seam, line = (lambda s: 1.2 if s < 2.0 else 1.6), (lambda s: 1.9 < s < 1.97 or s > 2.2)
    assert not alone(seam, line).found, "the line is not held against the seam"


@pytest.mark.parametrize("height_m", [1.6, 2.5, 3.5])
@pytest.mark.parametrize("seed", range(4))
def test_widths_that_are_noisy_high_up_tell_a_climb_alone_and_none_where_there_is_none(
    height_m: float, seed: int
) -> None:
    for climb_mps, is_found in ((0.0, False), (1.0, True)):
        noise, doubt = random.Random(seed), ClimbDoubt()
        for frame in range(round(2.5e9 / _FRAME_NS)):
            at_s = frame * _FRAME_NS * 1e-9
            width_m = (height_m + climb_mps * max(at_s - 1.0, 0.0)) * (1.0 + noise.gauss(0.0, 0.02))
            doubt.step(1 + frame * _FRAME_NS, width_m, width_m, 0.0, alone=True)
        assert doubt.found is is_found


def test_what_is_wrong_once_is_not_put_right_by_heights_that_do_not_agree_or_are_old() -> None:
    doubt, now_ns = flown(lambda s: 2.0 + s, lambda s: 2.0 + s, lambda _: 0.0, 1.0)
    assert doubt.error_mps(now_ns) == pytest.approx(-1.0)
    assert doubt.error_mps(now_ns + 600_000_000) == 0.0
    for frame in range(1, 12):
        doubt.step(now_ns + frame * _FRAME_NS, 3.0, 3.0 + 0.05 * frame, 0.0)
    assert doubt.error_mps(now_ns + 11 * _FRAME_NS) == 0.0
    assert doubt.found
