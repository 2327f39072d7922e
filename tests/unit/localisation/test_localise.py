"""Localisation: tracks matched to the map, false lines left out, position carried over gaps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest

from flightd.core.camera_view import FloorReach
from flightd.core.tracks import TrackedLine, TrackSet
from flightd.localisation.grid_localiser import GridLocaliser
from flightd.sim.random_sites import random_site
from flightd.site.site import PaintedLine

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


def test_of_two_lines_close_beside_each_other_the_one_seen_first_need_not_be_the_maps() -> None:
    localiser, gap = GridLocaliser(SITE, "A1", FloorReach()), A2.x_m - A1.x_m
    painted = (0, 0.0, 0.0), (1, gap - 0.13, gap - 0.9), (2, gap, gap - 0.6)
    for tick in range(1, 200):
        x = min(tick * 0.02 * 0.8, gap)
        seen = [replace(line(i, at - x), seen_ns=tick * TICK_NS) for i, at, from_m in painted if x >= from_m]
        seen = [one for one in seen if abs(one.offset_m) < 1.0]
        pose = localiser.step(tracks(tick, seen, [line(0, 0.0)], vx=0.8 if x < gap else 0.0), 1.6)
    assert abs(pose.x_m - A2.x_m) < 0.02, "it flew on along the line 13 cm before the true one"
    assert localiser.map_lines(0).keys() == {2}


@pytest.mark.parametrize("painted", [0, 1])
def test_false_lines_across_an_axis_that_hardly_has_one_are_none_of_the_map(painted: int) -> None:
    along = [PaintedLine(-1.0, 0.0, 9.0, 0.0, SITE.line_width_m)]
    across = [PaintedLine(0.0, -1.0, 0.0, 1.0, SITE.line_width_m)] * painted
    localiser = GridLocaliser(replace(SITE, lines=(*along, *across)), "A1", FloorReach())
    for tick in range(1, 200):
        x = 0.004 * tick
        seen = [replace(line(i, at - x), seen_ns=tick * TICK_NS) for i, at in enumerate((0.12, 0.3, 0.7))]
        pose = localiser.step(tracks(tick, seen, [line(0, 0.0)], vx=0.2), 1.6)
    assert abs(pose.x_m - x) < 0.5
    assert abs(pose.y_m) < 0.05


def test_a_worn_floor_is_learnt_and_the_place_on_it_stays_known() -> None:
    localiser, nodes = GridLocaliser(SITE, "A1", FloorReach()), [SITE.nodes[f"A{i}"] for i in range(1, 6)]
    painted = [(i, node.x_m) for i, node in enumerate(nodes) if i != 2]
    false = [(10 + i, node.x_m + 0.47) for i, node in enumerate(nodes[1:4])]
    for tick in range(1, 480):
        x = min(A1.x_m + tick * 0.02 * 0.8, nodes[-1].x_m)
        near = [line(i, at - x) for i, at in painted + false if abs(at - x) < 0.9]
        seen = [replace(one, seen_ns=tick * TICK_NS) for one in near]
        along = replace(line(0, 0.0), seen_ns=tick * TICK_NS)
        pose = localiser.step(tracks(tick, seen, [along], vx=0.8 if x < nodes[-1].x_m else 0.0), 1.6)
    assert pose.node == nodes[-1].id
    assert pose.integrity > 0.9


def test_on_a_kept_floor_a_slip_by_a_cell_is_not_taken_for_wear() -> None:
    localiser = GridLocaliser(SITE, "A1", FloorReach())
    along = [SITE.nodes[f"A{i}"].x_m for i in range(2, 7)]
    for tick in range(1, 700):
        x = min(A2.x_m + tick * 0.02 * 0.8, along[-1])
        near = [(i, at - x) for i, at in enumerate(along) if abs(at - x) < 0.9]
        seen = [replace(line(*one), seen_ns=tick * TICK_NS) for one in near]
        below = replace(line(0, 0.0), seen_ns=tick * TICK_NS)
        pose = localiser.step(tracks(tick, seen, [below], vx=0.8 if x < along[-1] else 0.0), 1.6)
        wrong = abs(pose.x_m - x) > 0.5
        assert not (wrong and pose.integrity > 0.99), "started one node further than it was told"


def test_only_a_line_that_was_approached_says_where_on_the_map_it_is() -> None:
    localiser = GridLocaliser(SITE, "A1", FloorReach())
    along = [SITE.nodes[f"A{i}"].x_m for i in range(1, 5)]
    for tick in range(1, 250):
        x = min(tick * 0.02 * 0.8, along[2])
        near = [(i, at - x) for i, at in enumerate(along) if abs(at - x) < 2.2]
        seen = [replace(line(*one), seen_ns=tick * TICK_NS) for one in near]
        below = replace(line(0, 0.0), seen_ns=tick * TICK_NS)
        localiser.step(tracks(tick, seen, [below], vx=0.8 if x < along[2] else 0.0), 1.6)
    assert localiser.map_lines(0) == {1: along[1], 2: along[2]}, "the fourth is in view, ahead"


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
        carried = replace(moving, features_ns=(at_ns, at_ns), pads_ns=at_ns, velocity_sigma_mps=(0.03, 0.03))
        pose = localiser.step(carried, 1.6)
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


def test_two_lines_that_come_into_view_at_once_after_a_gap_are_two_of_the_map() -> None:
    localiser, gap = GridLocaliser(SITE, "A1", FloorReach()), A2.x_m - A1.x_m
    localiser.step(tracks(1, [line(0, 0.0)], [line(0, 0.0)]), 1.6)
    blind = replace(tracks(201, [], [line(0, 0.0)]), velocity_sigma_mps=(0.2, 0.02))
    localiser.step(blind, 1.6)
    for tick in range(202, 260):
        both = [replace(line(i, at), seen_ns=tick * TICK_NS) for i, at in ((1, -0.3), (2, gap - 0.3))]
        pose = localiser.step(tracks(tick, both, [line(0, 0.0)]), 1.6)
    assert abs(pose.x_m - 0.3) < 0.02


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
