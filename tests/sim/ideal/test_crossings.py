"""The node count over simulated crossings, from pixels on; the bench itself is a command."""

from __future__ import annotations

import random
from dataclasses import replace
from pathlib import Path

import pytest

from flightd.sim.random_sites import random_site
from flightd.site.site import PaintedLine, Site
from flightd.site.site_file import load_site
from tests.sim.ideal.crossing_floors import uniform_grid, uniform_site, worn
from tests.sim.ideal.crossings import LEAST_AVAILABILITY, SURE, Flight, Grid, Trouble, bench, main

DEMO = load_site(Path(__file__).parents[3] / "configs" / "site-demo.toml")
UNIFORM = uniform_site(10, 3, range(1, 11, 9))
"""Aisles that are joined at their ends."""
AS_MAPPED = Trouble(missing=0.0, false=0.0, blind=0.0)
USUAL = Trouble(missing=0.05, false=0.02)
"""What the sensor model reckons with."""


@pytest.mark.parametrize(
    ("grid", "trouble"), [(Grid.RANDOM, USUAL), (Grid.UNIFORM, Trouble(missing=0.0, false=0.0))]
)
def test_no_crossing_is_miscounted_unnoticed(grid: Grid, trouble: Trouble) -> None:
    count = bench(16, grid, trouble, first_seed=3)
    assert count.undetected == 0
    assert count.availability >= LEAST_AVAILABILITY


def test_a_worn_uniform_floor_is_counted_too() -> None:
    """More crossings of more floors are in the guide."""
    count = bench(40, first_seed=5)
    assert count.undetected == 0
    assert count.availability >= 0.7, "a floor with false lines beside true ones, one of the worst"


def test_no_crossing_of_a_worn_floor_of_which_only_lines_are_seen_is_miscounted_unnoticed() -> None:
    assert bench(16, trouble=Trouble(bare=True), first_seed=119).undetected == 0


@pytest.mark.parametrize("off_m", [-0.4, 0.5])
def test_a_false_line_beside_the_place_of_a_missing_one_is_not_taken_for_it(off_m: float) -> None:
    gone = UNIFORM.nodes["A4"]
    lines = tuple(
        PaintedLine(p.x0_m + off_m, p.y0_m, p.x1_m + off_m, p.y1_m, p.width_m)
        if p.x0_m == p.x1_m == gone.x_m and p.y0_m < gone.y_m < p.y1_m
        else p
        for p in UNIFORM.lines
    )
    assert lines != UNIFORM.lines
    flight = Flight(UNIFORM, 3, AS_MAPPED, floor=replace(UNIFORM, lines=lines))
    assert flight.follow(iter([f"A{i}" for i in range(2, 9)]), 6).undetected == 0
    assert flight.pose.node == flight.node


def test_a_worn_floor_lacks_the_share_that_is_told_and_has_so_many_false_lines() -> None:
    whole = uniform_grid(2)
    assert worn(whole, 0.0, 0.0, random.Random(1)) == whole
    left = [worn(whole, 0.2, 0.0, random.Random(seed)) for seed in range(20)]
    share = sum(_painted_m(site) for site in left) / (20 * _painted_m(whole))
    assert share == pytest.approx(0.8, abs=0.02)
    more = [worn(whole, 0.0, 0.3, random.Random(seed)) for seed in range(20)]
    cells = 20 * len(whole.nodes)
    false = sum(len(site.lines) - len(whole.lines) for site in more) / cells
    assert 0.2 < false <= 0.33, "those on true lines are left out"


def _painted_m(site: Site) -> float:
    return sum(abs(p.x1_m - p.x0_m) + abs(p.y1_m - p.y0_m) for p in site.lines)


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        (["0"], "argument crossings: '0' is no whole number from 1 to 10000000"),
        (["10", "--missing", "2"], "argument --missing: '2' is no number from 0 to 1"),
        (["10", "--false", "some"], "argument --false: 'some' is no number from 0 to 5"),
        (["10", "--grid", "round"], "argument --grid: invalid choice: 'round'"),
    ],
)
def test_a_wrong_option_is_refused_in_a_line(
    arguments: list[str], problem: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        main(arguments)
    assert problem in capsys.readouterr().err.splitlines()[-1]


@pytest.mark.parametrize("seed", range(1, 6))
def test_carried_one_cell_off_it_never_tells_a_wrong_node_surely(seed: int) -> None:
    site = DEMO if seed % 3 == 0 else random_site(seed)
    rng = random.Random(seed)
    believed = rng.choice(sorted(site.nodes))
    flight = Flight(site, seed, USUAL, start=rng.choice(site.neighbours(believed)), believed=believed)
    flight.hover(2.0)
    assert not flight.wrong_and_sure
    for _ in range(2):
        flight.fly(1)
        assert not flight.wrong_and_sure
    flight.fly(4)
    flight.hover(2.0)
    assert not flight.wrong_and_sure


def test_where_every_cell_looks_the_same_it_does_not_claim_to_know() -> None:
    flight = Flight(UNIFORM, 1, AS_MAPPED, start="B6", believed="B5")
    assert flight.hover(3.0).integrity < SURE
    rivals = dict(flight.localiser.rivals())
    assert {"B4", "B5", "B6"} <= rivals.keys()


def test_a_shelf_label_settles_what_lines_cannot() -> None:
    flight = Flight(UNIFORM, 1, AS_MAPPED, start="B6", believed="B5")
    flight.hover(2.0)
    label = min(UNIFORM.locations.values(), key=lambda at: abs(at.x_m - UNIFORM.nodes["B6"].x_m))
    at = UNIFORM.nodes["B6"]
    for _ in range(2):
        flight.localiser.sighted(label.code, label.x_m - at.x_m, label.y_m - at.y_m)
    pose = flight.hover(0.5)
    assert (pose.node, pose.integrity >= SURE) == (flight.node, True)


def test_the_end_of_the_aisle_settles_it_too() -> None:
    flight = Flight(UNIFORM, 1, AS_MAPPED, start="B2", believed="B3")
    flight.hover(1.0)
    for _ in range(8):
        flight.fly(1)
        flight.hover(1.0)
        assert not flight.wrong_and_sure
    assert (flight.pose.node, flight.pose.integrity >= SURE) == (flight.node, True)


def test_a_floor_marker_settles_it_at_once() -> None:
    flight = Flight(UNIFORM, 1, AS_MAPPED, start="B6", believed="B5")
    flight.hover(1.0)
    at = UNIFORM.nodes["B6"]
    flight.localiser.marker((at.x_m + 0.3, at.y_m), 0.3, 0.0)
    flight.localiser.marker((at.x_m + 0.3, at.y_m), 0.3, 0.0)
    pose = flight.hover(0.2)
    assert (pose.node, pose.integrity >= SURE) == ("B6", True)
