"""Localisation: tracks matched to the map, false lines left out, position carried over gaps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from flightd.core.camera_view import FloorReach
from flightd.core.tracks import TrackedLine, TrackSet
from flightd.localisation.grid_localiser import GridLocaliser
from flightd.sim.random_sites import random_site

SITE = random_site(3)
A1, A2 = SITE.nodes["A1"], SITE.nodes["A2"]
TICK_NS = 20_000_000


def line(id_: int, offset_m: float, sigma_m: float = 0.01, hits: int = 10) -> TrackedLine:
    return TrackedLine(id_, offset_m, sigma_m, SITE.line_width_m, 0, hits)


def tracks(
    tick: int, across_x: list[TrackedLine], across_y: list[TrackedLine], vx: float = 0.0, vy: float = 0.0
) -> TrackSet:
    stamp = tick * TICK_NS
    return TrackSet(stamp, stamp, 0.0, 0.01, vx, vy, 0.0, 0.0, tuple(across_x), tuple(across_y))


def test_the_position_is_that_of_the_lines() -> None:
    localiser = GridLocaliser(SITE, "A1", FloorReach())
    pose = localiser.step(tracks(1, [line(0, -0.05)], [line(0, 0.03)]), 1.6)
    assert (pose.node, round(pose.along_m, 3), round(pose.across_m, 3)) == ("A1", 0.05, -0.03)
    assert pose.integrity < 0.95, "so far the pad is all that tells A1 from its like"


def test_flying_to_the_next_node_changes_the_node_and_nothing_jumps() -> None:
    localiser, gap = GridLocaliser(SITE, "A1", FloorReach()), A2.x_m - A1.x_m
    x, last = 0.0, 0.0
    for tick in range(1, 200):
        x = min(tick * 0.02 * 0.8, gap)
        seen = [line(i, at - x) for i, at in ((0, 0.0), (1, gap)) if abs(at - x) < 0.9]
        pose = localiser.step(tracks(tick, seen, [line(0, 0.0)], vx=0.8 if x < gap else 0.0), 1.6)
        assert abs(pose.x_m - A1.x_m - x) < 0.02
        assert abs(pose.x_m - last) < 0.03 or tick == 1
        last = pose.x_m
    assert pose.node == "A2"


def test_a_false_line_between_two_nodes_is_not_matched() -> None:
    localiser, gap = GridLocaliser(SITE, "A1", FloorReach()), A2.x_m - A1.x_m
    localiser.step(tracks(1, [line(0, 0.0)], [line(0, 0.0)]), 1.6)
    for tick in range(2, 50):
        pose = localiser.step(
            tracks(tick, [line(0, 0.0), line(7, gap / 2), line(8, 0.25)], [line(0, 0.0)]), 1.6
        )
    assert abs(pose.x_m - A1.x_m) < 0.005


def test_a_missed_cross_line_does_not_shift_the_node_count() -> None:
    """A2's own line is never seen; A3's must be taken for A3's."""
    localiser = GridLocaliser(SITE, "A1", FloorReach())
    a3 = SITE.nodes["A3"]
    for tick in range(1, 400):
        x = min(tick * 0.02 * 0.8, a3.x_m - A1.x_m)
        seen = [line(i, at - x) for i, at in ((0, 0.0), (2, a3.x_m - A1.x_m)) if abs(at - x) < 0.9]
        moving = 0.8 * 1.03 if x < a3.x_m - A1.x_m else 0.0  # and odometry is 3 % off
        pose = localiser.step(tracks(tick, seen, [line(0, 0.0)], vx=moving), 1.6)
    assert pose.node == "A3"
    assert abs(pose.along_m) < 0.02


def test_without_lines_the_doubt_grows() -> None:
    localiser = GridLocaliser(SITE, "A1", FloorReach())
    first = localiser.step(tracks(1, [line(0, 0.0)], [line(0, 0.0)]), 1.6)
    later = localiser.step(tracks(501, [], []), 1.6)
    assert later.integrity < 0.7 * first.integrity
    assert later.covariance[0] > 1.0


def test_after_a_long_gap_a_line_between_two_is_held_for_either_until_the_next_one_tells() -> None:
    localiser, gap = GridLocaliser(SITE, "A1", FloorReach()), A2.x_m - A1.x_m
    localiser.step(tracks(1, [line(0, 0.0)], [line(0, 0.0)]), 1.6)
    localiser.step(tracks(401, [], [line(0, 0.0)]), 1.6)
    shift = 0.45 * gap  # it drifted back, unseen, by nearly half a cell
    pose = localiser.step(tracks(402, [line(1, shift)], [line(0, 0.0)]), 1.6)
    assert pose.integrity < 0.95
    pose = localiser.step(tracks(403, [line(1, shift), line(2, shift + gap)], [line(0, 0.0)]), 1.6)
    assert abs(pose.x_m - A1.x_m + shift) < 0.05


def test_what_the_lines_ahead_look_like_makes_it_sure() -> None:
    localiser, gap = GridLocaliser(SITE, "A1", FloorReach()), A2.x_m - A1.x_m
    for tick in range(1, 150):
        x = min(tick * 0.02 * 0.8, gap)
        seen = [line(i, at - x) for i, at in ((0, 0.0), (1, gap)) if abs(at - x) < 0.9]
        told = tracks(tick, seen, [line(0, 0.0)], vx=0.8 if x < gap else 0.0)
        now = [replace(at, seen_ns=told.stamp_ns) for at in (*told.across_x, *told.across_y)]
        pose = localiser.step(replace(told, across_x=tuple(now[:-1]), across_y=(now[-1],)), 1.6)
    assert pose.node == "A2"
    assert pose.integrity > 0.95


def test_features_of_the_floor_carry_the_position_on_for_as_far_as_they_may() -> None:
    localiser = GridLocaliser(SITE, "A1", FloorReach())
    for tick in range(1, 20):
        here = replace(line(0, 0.0), seen_ns=tick * TICK_NS)
        localiser.step(tracks(tick, [here], [here]), 1.6)
    seen_ns = localiser.told_ns
    told_m = 0.0
    for tick in range(20, 400):
        moving = tracks(tick, [], [], vx=0.8)
        at_ns = moving.stamp_ns - 100_000_000
        pose = localiser.step(replace(moving, features_ns=(at_ns, at_ns), pads_ns=at_ns), 1.6)
        if min(localiser.told_ns) == at_ns:
            told_m = pose.x_m - A1.x_m
    assert 2.9 < told_m < 3.3
    assert min(localiser.told_ns) > max(seen_ns)
    alone = GridLocaliser(SITE, "A1", FloorReach())
    for tick in range(1, 400):
        drifting = alone.step(tracks(tick, [line(0, 0.0)] if tick < 20 else [], [], vx=0.0), 1.6)
    assert pose.covariance[0] < 0.5 * drifting.covariance[0]


def test_features_alone_tell_no_position() -> None:
    localiser = GridLocaliser(SITE, "A1", FloorReach())
    for tick in range(1, 20):
        seen = tracks(tick, [], [])
        localiser.step(replace(seen, features_ns=(seen.stamp_ns, seen.stamp_ns)), 1.6)
    assert localiser.told_ns == (0, 0)


def after_lines(features: Callable[[int], tuple[bool, bool]], ticks: int = 200) -> tuple[GridLocaliser, int]:
    """Lines for 20 ticks, then only the features that `features` says, at rest."""
    localiser, last = GridLocaliser(SITE, "A1", FloorReach()), [0, 0]
    for tick in range(1, ticks):
        here = [replace(line(0, 0.0), seen_ns=tick * TICK_NS)] if tick < 20 else []
        now_ns = tick * TICK_NS
        for axis, told in enumerate(features(tick)):
            last[axis] = now_ns if told else last[axis]
        seen = replace(tracks(tick, here, here), features_ns=(last[0], last[1]), pads_ns=now_ns)
        localiser.step(seen, 1.6)
    return localiser, now_ns


def test_once_nothing_told_the_position_features_do_not_take_it_up_again() -> None:
    localiser, now_ns = after_lines(lambda tick: (not 60 < tick < 110,) * 2)
    assert max(localiser.told_ns) < now_ns - 2_000_000_000
    unbroken, now_ns = after_lines(lambda _: (True, True))
    assert min(unbroken.told_ns) == now_ns


def test_features_along_one_axis_tell_nothing_of_the_other() -> None:
    localiser, now_ns = after_lines(lambda _: (True, False))
    x_ns, y_ns = localiser.told_ns
    assert x_ns == now_ns
    assert y_ns < now_ns - 3_000_000_000


def test_a_hover_is_not_carried_for_ever() -> None:
    localiser, now_ns = after_lines(lambda _: (True, True), ticks=2000)
    assert max(localiser.told_ns) < now_ns - 5_000_000_000
