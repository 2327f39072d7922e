"""What is wrong with a floor's paint: as much as its world says, nothing near a pad, the same for a seed."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flightd.config.paths import shipped
from flightd.sim.floor.paint_damage import UNDAMAGED, PaintDamage, drawn_damage, painted_m, stroke_box
from flightd.sim.floor.texture import Box
from flightd.sim.random_sites import random_site
from flightd.sim.unknowns import NOTHING, SPREADS, WorldKind, unknowns_of
from flightd.site.site import Side, Site
from flightd.site.site_file import load_site

DEMO = load_site(shipped("site-demo.toml"))
GONE, COVERED, FALSE = 0.05, 0.03, 0.03

seeds = st.integers(0, 10_000)


def boxes(damage: PaintDamage) -> list[Box]:
    stripes = [stripe.box() for stripe in damage.false_lines]
    return [*damage.gaps, *damage.pallets, *damage.gratings, *stripes]


def distance_m(box: Box, x_m: float, y_m: float) -> float:
    """From a point to a box."""
    return math.hypot(max(box[0] - x_m, x_m - box[2], 0.0), max(box[1] - y_m, y_m - box[3], 0.0))


def apart(a: Box, b: Box) -> bool:
    return a[2] <= b[0] or b[2] <= a[0] or a[3] <= b[1] or b[3] <= a[1]


def check_shares(site: Site, damage: PaintDamage) -> None:
    total_m = painted_m(site.lines)
    covered_m = math.fsum(painted_m(site.lines, box) for box in damage.pallets + damage.gratings)
    gone_m = math.fsum(painted_m(site.lines, box) for box in damage.gaps)
    false_m = math.fsum(stripe.length_m for stripe in damage.false_lines)
    assert covered_m <= COVERED * total_m + 0.1
    assert gone_m + covered_m == pytest.approx((GONE + COVERED) * total_m, abs=0.15)
    assert false_m == pytest.approx(FALSE * total_m, abs=0.3)


@given(seeds)
def test_as_much_of_the_demo_floor_is_damaged_as_its_world_says(seed: int) -> None:
    damage = drawn_damage(DEMO, GONE, COVERED, FALSE, seed)
    check_shares(DEMO, damage)
    assert damage.pallets or damage.gratings
    assert damage == drawn_damage(DEMO, GONE, COVERED, FALSE, seed)


def test_what_lies_about_lies_before_the_fronts_of_racks_but_never_in_them() -> None:
    """Between aisles A and B racks stand back to back from 1.2 to 1.8 m."""
    (x0_m, x1_m), *_ = [(s.x0_m, s.x1_m) for s in DEMO.shelves if s.aisle == "B" and s.side is Side.LEFT]
    rack, before = (x0_m, 1.2, x1_m, 1.8), (x0_m, 1.8, x1_m, 2.1)
    drawn = [
        stripe.box() for seed in range(30) for stripe in drawn_damage(DEMO, 0.0, 0.0, 0.1, seed).false_lines
    ]
    assert all(apart(box, rack) for box in drawn)
    assert not all(apart(box, before) for box in drawn)


@given(seeds, seeds)
def test_random_floors_are_damaged_alike(which: int, seed: int) -> None:
    site = random_site(which)
    check_shares(site, drawn_damage(site, GONE, COVERED, FALSE, seed))


@given(seeds, seeds)
def test_nothing_lies_near_a_pad_and_each_has_its_own_place(which: int, seed: int) -> None:
    site = random_site(which)
    damage = drawn_damage(site, GONE, COVERED, FALSE, seed)
    home = site.nodes[site.home.node]
    found = boxes(damage)
    assert all(distance_m(box, home.x_m, home.y_m) >= 0.5 for box in found)
    on_edge_m = site.home.size_m / 2 + 0.6
    assert all(distance_m(box, home.x_m, home.y_m) >= on_edge_m - 1e-9 for box in damage.pallets)
    assert all(apart(box, other) for k, box in enumerate(found) for other in found[:k])


@given(seeds, seeds)
def test_false_lines_are_like_the_true_ones_and_never_lie_along_one(which: int, seed: int) -> None:
    site = random_site(which)
    for stripe in drawn_damage(site, 0.0, 0.0, FALSE, seed).false_lines:
        assert 0.5 <= stripe.length_m <= 1.5
        assert 0.7 <= stripe.width_m / site.line_width_m <= 1.3
        off_x_deg = math.degrees(stripe.turn_rad)
        along_x = abs(off_x_deg) <= 10.0
        assert along_x or abs(off_x_deg - 90.0) <= 10.0
        alike = [line for line in site.lines if (line.y0_m == line.y1_m) is along_x]
        assert all(apart(stripe.box(), stroke_box(line, 0.15)) for line in alike)


def test_seeds_and_sizes_differ() -> None:
    drawn = [drawn_damage(DEMO, GONE, COVERED, FALSE, seed) for seed in range(40)]
    assert len(set(drawn)) == 40
    assert any(one.pallets for one in drawn)
    assert any(one.gratings for one in drawn)
    gaps_m = [max(x1 - x0, y1 - y0) for one in drawn for x0, y0, x1, y1 in one.gaps]
    assert max(gaps_m) <= 1.0
    assert sum(gap_m >= 0.3 for gap_m in gaps_m) > 0.7 * len(gaps_m)
    sides_m = {
        tuple(sorted((round(x1 - x0, 3), round(y1 - y0, 3))))
        for one in drawn
        for x0, y0, x1, y1 in one.pallets
    }
    assert sides_m == {(0.8, 1.2)}
    for one in drawn:
        for x0, y0, x1, y1 in one.gratings:
            wide_m, long_m = sorted((x1 - x0, y1 - y0))
            assert 0.149 < wide_m < 0.201
            assert 0.599 < long_m < 1.501


def test_each_world_damages_the_floor_by_its_own_measure() -> None:
    assert NOTHING.paint_damage(DEMO, 3) == UNDAMAGED
    usual = unknowns_of(WorldKind.USUAL, 3).paint_damage(DEMO, 3)
    assert usual == PaintDamage(gaps=usual.gaps)
    gone_m = math.fsum(painted_m(DEMO.lines, gap) for gap in usual.gaps)
    assert gone_m == pytest.approx(SPREADS[WorldKind.USUAL].paint_gone * painted_m(DEMO.lines), abs=0.15)
    rough = unknowns_of(WorldKind.ROUGH, 3).paint_damage(DEMO, 3)
    check_shares(DEMO, rough)
