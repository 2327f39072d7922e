"""Two lines beside each other: both in one frame are two, and the old one does not become the map's."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from flightd.core.camera_view import FloorReach
from flightd.core.tracks import TrackedLine, TrackSet
from flightd.core.types import GridPose
from flightd.localisation.grid_localiser import GridLocaliser
from flightd.localisation.hypotheses import Places
from flightd.localisation.observation_model import SensorModel
from flightd.localisation.seen_beside import SeenBeside
from flightd.sim.random_sites import random_site
from flightd.site.painted_lines import PaintMap

SITE = random_site(3)
A1 = SITE.nodes["A1"]
TICK_NS = 20_000_000
TRUE, OLD = 0, 1
OF_MAP = (TRUE,).__contains__


def line(id_: int, offset_m: float, tick: int) -> TrackedLine:
    return TrackedLine(id_, offset_m, 0.01, SITE.line_width_m, tick * TICK_NS, 10)


def seen(beside: SeenBeside, offsets_m: list[tuple[float, ...]]) -> None:
    for tick, both in enumerate(offsets_m, 1):
        beside.step([line(id_, at_m, tick) for id_, at_m in enumerate(both)], OF_MAP)


def test_two_lines_in_ten_frames_are_two_and_of_the_floor() -> None:
    beside = SeenBeside()
    seen(beside, [(0.001 * k, 0.12 + 0.001 * k) for k in range(9)])
    assert beside.pairs() == []
    beside.step([line(0, 0.0, 10), line(1, 0.12, 10)], OF_MAP)
    assert beside.pairs() == [(0, 1)]
    beside.step([line(1, 0.12, 11)], OF_MAP)
    assert beside.pairs() == []
    assert beside.told_ns([line(1, 0.12, 11), line(2, 0.5, 12)]) == 11 * TICK_NS


def test_only_what_keeps_its_distance_from_a_line_of_the_map_is_of_the_floor() -> None:
    lamps = SeenBeside()
    for tick in range(1, 31):
        lamps.step([line(0, 0.01 * tick, tick), line(1, 0.2 + 0.01 * tick, tick)], lambda _: False)
    assert lamps.told_ns([line(0, 0.3, 30), line(1, 0.5, 30)]) == 0
    beside = SeenBeside()
    seen(beside, [(0.0, 0.12)] * 12)
    assert beside.told_ns([line(1, 0.12, 12)])
    beside.step([line(0, 0.0, 13), line(1, 0.2, 13)], OF_MAP)
    assert beside.told_ns([line(1, 0.2, 13)]) == 0


@pytest.mark.parametrize(
    ("why", "apart_m"),
    [
        ("one band told as two", [0.04] * 30),
        ("far from each other", [0.8] * 30),
        ("a lamp's mirror image, which stays behind", [0.12 + 0.005 * k for k in range(30)]),
    ],
)
def test_other_lines_are_not_held_against_each_other(why: str, apart_m: list[float]) -> None:
    beside = SeenBeside()
    seen(beside, [(0.0, apart) for apart in apart_m])
    assert beside.pairs() == [], why
    assert beside.told_ns([line(0, 0.0, 30)]) == 0


def test_lines_that_take_turns_may_be_one() -> None:
    beside = SeenBeside()
    for tick in range(1, 60):
        one, other = (tick, tick - 1) if tick % 2 else (tick - 1, tick)
        beside.step([line(0, 0.0, one), line(1, 0.12, other)], OF_MAP)
    assert beside.pairs() == []


def past_the_end(localiser: GridLocaliser, ticks: int, aside_m: float = 0.12) -> GridPose:
    """The true line below a drone that hovers, soon an old one beside it; after two seconds the true one is
    gone, and after four forgotten."""
    for tick in range(1, ticks):
        below = [line(OLD, aside_m, tick)] if tick > 20 else []
        if tick < 200:
            below.append(line(TRUE, 0.0, min(tick, 100)))
        stamp_ns = tick * TICK_NS
        across = (line(2, 0.0, tick),), tuple(below)
        tracks = TrackSet(stamp_ns, stamp_ns, 0.0, 0.01, 0.0, 0.0, 0.0, 0.0, *across, pads_ns=stamp_ns)
        pose = localiser.step(replace(tracks, velocity_sigma_mps=(0.02, 0.02)), 1.6)
    return pose


@pytest.mark.parametrize("aside_m", [0.09, 0.12, 0.2])
def test_an_old_line_does_not_become_the_maps_where_the_true_one_ends(aside_m: float) -> None:
    pose = past_the_end(GridLocaliser(SITE, "A1", FloorReach()), 400, aside_m)
    assert abs(pose.y_m - A1.y_m) < 0.02
    assert math.sqrt(pose.covariance[4]) > 0.1, "nothing but the old line has told it for four seconds"


def test_what_is_held_possible_beside_the_place_is_in_its_sigma() -> None:
    places = Places(PaintMap.of(SITE), SensorModel(), 1e-5)
    places.add([(0.0, 0.0), (0.13, 0.0), (0.0, 0.29), (1.5, 0.0)], [1.0, 0.5, 1e-4, 0.5], 0.02)
    places.best = 1
    x_m, y_m = places.spread(0.3, 1e-3)
    assert x_m == pytest.approx(math.hypot(0.02, 0.13 / math.sqrt(3.0)), rel=1e-3)
    assert y_m == pytest.approx(0.02)


def test_an_old_line_carries_the_position_on_but_not_for_ever() -> None:
    localiser = GridLocaliser(SITE, "A1", FloorReach())
    past_the_end(localiser, 400, 0.35)
    assert localiser.told_ns[1] == 399 * TICK_NS
    hovered = 100 + round(3.0 / (0.1 * 0.02)) + 200
    localiser = GridLocaliser(SITE, "A1", FloorReach())
    past_the_end(localiser, hovered, 0.35)
    assert localiser.told_ns[1] < (hovered - 100) * TICK_NS
