"""The places where the drone may be, and the states of the floor that they make of what is seen."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flightd.core.tracks import TrackedLine
from flightd.localisation.hypotheses import Places
from flightd.localisation.line_runs import Approached, LineRuns
from flightd.localisation.observation_model import SensorModel
from flightd.site.painted_lines import PaintMap
from tests.sim.ideal.crossing_floors import uniform_site

SITE = uniform_site(8, 3, range(1, 9), spacing_m=1.5, pitch_m=2.0)
PAINT = PaintMap.of(SITE)
KEPT = 0
REACH_M = 1.0


def places(sigma_m: float = 0.05, elsewhere: float = 1e-5) -> Places:
    """Sure to be at the third node of the first aisle."""
    known = Places(PAINT, SensorModel(), elsewhere)
    known.add([(3.0, 0.0)], [1.0], sigma_m)
    known.best = 1
    return known


def seen(id_: int, offset_m: float) -> TrackedLine:
    return TrackedLine(id_, offset_m, 0.01, SITE.line_width_m, 0, 10)


offsets = st.lists(st.tuples(st.integers(0, 1), st.floats(-2.0, 2.0)), min_size=1, max_size=6)


@given(offsets, st.floats(0.01, 3.0), st.booleans())
def test_whatever_is_seen_weights_stay_a_probability(
    lines: list[tuple[int, float]], sigma_m: float, judge: bool
) -> None:
    known = places(sigma_m)
    tracks: list[list[TrackedLine]] = [[], []]
    for id_, (axis, offset_m) in enumerate(lines):
        track = seen(id_, offset_m)
        known.match(axis, track, {one.id for one in tracks[axis]}, REACH_M, judge)
        for other in tracks[axis]:
            if abs(other.offset_m - offset_m) < 0.3:
                known.contest(axis, track, other)
        tracks[axis].append(track)
        known.settle(axis, tracks[axis])
        known.goes_on(axis, id_, 0.5)
        known.doubt(1e-5, 5e-3)
        assert known.weights.sum() == pytest.approx(1.0)
        assert np.isfinite(known.at_m).all()
        assert known.sigma_m.min() > 0.0
        assert known.floor.sum() == pytest.approx(1.0)
        assert len(known) == len(known.at_m) == len(known.sigma_m) == len(known.weights)
        assert set(known.agreed(axis, [id_])) == {id_}
        known.thin(48)
        assert len(known) <= 50


def test_nobody_is_elsewhere_where_that_is_ruled_out() -> None:
    known = places(elsewhere=0.0)
    known.match(0, seen(0, 0.4), (), REACH_M, judge=True)
    assert known.weights[0] == 0.0
    assert known.weights.sum() == pytest.approx(1.0)


def test_lines_where_the_map_has_none_say_that_the_floor_is_worn_and_a_new_node_that_it_may_be_kept() -> None:
    known = places()
    for id_, offset_m in enumerate((0.5, -0.5, 0.9)):
        known.match(0, seen(id_, offset_m), (), REACH_M, judge=True)
    worn = float(known.floor[KEPT])
    assert worn < 0.2
    for _ in range(100):
        known.doubt(0.0, 0.02)
    assert known.floor[KEPT] > 0.7


def test_a_match_that_is_not_judged_adds_no_weight_to_a_place_with_many_lines() -> None:
    known = places(sigma_m=2.0)
    known.add([(3.0, 40.0)], [1.0], 2.0)  # beyond all paint: nothing can match there
    before = known.weights[2] / known.weights.sum()
    known.match(0, seen(0, 0.1), (), REACH_M, judge=False)
    after = 1.0 - known.weights[np.abs(known.at_m[:, 1]) < 1.0].sum() - known.weights[0]
    assert after == pytest.approx(before, rel=1e-6)


def test_a_line_that_goes_on_is_not_stray_tape_but_no_proof_of_the_hall() -> None:
    known, stray = places(elsewhere=1.0), LineRuns()
    known.match(1, seen(0, 0.0), (), REACH_M, judge=False)
    before, grown_m = known.weights[0], 0.0
    for step in range(200):
        track = TrackedLine(0, 0.0, 0.01, SITE.line_width_m, 0, 10, from_m=-0.5, to_m=0.5)
        for id_, more_m in stray.grown_m([track], 0.1 * step, 0).items():
            known.goes_on(1, id_, more_m)
            grown_m += more_m
    assert grown_m == pytest.approx(6.0)
    assert 0.5 * math.exp(-2.0) < known.weights[0] / before < 3.0 * math.exp(-2.0)


def test_a_line_is_approached_once_what_lies_beside_it_has_come_into_view() -> None:
    approached = Approached()
    approached.step([seen(0, 1.2), seen(1, -0.3)], 0.4)
    assert (approached.has(0), approached.has(1)) == (False, True)
    approached.step([seen(0, 0.95), seen(1, -0.6)], 0.4)
    assert (approached.has(0), approached.has(1)) == (False, True)
    approached.step([seen(0, 0.85)], 0.4)
    assert (approached.has(0), approached.has(1)) == (True, False)


def test_a_place_that_is_hardly_known_is_joined_to_a_likelier_one_and_not_the_other_way() -> None:
    known = Places(PAINT, SensorModel(), 1e-5)
    known.add([(3.0, 0.0)], [0.95], 0.02)
    known.best = 1
    known.add([(3.5, 0.0)], [0.04], 0.16)
    known.at_m[2] = (3.12, 0.0)
    known.thin(48)
    assert len(known) == 2, "elsewhere and here"
    assert known.at_m[known.best] == pytest.approx((3.0, 0.0))
    assert known.sigma_m[known.best] == pytest.approx((0.02, 0.02))
