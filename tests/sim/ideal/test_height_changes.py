"""The held line and the goal node are kept in metres: a climb from 0.8 m to 3 m and back changes neither."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path

import pytest

from flightd.config.schema import load_config
from flightd.config.sweep import ScanMode
from flightd.core.tracks import TrackSet
from flightd.core.types import Phase
from flightd.site.site_file import parse_site
from tests.rigs.brisk import BRISK
from tests.sim.ideal.ideal_flight import Flown, IdealFlight
from tests.sim.ideal.ideal_front import IdealFront, Label, Stock
from tests.unit.mission.shelves import FITTED, SIGHT

CONFIG = load_config(Path(__file__).parents[3] / "configs" / "sim.toml").with_values(
    front_camera=FITTED, scan={"mode": ScanMode.STOP}, mission=BRISK
)
SITE = parse_site(
    """
[site]
name = "tall"
ceiling_m = 6.0

[[aisle]]
id = "A"
x_m = 0.0
y_m = 0.0
spacing_m = [1.3, 1.3, 1.3]
shelf_height_m = 3.6

[[rack]]
bay_width_m = 1.3
levels_m = [0.8, 3.0]
sides = ["left"]

[[pad]]
id = "home"
node = "A1"
size_m = 0.5
""",
    "tall",
)
NODES = ("A2", "A3")
LOW_M, HIGH_M = 0.9, 2.9


@pytest.fixture(scope="module")
def flown() -> Flown:
    labels = {code: [Label(f"PALLET {code}")] for code in SITE.locations}
    front = IdealFront(SITE, SIGHT, Stock(labels))
    flight = IdealFlight(SITE, CONFIG, visits=NODES, seed=4, front=front)
    return flight.fly(300)


def held(tracks: TrackSet) -> int:
    """The track of the line that the drone is over along the aisle."""
    return min(tracks.across_y, key=lambda line: abs(line.offset_m)).id


def test_each_node_is_climbed_over_and_the_flight_comes_home(flown: Flown) -> None:
    assert (flown.phase, flown.visited) == (Phase.DONE, list(NODES))
    heights = [k.height_m for phase, k in flown.truth if phase in {Phase.CLIMB, Phase.SCAN}]
    assert min(heights) < LOW_M
    assert max(heights) > HIGH_M
    assert not [event for event in flown.events if event.name == "position"]


def test_the_goal_node_is_told_and_held_at_every_height(flown: Flown) -> None:
    seen = 0
    for output, (phase, k) in zip(flown.outputs, flown.truth, strict=True):
        if phase in {Phase.CLIMB, Phase.SCAN} and output.goal in NODES:
            assert output.pose is not None
            node = SITE.nodes[output.goal]
            assert output.pose.node == output.goal
            assert output.pose.integrity > CONFIG.mission.integrity_min
            assert math.hypot(output.pose.x_m - k.x_m, output.pose.y_m - k.y_m) < 0.1
            assert math.hypot(k.x_m - node.x_m, k.y_m - node.y_m) < 0.7, "a view may be half a step aside"
            seen += 1
    assert seen > 100


def test_the_line_that_is_held_stays_the_same_line_through_climbs_and_crossings(flown: Flown) -> None:
    in_air = [
        output.tracks
        for output, (phase, _) in zip(flown.outputs, flown.truth, strict=True)
        if phase in {Phase.FOLLOW, Phase.HOVER, Phase.CLIMB, Phase.SCAN} and output.tracks
    ]
    changes = sum(held(a) != held(b) for a, b in pairwise(in_air))
    assert changes == 0
