"""The way back along what was flown."""

from __future__ import annotations

import itertools
import math

from flightd.mission.flight.flown_trail import FlownTrail


def flown(*way_m: tuple[float, float]) -> FlownTrail:
    """A trail along straight legs between these places, at a tick every centimetre."""
    trail = FlownTrail()
    for (x0, y0), (x1, y1) in itertools.pairwise(way_m):
        steps = round(100 * math.hypot(x1 - x0, y1 - y0))
        for step in range(steps + 1):
            trail.step(x0 + (x1 - x0) * step / steps, y0 + (y1 - y0) * step / steps)
    return trail


def test_the_way_back_turns_where_the_flight_did() -> None:
    trail, at, back = flown((0.0, 0.0), (0.7, 0.0), (0.7, 0.8)), (0.7, 0.8), []
    while (point := trail.back(at, 0.5)) is not None:
        back.append(point)
        at = point
    assert len(back) == 2
    assert all(math.isclose(x, 0.7, abs_tol=0.21) or math.isclose(y, 0.0, abs_tol=0.01) for x, y in back)
    assert math.dist(back[-1], (0.0, 0.0)) < 0.65
    assert all(0.5 <= math.dist(one, after) < 0.75 for one, after in itertools.pairwise(back))


def test_a_loop_is_not_flown_again() -> None:
    trail = flown((0.0, 0.0), (1.2, 0.0), (1.2, 0.3), (0.8, 0.3), (0.8, 0.0), (1.0, 0.0))
    back = trail.back((1.0, 0.0), 0.5)
    assert back is not None
    assert math.isclose(back[1], 0.0, abs_tol=0.01)
    assert 0.3 < back[0] < 0.5


def test_nobody_has_flown_straight_to_what_is_further_away() -> None:
    """As after a move along the map's lines, which is not of this way."""
    trail = flown((0.0, 0.0), (2.0, 0.0))
    assert trail.back((2.0, 1.0), 0.5) is None
    trail = flown((0.0, 0.0), (2.0, 0.0))
    for step in range(100):
        trail.step(4.0 + 0.01 * step, 2.0)
    back = trail.back((5.0, 2.0), 0.5)
    assert back is not None
    assert back[1] == 2.0
    while back is not None:
        assert back[0] >= 4.0
        back = trail.back(back, 0.5)


def test_of_a_long_way_only_the_last_metres_are_known() -> None:
    trail, at, points = flown((0.0, 0.0), (30.0, 0.0)), (30.0, 0.0), 0
    while (point := trail.back(at, 0.5)) is not None:
        at, points = point, points + 1
    assert 28.3 < at[0] < 29.1
    assert 2 <= points <= 3


def test_without_a_way_there_is_none_back() -> None:
    trail = flown((0.0, 0.0), (1.0, 0.0))
    trail.clear()
    assert trail.back((1.0, 0.0), 0.5) is None
    assert flown((0.0, 0.0), (0.3, 0.0)).back((0.3, 0.0), 0.5) is None
