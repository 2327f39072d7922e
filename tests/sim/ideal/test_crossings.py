"""The node count over many simulated crossings; FLIGHTD_CROSSINGS=10000 runs the whole bench."""

from __future__ import annotations

import itertools
import os
import random
from pathlib import Path

import pytest

from flightd.sim.random_sites import random_site
from flightd.site.layout import lay_out
from flightd.site.site import Aisle, Pad, Rack, Site
from flightd.site.site_file import load_site
from tests.sim.ideal.crossings import SURE, Flight, Trouble, bench

DEMO = load_site(Path(__file__).parents[3] / "configs" / "site-demo.toml")


def uniform_site(nodes: int = 10, aisles: int = 3) -> Site:
    """Aisles that look the same everywhere but at their ends."""
    rows = [Aisle(letter, 0.0, 3.0 * i, (1.5,) * (nodes - 1)) for i, letter in enumerate("ABCDE"[:aisles])]
    crosses = [(f"{a.id}{i}", f"{b.id}{i}") for a, b in itertools.pairwise(rows) for i in (1, nodes)]
    rack = Rack(tuple(row.id for row in rows), 1.35, (0.5,))
    return lay_out("uniform", rows, crosses, [Pad("home", "A1", 0.5)], racks=[rack])


UNIFORM = uniform_site()


@pytest.mark.timeout(1200)
def test_no_crossing_is_miscounted_unnoticed_although_lines_miss_and_false_ones_lie_about() -> None:
    count = bench(int(os.environ.get("FLIGHTD_CROSSINGS", "200")))
    assert count.undetected == 0
    assert count.availability >= 0.98


@pytest.mark.parametrize("seed", [21, 57, 75])
def test_a_false_line_beside_the_place_of_a_missing_one_is_not_taken_for_it(seed: int) -> None:
    """On these floors it lies 0.3 to 0.5 m off, near enough to fit what odometry alone knows."""
    assert Flight(random_site(seed), seed, Trouble()).fly(40).undetected == 0


@pytest.mark.parametrize("seed", range(1, 11))
def test_carried_one_cell_off_it_knows_within_two_nodes_and_never_tells_a_wrong_one(seed: int) -> None:
    site = DEMO if seed % 3 == 0 else random_site(seed)
    rng = random.Random(seed)
    believed = rng.choice(sorted(site.nodes))
    flight = Flight(site, seed, Trouble(), start=rng.choice(site.neighbours(believed)), believed=believed)
    flight.hover(2.0)
    assert not flight.wrong_and_sure
    for _ in range(2):
        flight.fly(1)
        assert not flight.wrong_and_sure
    assert flight.pose.node == flight.node or flight.pose.integrity < SURE
    flight.fly(4)
    assert flight.pose.node == flight.node


def test_where_every_cell_looks_the_same_it_does_not_claim_to_know() -> None:
    flight = Flight(UNIFORM, 1, Trouble(missing=0.0, false=0.0), start="B6", believed="B5")
    assert flight.hover(3.0).integrity < SURE
    rivals = dict(flight.localiser.rivals())
    assert {"B4", "B5", "B6"} <= rivals.keys()


def test_a_shelf_label_settles_what_lines_cannot() -> None:
    flight = Flight(UNIFORM, 1, Trouble(missing=0.0, false=0.0), start="B6", believed="B5")
    flight.hover(2.0)
    label = min(UNIFORM.locations.values(), key=lambda at: abs(at.x_m - UNIFORM.nodes["B6"].x_m))
    at = UNIFORM.nodes["B6"]
    for _ in range(2):
        flight.localiser.sighted(label.code, label.x_m - at.x_m, label.y_m - at.y_m)
    pose = flight.hover(0.5)
    assert (pose.node, pose.integrity >= SURE) == (flight.node, True)


def test_the_end_of_the_aisle_settles_it_too() -> None:
    flight = Flight(UNIFORM, 1, Trouble(missing=0.0, false=0.0), start="B2", believed="B3")
    flight.hover(1.0)
    for _ in range(8):
        flight.fly(1)
        flight.hover(1.0)
        assert not flight.wrong_and_sure
    assert (flight.pose.node, flight.pose.integrity >= SURE) == (flight.node, True)


def test_a_floor_marker_settles_it_at_once() -> None:
    flight = Flight(UNIFORM, 1, Trouble(missing=0.0, false=0.0), start="B6", believed="B5")
    flight.hover(1.0)
    at = UNIFORM.nodes["B6"]
    flight.localiser.marker((at.x_m + 0.3, at.y_m), 0.3, 0.0)
    flight.localiser.marker((at.x_m + 0.3, at.y_m), 0.3, 0.0)
    pose = flight.hover(0.2)
    assert (pose.node, pose.integrity >= SURE) == ("B6", True)
