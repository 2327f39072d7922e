"""Old lines and tape on the floor: where they lie, how much of them there is, and what keeps as it was."""

from __future__ import annotations

import math
import statistics
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flightd.config.paths import shipped
from flightd.core.paint import paint_srgb
from flightd.sim.floor.paint_damage import Stripe, drawn_damage, painted_m, runs_along_x, stroke_box
from flightd.sim.floor.strange_lines import drawn_old_lines, drawn_tapes
from flightd.sim.floor.texture import Box
from flightd.sim.random_sites import random_site
from flightd.sim.unknowns import SPREADS, WorldKind, unknowns_of
from flightd.site.site import PaintedLine, Site
from flightd.site.site_file import load_site

DEMO = load_site(shipped("site-demo.toml"))
SHARE = 0.03

seeds = st.integers(0, 10_000)


def apart(a: Box, b: Box) -> bool:
    return a[2] <= b[0] or b[2] <= a[0] or a[3] <= b[1] or b[3] <= a[1]


def far_from_home(site: Site, box: Box) -> bool:
    home = site.nodes[site.home.node]
    return (
        math.hypot(*(max(box[k] - at, at - box[k + 2], 0.0) for k, at in enumerate((home.x_m, home.y_m))))
        >= 0.5
    )


def nearest(site: Site, stripe: Stripe) -> tuple[float, PaintedLine]:
    """The parallel line nearest to it, and how far that is aside."""
    along_x = abs(math.sin(stripe.turn_rad)) < 0.5

    def aside_m(line: PaintedLine) -> float:
        return abs(stripe.y_m - line.y0_m if along_x else stripe.x_m - line.x0_m)

    line = min((one for one in site.lines if runs_along_x(one) is along_x), key=aside_m)
    return aside_m(line), line


@given(seeds, seeds)
def test_an_old_line_runs_for_metres_close_beside_a_true_one(which: int, seed: int) -> None:
    site = random_site(which)
    for old in drawn_old_lines(site, 0.3, seed):
        stripe = old.stripe
        assert 2.0 <= stripe.length_m <= 10.0
        aside_m, line = nearest(site, stripe)
        assert 0.05 < aside_m <= 0.4
        assert stripe.length_m <= max(painted_m([one]) for one in site.lines)
        assert apart(stripe.box(), stroke_box(line))
        assert abs(math.sin(2.0 * stripe.turn_rad)) < math.sin(math.radians(0.51))
        assert 0.3 < old.left < 0.9
        assert far_from_home(site, stripe.box())


def test_there_is_as_much_of_old_lines_as_told_in_the_mean() -> None:
    found_m = [
        math.fsum(old.stripe.length_m for old in drawn_old_lines(DEMO, SHARE, seed)) for seed in range(600)
    ]
    assert statistics.fmean(found_m) == pytest.approx(SHARE * painted_m(DEMO.lines), rel=0.25)
    assert max(found_m) > 4.0


@given(seeds, seeds)
def test_tape_is_of_another_colour_and_lies_on_no_line_along_it(which: int, seed: int) -> None:
    site = random_site(which)
    tapes = drawn_tapes(site, SHARE, seed)
    told_m = math.fsum(tape.stripe.length_m for tape in tapes)
    assert told_m == pytest.approx(SHARE * painted_m(site.lines), abs=0.6)
    for tape in tapes:
        assert math.dist(paint_srgb(tape.colour), paint_srgb(site.line_colour)) > 90.0
        assert 0.5 <= tape.stripe.length_m <= 3.0
        assert far_from_home(site, tape.stripe.box())


def test_an_orange_floor_has_no_tape_of_a_colour_like_its_own() -> None:
    orange = replace(DEMO, line_colour="#de621a")
    colours = {tape.colour for seed in range(60) for tape in drawn_tapes(orange, SHARE, seed)}
    assert colours == {"white", "black", "blue", "green"}


def test_the_rough_world_alone_has_both_and_the_other_damage_is_as_without_them() -> None:
    usual = unknowns_of(WorldKind.USUAL, 3).paint_damage(DEMO, 3)
    assert (usual.old_lines, usual.tapes) == ((), ())
    rough = SPREADS[WorldKind.ROUGH]
    floors = [unknowns_of(WorldKind.ROUGH, seed).paint_damage(DEMO, seed) for seed in range(12)]
    for seed, floor in enumerate(floors):
        without = drawn_damage(DEMO, rough.paint_gone, rough.paint_covered, rough.false_lines, seed)
        assert replace(floor, old_lines=(), tapes=()) == without
    assert any(floor.old_lines for floor in floors)
    assert any(floor.tapes for floor in floors)
    assert floors[3] == unknowns_of(WorldKind.ROUGH, 3).paint_damage(DEMO, 3)
