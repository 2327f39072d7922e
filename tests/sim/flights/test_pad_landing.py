"""Landing on a charge pad that was pushed off its place on the map, and starting from one.

`FLIGHTD_SEEDS=4` pushes it so many ways.
"""

from __future__ import annotations

import math
import os
from pathlib import Path

import pytest

from flightd.config.schema import load_config
from flightd.core.errors import InputError
from flightd.core.types import Phase
from flightd.sim.scenario.scenario import FloorScenario
from flightd.site.site import Site
from flightd.site.site_file import load_site, parse_site, site_toml
from tests.sim.ideal.ideal_flight import Flown, IdealFlight
from tests.sim.ideal.ideal_sight import EyeErrors

CONFIGS = Path(__file__).parents[3] / "configs"
CONFIG = load_config(CONFIGS / "sim.toml")
DEMO = load_site(CONFIGS / "site-demo.toml")


def pushed(seed: int, reach_m: float = 0.25) -> Site:
    """The demo site with its pad pushed that far, another way for each seed."""
    angle = 2.4 * seed
    return FloorScenario(pad_off_m=(reach_m * math.cos(angle), reach_m * math.sin(angle))).site(DEMO)


def fly(world: Site, seed: int, **others: object) -> tuple[Flown, float]:
    """The flight, and how far from the pad's true centre it landed."""
    config = CONFIG.with_values(mission={"dwell_s": 0.2})
    flown = IdealFlight(DEMO, config, visits=("A2",), seed=seed, world=world, **others).fly(120)  # type: ignore[arg-type]
    last, (x_m, y_m) = flown.truth[-1][1], world.pad_centre(world.home)
    return flown, math.hypot(last.x_m - x_m, last.y_m - y_m)


@pytest.mark.parametrize("seed", (1, 5, 3, 23)[: 1 + int(os.environ.get("FLIGHTD_SEEDS", "1"))])
def test_it_lands_within_a_decimetre_of_a_pad_that_was_pushed_away(seed: int) -> None:
    flown, error_m = fly(pushed(seed), seed)
    assert (flown.phase, flown.visited) == (Phase.DONE, ["A2"])
    assert error_m <= 0.10


def test_without_a_pad_in_sight_it_lands_on_the_node_of_the_map() -> None:
    flown, _ = fly(DEMO, 3, errors=EyeErrors(pad_px=1e6))
    last, node = flown.truth[-1][1], DEMO.nodes["A1"]
    assert flown.phase is Phase.DONE
    assert math.hypot(last.x_m - node.x_m, last.y_m - node.y_m) <= 0.15


def test_a_line_that_is_out_of_sight_at_the_start_is_found_while_climbing() -> None:
    world = pushed(4)
    flown, error_m = fly(world, 4)
    low = [o for o, (_, k) in zip(flown.outputs, flown.truth, strict=True) if 0.12 < k.height_m < 0.35]
    assert low[0].tracks is not None
    assert not (low[0].tracks.across_x and low[0].tracks.across_y), "not both lines are in sight low down"
    assert [o for o in flown.outputs if o.phase is Phase.ACQUIRE]
    assert (flown.phase, flown.visited) == (Phase.DONE, ["A2"])
    assert error_m <= 0.10


def ending(overrun_m: float) -> Site:
    """The demo site without a mat, aisle A running on that far behind its end nodes, the pad on its end."""
    text = (CONFIGS / "site-demo.toml").read_text()
    aisle_a, rest = text.split("overrun_m = 0.4", 1)
    pad = f'size_m = 0.5\nsign = "line_end"\noffset_m = [{-overrun_m}, 0.0]'
    return parse_site(f"{aisle_a}overrun_m = {overrun_m}{rest.replace('size_m = 0.5', pad)}", "ending")


@pytest.mark.parametrize(("seed", "overrun_m", "within_m"), [(2, 0.25, 0.10), (4, 0.5, 0.12)])
def test_a_pad_without_a_mat_is_found_by_the_end_of_its_line(
    seed: int, overrun_m: float, within_m: float
) -> None:
    """Wherever the line really ends, up to 0.15 m from the map, of which most is put right."""
    world, site = ending(overrun_m), ending(0.35)
    config = CONFIG.with_values(mission={"dwell_s": 0.2})
    flown = IdealFlight(site, config, visits=("A2",), seed=seed, world=world).fly(120)
    last, (x_m, y_m) = flown.truth[-1][1], world.pad_centre(world.home)
    assert (flown.phase, flown.visited) == (Phase.DONE, ["A2"])
    assert math.hypot(last.x_m - x_m, last.y_m - y_m) <= within_m


def test_a_pad_by_a_line_end_needs_one_near_and_survives_its_file() -> None:
    site = ending(0.35)
    assert parse_site(site_toml(site), "again") == site
    with pytest.raises(InputError, match=r"pad\[0\] \(home\)\.sign: no painted line ends within 0\.5 m"):
        parse_site(site_toml(site).replace("offset_m = [-0.35, 0.0]", "offset_m = [0.5, 0.0]"), "far")
